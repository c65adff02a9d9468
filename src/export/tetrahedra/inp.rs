//! Owns the deck of ten-node tetrahedra for CalculiX and Abaqus: C3D10, materials, supports, load, and the printing of the moving
//! grip's force. mm, N, MPa.

use crate::error::Result;
use crate::export::bins::Bins;
use crate::io::atomic;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::geometry_fe::GeometryModel;
use crate::pipeline::apparent::{Ends, Load, SolveParams};
use std::io::Write;
use std::path::Path;

/// With free ends two nodes of the lower grip are pinned sideways, which stops the rigid motions that are left and bears nothing.
pub fn write(path: &Path, model: &GeometryModel, params: &SolveParams, bins: usize) -> Result<f64> {
    let elements = model.elements();
    let young = |e: usize| model.young_mpa() * elements.factor(e);
    let young: Vec<f64> = (0..elements.mesh.elements.len()).map(young).collect();
    let bins = Bins::of(&young, bins.max(1));
    atomic::write_with(path, |out| fill(out, model, params, &bins))?;
    Ok(bins.worst)
}

fn fill(
    out: &mut impl Write,
    model: &GeometryModel,
    params: &SolveParams,
    bins: &Bins,
) -> std::io::Result<()> {
    let mesh = &model.elements().mesh;
    let (held, u) = model.end_motion();
    let [gauge_mm, displacement_mm] = model.gauge_and_displacement_mm();
    writeln!(
        out,
        "** {} elements; mm, N, MPa; E_app = force of HIGH x {gauge_mm} mm / (area x {displacement_mm} mm)\n*NODE, NSET=ALL",
        mesh.elements.len()
    )?;
    for (node, [x, y, z]) in mesh.nodes_mm.iter().enumerate() {
        writeln!(out, "{}, {x:.10}, {y:.10}, {z:.10}", node + 1)?;
    }
    for (bin, young_mpa) in bins.values.iter().enumerate() {
        let name = bin + 1;
        writeln!(out, "*ELEMENT, TYPE=C3D10, ELSET=BONE{name}")?;
        for (e, ten) in mesh.elements.iter().enumerate() {
            if bins.of[e] as usize == bin {
                write!(out, "{}", e + 1)?;
                ten.iter().try_for_each(|n| write!(out, ", {}", n + 1))?;
                writeln!(out)?;
            }
        }
        writeln!(
            out,
            "*MATERIAL, NAME=TISSUE{name}\n*ELASTIC\n{young_mpa}, {}\n*SOLID SECTION, ELSET=BONE{name}, MATERIAL=TISSUE{name}",
            model.poisson()
        )?;
    }
    for (set, end) in [("LOW", End::Lower), ("HIGH", End::Upper)] {
        writeln!(out, "*NSET, NSET={set}")?;
        for (node, at) in mesh.nodes_mm.iter().enumerate() {
            if model.grip_of(*at) == Some(end) {
                writeln!(out, "{},", node + 1)?;
            }
        }
    }
    writeln!(out, "*STEP\n*STATIC\n*BOUNDARY")?;
    for (node, u) in u.iter().enumerate() {
        for (c, value) in u.iter().enumerate().filter(|(c, _)| held.is_held(node, *c)) {
            // CalculiX reads 20 characters of a number.
            writeln!(out, "{}, {c}, {c}, {value:.11e}", node + 1, c = c + 1)?;
        }
    }
    if params.load == Load::Uniaxial && params.ends == Ends::Free {
        for (node, c) in pins(model, params.axis.index()) {
            writeln!(out, "{}, {c}, {c}, 0.0", node + 1, c = c + 1)?;
        }
    }
    writeln!(out, "*NODE PRINT, NSET=HIGH, TOTALS=ONLY\nRF\n*END STEP")
}

/// Two components of one node of the lower grip, and one of that farthest from it: across the line between them.
fn pins(model: &GeometryModel, axis: usize) -> Vec<(usize, usize)> {
    let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
    let nodes = &model.elements().mesh.nodes_mm;
    let low = || (0..nodes.len()).filter(|n| model.grip_of(nodes[*n]) == Some(End::Lower));
    let Some(first) = low().next() else {
        return Vec::new();
    };
    let apart = |n: usize, a: usize| (nodes[n][a] - nodes[first][a]).abs();
    let far = |n: &usize| apart(*n, p).hypot(apart(*n, q));
    let last = low()
        .max_by(|a, b| far(a).total_cmp(&far(b)))
        .unwrap_or(first);
    let across = if apart(last, p) > apart(last, q) {
        q
    } else {
        p
    };
    vec![(first, p), (first, q), (last, across)]
}
