//! Owns the solve by voxel finite elements: one brick per voxel, supports, multigrid, apparent moduli.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::error::{Error, Result};
use crate::measure::apparent::Loaded;
use crate::operator::Operator;
use crate::operator::held::Held;
use crate::par::sum_chunks;
use crate::pipeline::apparent::bricks::{Bricks, Keep};
use crate::pipeline::apparent::fields;
use crate::pipeline::apparent::fields::Recorded;
use crate::pipeline::apparent::mechanisms::mechanisms;
use crate::pipeline::apparent::resolution;
use crate::pipeline::apparent::resolution::{one_element_a_voxel, resolved};
use crate::pipeline::apparent::solved::{Moduli, Solved};
use crate::pipeline::apparent::{Ends, Load, SolveParams};
use crate::result::settings::{CellType, Method, Settings};
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::cg::fallback::minimise_or_fall_back;
use crate::solver::cg::{CgInfo, CgParams, CgStep, ENERGY_ALONE};
use crate::volume::Specimen;

/// Solves a specimen with one brick per voxel, or finer or coarser ones.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn solve_voxels(
    specimen: &Specimen,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> Result<Solved> {
    Ok(solve_recorded(specimen, params, observe)?.0)
}

/// The same, with the fields and the failure load that the settings ask for.
pub fn solve_recorded(
    specimen: &Specimen,
    params: &SolveParams,
    mut observe: impl FnMut(CgStep),
) -> Result<(Solved, Recorded)> {
    params.check()?;
    if params.load == Load::Stiffness {
        return Err(Error::setting(
            "load",
            "the apparent stiffness matrix is no single modulus",
            "call solve_stiffness",
        ));
    }
    if let Some(resolved) = resolved(specimen, params)? {
        let own = one_element_a_voxel(params);
        let (solved, recorded) = solve_resolved(&resolved, &own, &mut observe)?;
        return Ok((solved, recorded.onto(&specimen.bone)));
    }
    solve_resolved(specimen, params, &mut observe)
}

/// Solves the elements that follow from a specimen's voxels alone.
fn solve_resolved(
    specimen: &Specimen,
    params: &SolveParams,
    observe: &mut impl FnMut(CgStep),
) -> Result<(Solved, Recorded)> {
    let model = Bricks::new(specimen, params, Keep::BetweenGrips)?;
    let mesh = model.mesh();
    let grips = Planes::within(&mesh.grid, params.axis, params.grip_mm)?;
    if mesh.is_empty() {
        return Ok((Solved::disconnected(mesh.dropped), Recorded::default()));
    }
    let axis = params.axis.index();
    let gauge_mm = (grips.high - grips.low) as f64 * mesh.grid.spacing_mm[axis];
    let loaded = Loaded {
        gauge_mm,
        area_mm2: specimen.area_mm2(params.axis),
        displacement_mm: params.strain * gauge_mm,
    };
    let (held, mut u) = supports(mesh, grips, params, loaded.displacement_mm);
    let cg = CgParams {
        energy_tolerance: params.tolerance,
        max_iterations: params.max_iterations,
        ..CgParams::default()
    };
    let mechanisms = match params.mechanisms {
        true => Some(mechanisms(&model, &held, &grid_places(mesh), 1)?),
        false => None,
    };
    let preconditioner = Amg::new(&model, &held, &AmgParams::new(mesh.grid.spacing_mm));
    let info = minimise_or_fall_back(
        &model,
        &held,
        &preconditioner,
        &mut u,
        &cg,
        ENERGY_ALONE,
        observe,
    );
    drop(preconditioner);
    let moduli = assess(&model, mesh, grips, &loaded, &u, &info);
    let force_n = moduli.from_reaction_mpa * loaded.area_mm2 * params.strain;
    let recorded = fields::record(&model, specimen, params, &u, force_n)?;
    let solved = Solved {
        sites: mesh.elements,
        dropped: mesh.dropped,
        unknowns: held.free::<3>(),
        iterations: info.iterations,
        residual: info.residual,
        ended: info.ended,
        moduli,
        mechanisms,
    };
    Ok((solved, recorded))
}

/// Which unknowns are held, and a start that meets them: the field of a homogeneous bar.
pub fn supports(
    mesh: &VoxelMesh,
    grips: Planes,
    params: &SolveParams,
    displacement_mm: f64,
) -> (Held, Vec<[f64; 3]>) {
    let axis = params.axis.index();
    let mut held = Held::none(mesh.len());
    let mut u = vec![[0.0; 3]; mesh.len()];
    for segment in &mesh.segments {
        for (i, node) in segment.nodes().enumerate() {
            let at = [
                segment.at[0] as usize + i,
                segment.at[1] as usize,
                segment.at[2] as usize,
            ];
            let exists = mesh.around[node] != 0;
            let gripped = at[axis] <= grips.low || at[axis] >= grips.high;
            for (c, &plane) in at.iter().enumerate() {
                let side = plane == 0 || plane == mesh.grid.n[c];
                let confined = params.load == Load::Confined && c != axis && side;
                let bonded = gripped && (c == axis || params.ends == Ends::Bonded);
                if confined || bonded || !exists {
                    held.hold(node, c);
                }
            }
            if exists {
                u[node][axis] = displacement_mm * along(grips, at[axis]);
            }
        }
    }
    (held, u)
}

/// Node indices of every node.
pub fn grid_places(mesh: &VoxelMesh) -> Vec<[i32; 3]> {
    (0..mesh.len())
        .map(|node| mesh.indices(node).map(|v| v as i32))
        .collect()
}

/// How far a plane lies from the lower grip to the upper: 0 to 1.
fn along(grips: Planes, plane: usize) -> f64 {
    (plane.clamp(grips.low, grips.high) - grips.low) as f64 / (grips.high - grips.low) as f64
}

fn assess(
    model: &Bricks,
    mesh: &VoxelMesh,
    grips: Planes,
    loaded: &Loaded,
    u: &[[f64; 3]],
    info: &CgInfo,
) -> Moduli {
    let axis = grips.axis.index();
    let mut force = vec![[0.0; 3]; mesh.len()];
    model.apply(u, &mut force);
    // Σ x_i f_i is the volume integral of the stress, exactly, since positions are a displacement field of the
    // elements; clamped to the gauge, it is the integral between the innermost gripped planes.
    let sum = |weight: &(dyn Fn(usize) -> f64 + Sync)| {
        sum_chunks(mesh.segments.len(), |range| {
            let part = |s: usize| {
                let segment = &mesh.segments[s];
                let nodes = segment.nodes().enumerate();
                nodes
                    .map(|(i, node)| {
                        let x = if axis == 0 { i } else { 0 };
                        weight(segment.at[axis] as usize + x) * force[node][axis]
                    })
                    .sum::<f64>()
            };
            range.map(part).sum()
        })
    };
    let reaction = sum(&|plane| if plane >= grips.high { 1.0 } else { 0.0 });
    let virial = loaded.gauge_mm * sum(&|plane| along(grips, plane));
    let from_energy_mpa = loaded.from_energy(info.energy);
    Moduli {
        e_app_mpa: from_energy_mpa,
        from_energy_mpa,
        from_reaction_mpa: loaded.from_reaction(reaction),
        from_stress_mpa: loaded.from_virial(virial),
        algebraic_error_mpa: info.energy_error / info.energy * from_energy_mpa,
    }
}

/// The columns that tell that a row is of voxel elements, and of which size (the mean edge where edges differ).
pub fn label(key: Settings, specimen: &Specimen, params: &SolveParams) -> Settings {
    let [x, y, z] = specimen.bone.grid.spacing_mm;
    let edge = if x == y && y == z {
        x
    } else {
        (x * y * z).cbrt()
    };
    Settings {
        method: Method::VoxelFe,
        structure: CellType::Hex8,
        boundary: None,
        lp_mm: edge * params.coarsen as f64 / params.refine as f64,
        elements: Some(resolution::elements(specimen, params)),
        registration_mm: None,
        ..key
    }
}
