//! Owns the export of voxel elements as a CalculiX or Abaqus input file: nodes, C3D8 bricks, material, supports, load,
//! and the printing of the moving grip's force. mm, N, MPa.

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::operator::held::Held;
use crate::stage::solve::bricks::{Bricks, Keep};
use crate::stage::solve::voxel_fe::supports;
use crate::stage::solve::{Ends, Load, Method, SolveParams};
use crate::topology::voxels::{Planes, VoxelMesh};
use crate::volume::Specimen;
use std::io::Write;
use std::path::Path;

/// Corners of a C3D8 brick in its own order.
const CORNERS: [[u32; 3]; 8] = [
    [0, 0, 0],
    [1, 0, 0],
    [1, 1, 0],
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 1],
    [1, 1, 1],
    [0, 1, 1],
];

/// Writes the elements that join the grips. With free ends two nodes of the lower grip are pinned sideways, which stops
/// the rigid motions that are left and bears nothing.
///
/// # Errors
/// A method, load or coarsening that has no such file; a specimen that does not join the grips; an unwritable file.
pub fn write(path: &Path, specimen: &Specimen, params: &SolveParams) -> Result<()> {
    let wrong = |found: &str, advice: &str| Err(Error::setting("--export inp", found, advice));
    if params.method != Method::VoxelFe {
        return wrong("lattices have no bricks", "add --method voxel-fe");
    }
    if params.load == Load::Stiffness {
        return wrong(
            "six unit strains are six models",
            "use --load uniaxial or confined",
        );
    }
    let Bricks::Equal(model) = Bricks::new(specimen, params, Keep::BetweenGrips)? else {
        return wrong(
            "coarsened elements each have a modulus of their own",
            "leave --coarsen out",
        );
    };
    if model.mesh.is_empty() {
        return Err(Error::specimen(
            "no path of bone between the loaded faces",
            "there is nothing to export",
        ));
    }
    let grips = Planes::within(&model.mesh.grid, params.axis, params.grip_mm)?;
    atomic::write_with(path, |out| fill(out, &model.mesh, grips, params))
}

fn fill(
    out: &mut impl Write,
    mesh: &VoxelMesh,
    grips: Planes,
    params: &SolveParams,
) -> std::io::Result<()> {
    let axis = params.axis.index();
    let gauge_mm = (grips.high - grips.low) as f64 * mesh.grid.spacing_mm[axis];
    let (held, u) = supports(mesh, grips, params, params.strain * gauge_mm);
    writeln!(
        out,
        "** {} elements; mm, N, MPa; E_app = force of HIGH x {gauge_mm} mm / (area x {} mm)",
        mesh.elements,
        params.strain * gauge_mm
    )?;
    writeln!(out, "*NODE, NSET=ALL")?;
    let nodes = || (0..mesh.len()).filter(|&node| mesh.around[node] != 0);
    for node in nodes() {
        let [x, y, z] = mesh.position(node);
        writeln!(out, "{}, {x:.10}, {y:.10}, {z:.10}", node + 1)?;
    }
    writeln!(out, "*ELEMENT, TYPE=C3D8, ELSET=BONE")?;
    elements(out, mesh)?;
    writeln!(
        out,
        "*MATERIAL, NAME=TISSUE\n*ELASTIC\n{}, {}\n*SOLID SECTION, ELSET=BONE, MATERIAL=TISSUE",
        params.young_mpa, params.poisson
    )?;
    writeln!(out, "*NSET, NSET=HIGH")?;
    for node in nodes().filter(|&n| mesh.indices(n)[axis] as usize >= grips.high) {
        writeln!(out, "{},", node + 1)?;
    }
    writeln!(out, "*STEP\n*STATIC\n*BOUNDARY")?;
    boundary(out, mesh, &held, &u)?;
    if params.load == Load::Uniaxial && params.ends == Ends::Free {
        for (node, component) in pins(mesh, grips) {
            writeln!(out, "{}, {c}, {c}, 0.0", node + 1, c = component + 1)?;
        }
    }
    writeln!(out, "*NODE PRINT, NSET=HIGH, TOTALS=ONLY\nRF\n*END STEP")
}

fn elements(out: &mut impl Write, mesh: &VoxelMesh) -> std::io::Result<()> {
    let mut number = 0;
    for segment in &mesh.segments {
        for i in 0..segment.len {
            if mesh.around[(segment.start + i) as usize] & 0x80 == 0 {
                continue;
            }
            number += 1;
            write!(out, "{number}")?;
            for [x, y, z] in CORNERS {
                // Row (dy, dz) of neighbours, at this node's own x.
                let row = segment.rows[(1 + y + 3 * (1 + z)) as usize];
                write!(out, ", {}", row + i + x + 1)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}

fn boundary(
    out: &mut impl Write,
    mesh: &VoxelMesh,
    held: &Held,
    u: &[[f64; 3]],
) -> std::io::Result<()> {
    for (node, u) in u.iter().enumerate() {
        for (c, value) in u.iter().enumerate() {
            if mesh.around[node] != 0 && held.is_held(node, c) {
                // CalculiX reads 20 characters of a number.
                writeln!(out, "{}, {c}, {c}, {value:.11e}", node + 1, c = c + 1)?;
            }
        }
    }
    Ok(())
}

/// Two components of one node of the lower grip, and one of that farthest from it: across the line between them.
fn pins(mesh: &VoxelMesh, grips: Planes) -> Vec<(usize, usize)> {
    let axis = grips.axis.index();
    let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
    let low = |n: &usize| mesh.around[*n] != 0 && mesh.indices(*n)[axis] as usize <= grips.low;
    let Some(first) = (0..mesh.len()).find(low) else {
        return Vec::new();
    };
    let apart = |n: usize, a: usize| (mesh.position(n)[a] - mesh.position(first)[a]).abs();
    let distance = |n: &usize| apart(*n, p).hypot(apart(*n, q));
    let last = (0..mesh.len())
        .filter(low)
        .max_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(first);
    let across = if apart(last, p) > apart(last, q) {
        q
    } else {
        p
    };
    vec![(first, p), (first, q), (last, across)]
}
