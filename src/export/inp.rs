//! Owns the export of voxel elements as a CalculiX or Abaqus input file: nodes, C3D8 bricks, materials, supports, load,
//! and the printing of the moving grip's force. mm, N, MPa.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::error::{Error, Result};
use crate::export::bins::Bins;
use crate::io::atomic;
use crate::measure::apparent::Loaded;
use crate::operator::held::Held;
use crate::physics::plasticity::{Plasticity, VonMises, YieldLaw};
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::supports;
use crate::pipeline::apparent::resolution;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::bricks::{Bricks, Keep};
use crate::pipeline::apparent::voxel_fe::nodes::Gripped;
use crate::pipeline::apparent::{Ends, Load, LoadSteps, Method, SolveParams};
use crate::result::settings::Motion;
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
/// the rigid motions that are left and bears nothing. Moduli that differ come to at most `bins` materials per Poisson's
/// ratio; returned is by what share the element farthest from its material is off.
///
/// # Errors
/// A method or load that has no such file; a specimen that does not join the grips; an unwritable file.
pub fn write(path: &Path, specimen: &Specimen, params: &SolveParams, bins: usize) -> Result<f64> {
    let wrong = |found: &str, advice: &str| Err(Error::setting("--export inp", found, advice));
    if params.method != Method::VoxelFe {
        return wrong("lattices have no bricks", "add --method voxel-fe");
    }
    if params.ends_depth_mm > 0.0 {
        return wrong(
            "uneven ends are not written to such a file",
            "leave --ends-depth out, or cut the ends flat (segment --plane-cut)",
        );
    }
    if params.load == Load::Labels {
        return wrong(
            "supports by label are not written to such a file",
            "use --load uniaxial, confined, or another load between ends",
        );
    }
    if params.load == Load::Stiffness {
        return wrong(
            "six unit strains are six models",
            "use --load uniaxial, confined, or another single load",
        );
    }
    if yields(params).is_none() && params.plasticity.is_some() {
        return wrong(
            "the file has one von Mises law for all tissue",
            "use --plasticity von-mises:YIELD[,HARDENING], or leave it out",
        );
    }
    // The elements of the solve, where they are of another mask than the scan's.
    let resolved = resolution::resolved(specimen, params)?;
    let own = resolution::one_element_a_voxel(params);
    let (specimen, params) = match &resolved {
        Some(resolved) => (resolved, &own),
        None => (specimen, params),
    };
    let tissue = &Tissue::of(specimen, params)?;
    let prepared = Prepared { specimen, tissue };
    let model = Bricks::new(prepared, params, Keep::BetweenGrips)?;
    let mesh = model.mesh();
    if mesh.is_empty() {
        return Err(Error::specimen(
            "no path of bone between the loaded faces",
            "there is nothing to export",
        ));
    }
    let grips = Planes::within(&mesh.grid, params.axis, params.grip_mm)?;
    let (young_mpa, poissons) = match tissue {
        Tissue::Uniform(solid) => (solid.young_mpa, vec![solid.poisson]),
        Tissue::Mixed(mixed) => (mixed.mean_mpa, mixed.poissons.clone()),
    };
    let stiffness: Vec<(f64, u8)> = corners(mesh)
        .map(|node| {
            let (factor, kind) = model.stiffness_of(node);
            (young_mpa * f64::from(factor), kind)
        })
        .collect();
    let materials = Materials::of(&stiffness, &poissons, bins.max(1));
    let gauge_mm = (grips.high - grips.low) as f64 * mesh.grid.spacing_mm[params.axis.index()];
    let motion = EndMotion::of(specimen, params, gauge_mm);
    atomic::write_with(path, |out| {
        fill(out, (mesh, grips), (params, &motion), &materials)
    })?;
    Ok(materials.worst)
}

/// The law of all tissue, where the file has it.
fn yields(params: &SolveParams) -> Option<VonMises> {
    match params.plasticity {
        Some(Plasticity::All(YieldLaw::VonMises(law))) => Some(law),
        _ => None,
    }
}

/// The node of smallest x, y, z of each element, in the order of the elements.
fn corners(mesh: &VoxelMesh) -> impl Iterator<Item = usize> {
    let nodes = mesh.segments.iter().flat_map(|segment| segment.nodes());
    nodes.filter(|&node| mesh.has_element(node))
}

/// Materials by number, and that of each element.
struct Materials {
    /// MPa, and Poisson's ratio.
    table: Vec<(f64, f64)>,
    of: Vec<usize>,
    worst: f64,
}

impl Materials {
    fn of(stiffness: &[(f64, u8)], poissons: &[f64], bins: usize) -> Materials {
        let young: Vec<f64> = stiffness.iter().map(|s| s.0).collect();
        let bins = Bins::of(&young, bins);
        let mut number = vec![None; bins.values.len() * poissons.len()];
        let mut table = Vec::new();
        let of = stiffness.iter().zip(&bins.of).map(|(&(_, kind), &bin)| {
            let (bin, kind) = (bin as usize, usize::from(kind));
            *number[bin * poissons.len() + kind].get_or_insert_with(|| {
                table.push((bins.values[bin], poissons[kind]));
                table.len() - 1
            })
        });
        Materials {
            of: of.collect(),
            worst: bins.worst,
            table,
        }
    }
}

/// What the forces of the upper end say.
fn said(motion: &EndMotion, params: &SolveParams) -> String {
    let Loaded {
        gauge_mm,
        displacement_mm,
        ..
    } = motion.loaded;
    let [x, y, z] = motion.middle_at(gauge_mm);
    match motion.motion {
        // Refused before.
        Motion::ByLabel => String::new(),
        Motion::Along => {
            format!("E_app = force of HIGH x {gauge_mm} mm / (area x {displacement_mm} mm)")
        }
        Motion::Sideways(direction) => format!(
            "force of HIGH along {} moves it by {displacement_mm} mm",
            direction.name()
        ),
        Motion::Tilt(_) | Motion::Turn => format!(
            "{} by {} degrees; moment of HIGH = sum of r x force of its nodes, r from {x}, {y}, {z} mm",
            params.load.name(),
            params.angle_deg
        ),
    }
}

fn fill(
    out: &mut impl Write,
    (mesh, grips): (&VoxelMesh, Planes),
    (params, motion): (&SolveParams, &EndMotion),
    materials: &Materials,
) -> std::io::Result<()> {
    let axis = params.axis.index();
    let nodes = Gripped {
        mesh,
        grips,
        uneven: None,
    };
    let held = supports::held(&nodes, motion, params.load);
    let u = supports::start(&nodes, motion);
    writeln!(
        out,
        "** {} elements; mm, N, MPa; {}",
        mesh.elements,
        said(motion, params)
    )?;
    writeln!(out, "*NODE, NSET=ALL")?;
    let nodes = || (0..mesh.len()).filter(|&node| mesh.around[node] != 0);
    for node in nodes() {
        let [x, y, z] = mesh.position(node);
        writeln!(out, "{}, {x:.10}, {y:.10}, {z:.10}", node + 1)?;
    }
    let elements = by_material(mesh, materials);
    for (material, (young_mpa, poisson)) in materials.table.iter().enumerate() {
        let name = 1 + material;
        writeln!(out, "*ELEMENT, TYPE=C3D8, ELSET=BONE{name}")?;
        for element in &elements[material] {
            brick(out, mesh, element)?;
        }
        writeln!(
            out,
            "*MATERIAL, NAME=TISSUE{name}\n*ELASTIC\n{young_mpa}, {poisson}"
        )?;
        if let Some(law) = yields(params) {
            let after = law.yield_mpa + law.hardening_mpa;
            writeln!(out, "*PLASTIC\n{}, 0.0\n{after}, 1.0", law.yield_mpa)?;
        }
        writeln!(
            out,
            "*SOLID SECTION, ELSET=BONE{name}, MATERIAL=TISSUE{name}"
        )?;
    }
    writeln!(out, "*NSET, NSET=HIGH")?;
    for node in nodes().filter(|&n| mesh.indices(n)[axis] as usize >= grips.high) {
        writeln!(out, "{},", node + 1)?;
    }
    match yields(params) {
        None => writeln!(out, "*STEP\n*STATIC")?,
        Some(_) => {
            // Increments of adaptive lengths are CalculiX's own, up to a tenth.
            let step = match params.steps {
                LoadSteps::Adaptive(_) => 0.1 * params.steps.length(),
                LoadSteps::Even(_) => params.steps.length(),
            };
            writeln!(out, "*STEP, INC=10000\n*STATIC\n{step}, 1.0, 1e-5, {step}")?;
            // Residuals of a thousandth of a percent, as of the solves here.
            writeln!(out, "*CONTROLS, PARAMETERS=FIELD\n1e-5, 1e-3")?;
        }
    }
    writeln!(out, "*BOUNDARY")?;
    boundary(out, mesh, &held, &u)?;
    if params.load == Load::Uniaxial && params.ends == Ends::Free {
        for (node, component) in pins(mesh, grips) {
            writeln!(out, "{}, {c}, {c}, 0.0", node + 1, c = component + 1)?;
        }
    }
    // A moment needs the force of every node.
    let totals = match motion.motion.is_by_angle() {
        true => "YES",
        false => "ONLY",
    };
    writeln!(
        out,
        "*NODE PRINT, NSET=HIGH, TOTALS={totals}\nRF\n*END STEP"
    )
}

/// An element's number in the file, and the node of smallest x, y, z: its segment and place there.
struct Element {
    number: usize,
    segment: u32,
    place: u32,
}

/// The elements of each material, in their order.
fn by_material(mesh: &VoxelMesh, materials: &Materials) -> Vec<Vec<Element>> {
    let mut found: Vec<Vec<Element>> = materials.table.iter().map(|_| Vec::new()).collect();
    let mut number = 0;
    for (s, segment) in mesh.segments.iter().enumerate() {
        for place in (0..segment.len).filter(|i| mesh.has_element((segment.start + i) as usize)) {
            found[materials.of[number]].push(Element {
                number: number + 1,
                segment: s as u32,
                place,
            });
            number += 1;
        }
    }
    found
}

fn brick(out: &mut impl Write, mesh: &VoxelMesh, element: &Element) -> std::io::Result<()> {
    write!(out, "{}", element.number)?;
    let rows = &mesh.segments[element.segment as usize].rows;
    for [x, y, z] in CORNERS {
        // Row (dy, dz) of neighbours, at this node's own x.
        let row = rows[(1 + y + 3 * (1 + z)) as usize];
        write!(out, ", {}", row + element.place + x + 1)?;
    }
    writeln!(out)
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
