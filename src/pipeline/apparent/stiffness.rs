//! Owns the apparent stiffness matrix: six unit strains on voxel elements, one preconditioner per set of supports.

use crate::discretisation::voxels::VoxelMesh;
use crate::error::{Error, Result};
use crate::measure::stiffness::{Six, unit_strain};
use crate::operator::Operator;
use crate::operator::held::Held;
use crate::par::{CHUNK, dot, sum_chunks};
use crate::pipeline::apparent::bricks::{Bricks, Keep};
use crate::pipeline::apparent::resolution::{one_element_a_voxel, resolved};
use crate::pipeline::apparent::{Conditions, SolveParams};
use crate::solver::amg::{Amg, AmgParams};
use crate::solver::cg::fallback::minimise_or_fall_back;
use crate::solver::cg::{CgParams, CgStep, ENERGY_ALONE, Ended};
use crate::volume::Specimen;
use rayon::prelude::*;

/// An apparent stiffness and how it was come by. Voigt order 11, 22, 33, 23, 13, 12, engineering shears, MPa.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    pub elements: usize,
    pub dropped: usize,
    /// Of the load with the most.
    pub unknowns: usize,
    /// Of each unit strain.
    pub iterations: [usize; 6],
    /// The largest of the six.
    pub residual: f64,
    /// How the worst of the six ended.
    pub ended: Ended,
    /// Symmetric.
    pub matrix_mpa: Six,
    /// Estimated algebraic error of each entry.
    pub error_mpa: Six,
    /// Largest difference of two entries that symmetry makes one, before their mean was taken. Zero by construction
    /// under kinematic conditions.
    pub asymmetry_mpa: f64,
}

/// Mean stresses under six unit strains of the volume of interest, which must be a box.
///
/// Kinematic: every node on the box's faces is displaced as the homogeneous strain says (upper bound; Hill's condition
/// holds, so `C_ij = a(u_i, u_j) / V`, off to second order in the algebraic error). Mixed: periodicity-compatible mixed
/// uniform conditions of Pahr & Zysset (2008), faces free to slide as an orthotropic cell's would; `C_ij` is the mean
/// stress `i` under strain `j`, off to first order outside the diagonal, so the energy is known to the tolerance's square.
///
/// # Errors
/// A volume of interest that is no box, too many nodes.
pub fn solve_stiffness(
    specimen: &Specimen,
    params: &SolveParams,
    mut observe: impl FnMut(usize, CgStep),
) -> Result<Stiffness> {
    params.check()?;
    let size = specimen.bone.grid.size_mm();
    let volume = size.iter().product::<f64>();
    if (specimen.tv_mm3 / volume - 1.0).abs() > 1e-9 {
        return Err(Error::specimen(
            format!(
                "the volume of interest is {}, and unit strains are put on the faces of a box",
                specimen.tv_definition
            ),
            "segment with --voi box and a --crop inside the specimen",
        ));
    }
    if let Some(resolved) = resolved(specimen, params)? {
        return of_faces(&resolved, &one_element_a_voxel(params), &mut observe);
    }
    of_faces(specimen, params, &mut observe)
}

/// The same for the elements that follow from a specimen's voxels alone.
fn of_faces(
    specimen: &Specimen,
    params: &SolveParams,
    observe: &mut impl FnMut(usize, CgStep),
) -> Result<Stiffness> {
    let volume = specimen.bone.grid.size_mm().iter().product::<f64>();
    let model = Bricks::new(specimen, params, Keep::AtFaces)?;
    let mesh = model.mesh();
    let mut sum = Stiffness {
        elements: mesh.elements,
        dropped: mesh.dropped,
        unknowns: 0,
        iterations: [0; 6],
        residual: 0.0,
        ended: Ended::EnergyTolerance,
        matrix_mpa: [[0.0; 6]; 6],
        error_mpa: [[0.0; 6]; 6],
        asymmetry_mpa: 0.0,
    };
    if mesh.is_empty() {
        return Ok(sum);
    }
    let cg = CgParams {
        energy_tolerance: match params.conditions {
            Conditions::Kinematic => params.tolerance,
            Conditions::Mixed => params.tolerance.powi(2),
        },
        max_iterations: params.max_iterations,
        ..CgParams::default()
    };
    let mut products = Products::new(params.conditions);
    for &loads in groups(params.conditions) {
        let held = supports(mesh, params.conditions, loads[0]);
        let preconditioner = Amg::new(&model, &held, &AmgParams::new(mesh.grid.spacing_mm));
        sum.unknowns = sum.unknowns.max(held.free::<3>());
        for &load in loads {
            let mut u = affine(mesh, load);
            let info = minimise_or_fall_back(
                &model,
                &held,
                &preconditioner,
                &mut u,
                &cg,
                ENERGY_ALONE,
                |step| observe(load, step),
            );
            sum.iterations[load] = info.iterations;
            sum.residual = sum.residual.max(info.residual);
            if !info.ended.converged() {
                sum.ended = info.ended;
            }
            products.take(&model, load, u, info.energy_error);
        }
    }
    (sum.matrix_mpa, sum.error_mpa, sum.asymmetry_mpa) = products.stiffness(volume);
    Ok(sum)
}

/// Loads that share their supports.
fn groups(conditions: Conditions) -> &'static [&'static [usize]] {
    match conditions {
        Conditions::Kinematic => &[&[0, 1, 2, 3, 4, 5]],
        Conditions::Mixed => &[&[0, 1, 2], &[3], &[4], &[5]],
    }
}

/// The components of `u = ε x` that a load prescribes, and padding.
fn supports(mesh: &VoxelMesh, conditions: Conditions, load: usize) -> Held {
    let prescribed = |face: usize, component: usize| match (conditions, load) {
        (Conditions::Kinematic, _) => true,
        (Conditions::Mixed, 0..3) => component == face,
        // Shear in the plane of p and q, out of it r: p's faces carry u_q and u_r, q's u_p and u_r, r's u_r.
        (Conditions::Mixed, _) => {
            let out = load - 3;
            component == out || face != out && component != face
        }
    };
    let mut held = Held::none(mesh.len());
    each_node(mesh, |node, at| {
        let on = |face: &usize| at[*face] == 0 || at[*face] == mesh.grid.n[*face];
        for component in 0..3 {
            let stopped = (0..3).filter(on).any(|face| prescribed(face, component));
            if mesh.around[node] == 0 || stopped {
                held.hold(node, component);
            }
        }
    });
    held
}

fn each_node(mesh: &VoxelMesh, mut f: impl FnMut(usize, [usize; 3])) {
    for segment in &mesh.segments {
        let [x, y, z] = segment.at.map(|v| v as usize);
        for (i, node) in segment.nodes().enumerate() {
            f(node, [x + i, y, z]);
        }
    }
}

/// `u = ε x` of a unit strain, `x` from the middle of the box.
fn affine(mesh: &VoxelMesh, load: usize) -> Vec<[f64; 3]> {
    let (strain, size) = (unit_strain(load), mesh.grid.size_mm());
    let mut u = vec![[0.0; 3]; mesh.len()];
    each_node(mesh, |node, at| {
        if mesh.around[node] != 0 {
            let x: [f64; 3] =
                std::array::from_fn(|a| at[a] as f64 * mesh.grid.spacing_mm[a] - 0.5 * size[a]);
            u[node] = strain.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2]);
        }
    });
    u
}

/// What is drawn from each solved load before the next.
struct Products {
    conditions: Conditions,
    /// `a(u_i, u_j)` (kinematic) or `a(ε_i x, u_j)` (mixed), N mm.
    work: Six,
    /// Squared energy norm of each load's algebraic error.
    error: [f64; 6],
    /// Squared energy norm of the homogeneous strains (mixed).
    affine: [f64; 6],
    /// Departures of the solved fields from the homogeneous strain (kinematic). Single precision: an error of 1e-7 in a
    /// test field costs 1e-7 of the algebraic error.
    departures: Vec<Vec<[f32; 3]>>,
}

impl Products {
    fn new(conditions: Conditions) -> Self {
        Products {
            conditions,
            work: [[0.0; 6]; 6],
            error: [0.0; 6],
            affine: [0.0; 6],
            departures: Vec::new(),
        }
    }

    /// Loads come in order.
    fn take(&mut self, model: &Bricks, load: usize, mut u: Vec<[f64; 3]>, error: f64) {
        let mesh = model.mesh();
        let mut force = vec![[0.0; 3]; mesh.len()];
        model.apply(&u, &mut force);
        self.error[load] = error;
        self.work[load][load] = dot(&u, &force);
        for other in (0..6).filter(|&other| other != load) {
            self.work[other][load] = dot(&affine(mesh, other), &force);
        }
        match self.conditions {
            Conditions::Kinematic => {
                for (other, departure) in self.departures.iter().enumerate() {
                    self.work[other][load] += mixed_dot(departure, &force);
                    self.work[load][other] = self.work[other][load];
                }
                subtract(&mut u, &affine(mesh, load));
                let single = u.par_iter().map(|u| u.map(|v| v as f32)).collect();
                self.departures.push(single);
            }
            Conditions::Mixed => {
                let homogeneous = affine(mesh, load);
                model.apply(&homogeneous, &mut force);
                self.affine[load] = dot(&homogeneous, &force);
            }
        }
    }

    fn stiffness(&self, volume: f64) -> (Six, Six, f64) {
        let w = &self.work;
        let matrix = |i: usize, j: usize| 0.5 * (w[i][j] + w[j][i]) / volume;
        let norm = |i: usize, j: usize| match self.conditions {
            _ if i == j => self.error[i],
            Conditions::Kinematic => (self.error[i] * self.error[j]).sqrt(),
            Conditions::Mixed => {
                let one = (self.affine[i] * self.error[j]).sqrt();
                0.5 * (one + (self.affine[j] * self.error[i]).sqrt())
            }
        };
        let pairs = (0..36).map(|k| (w[k / 6][k % 6] - w[k % 6][k / 6]).abs());
        (
            std::array::from_fn(|i| std::array::from_fn(|j| matrix(i, j))),
            std::array::from_fn(|i| std::array::from_fn(|j| norm(i, j) / volume)),
            pairs.fold(0.0, f64::max) / volume,
        )
    }
}

fn subtract(u: &mut [[f64; 3]], v: &[[f64; 3]]) {
    u.par_iter_mut()
        .with_min_len(CHUNK)
        .zip(v)
        .for_each(|(u, v)| (0..3).for_each(|c| u[c] -= v[c]));
}

fn mixed_dot(x: &[[f32; 3]], y: &[[f64; 3]]) -> f64 {
    sum_chunks(x.len(), |range| {
        let pairs = x[range.clone()].iter().zip(&y[range]);
        pairs
            .map(|(x, y)| (0..3).map(|c| f64::from(x[c]) * y[c]).sum::<f64>())
            .sum()
    })
}
