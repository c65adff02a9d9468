//! Owns the apparent stiffness matrix: six unit strains, one preconditioner per set of supports, of parts that they share.

use crate::error::{Error, Result};
use crate::measure::stiffness::Six;
use crate::operator::MixedPrecision;
use crate::par::{CHUNK, dot, sum_chunks};
use crate::pipeline::apparent::discretisation::{Discretisation, Displacements, LoadSet, System};
use crate::pipeline::apparent::equilibrium::{Observe, equilibrium};
use crate::pipeline::apparent::params::{Conditions, SolveParams};
use crate::solver::cg::{CgInfo, Ended};
use crate::volume::Specimen;
use rayon::prelude::*;

/// Apparent stiffness matrix and statistics of its solves. Voigt order 11, 22, 33, 23, 13, 12, engineering shears, MPa.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    /// Elements that carry load.
    pub elements: usize,
    /// Elements that exist but carry none.
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
/// Symshear: as mixed, with shears put on two pairs of faces; the mean of `C_ij` and `C_ji` is taken.
///
/// # Errors
/// A volume of interest that is no box, a discretisation without faces, too many nodes.
pub fn stiffness<D: Discretisation>(
    build: impl FnOnce() -> Result<D>,
    specimen: &Specimen,
    params: &SolveParams,
    observe: &mut Observe,
) -> Result<Stiffness> {
    let volume = box_mm3(specimen)?;
    let model = build()?;
    let mut products = Products::new(params.conditions);
    let mut sum = Stiffness::none();
    for &loads in groups(params.conditions) {
        let system = model.system(LoadSet::UnitStrains(loads));
        (sum.elements, sum.dropped) = (system.sites, system.dropped);
        if system.sites == 0 {
            return Ok(sum);
        }
        sum.unknowns = sum.unknowns.max(system.held.free::<3>());
        for (load, u, info) in equilibrium(&system, loads, params, observe) {
            sum.add(load, &info);
            products.add(&system, load, u, info.energy_error);
        }
    }
    (sum.matrix_mpa, sum.error_mpa, sum.asymmetry_mpa) = products.stiffness(volume);
    Ok(sum)
}

/// Volume of the specimen's grid, which must be its volume of interest.
fn box_mm3(specimen: &Specimen) -> Result<f64> {
    let volume = specimen.bone.grid.size_mm().iter().product::<f64>();
    if (specimen.tv_mm3 / volume - 1.0).abs() > 1e-9 {
        return Err(Error::specimen(
            format!(
                "the volume of interest is {}, and unit strains are put on the faces of a box",
                specimen.tv_definition
            ),
            "segment with --voi box and a --crop inside the specimen",
        ));
    }
    Ok(volume)
}

impl Stiffness {
    fn none() -> Self {
        Stiffness {
            elements: 0,
            dropped: 0,
            unknowns: 0,
            iterations: [0; 6],
            residual: 0.0,
            ended: Ended::EnergyTolerance,
            matrix_mpa: [[0.0; 6]; 6],
            error_mpa: [[0.0; 6]; 6],
            asymmetry_mpa: 0.0,
        }
    }

    fn add(&mut self, load: usize, info: &CgInfo) {
        self.iterations[load] = info.iterations;
        self.residual = self.residual.max(info.residual);
        if !info.ended.converged() {
            self.ended = info.ended;
        }
    }
}

/// Loads that share their supports.
pub fn groups(conditions: Conditions) -> &'static [&'static [usize]] {
    match conditions {
        Conditions::Kinematic => &[&[0, 1, 2, 3, 4, 5]],
        Conditions::Mixed | Conditions::Symshear => &[&[0, 1, 2], &[3], &[4], &[5]],
    }
}

/// What is drawn from each solved load before the next.
struct Products {
    conditions: Conditions,
    /// `a(u_i, u_j)` (kinematic) or `a(ε_i x, u_j)` (mixed, symshear), N mm.
    work: Six,
    /// Squared energy norm of each load's algebraic error.
    error: [f64; 6],
    /// Squared energy norm of the homogeneous strains (mixed, symshear).
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
    fn add<O: MixedPrecision, C, G>(
        &mut self,
        system: &System<O, C, G>,
        load: usize,
        mut u: Displacements,
        error: f64,
    ) {
        let mut force = vec![[0.0; 3]; u.len()];
        system.operator.apply(&u, &mut force);
        self.error[load] = error;
        self.work[load][load] = dot(&u, &force);
        for other in (0..6).filter(|&other| other != load) {
            self.work[other][load] = dot(&(system.start)(other), &force);
        }
        match self.conditions {
            Conditions::Kinematic => {
                for (other, departure) in self.departures.iter().enumerate() {
                    self.work[other][load] += mixed_dot(departure, &force);
                    self.work[load][other] = self.work[other][load];
                }
                subtract(&mut u, &(system.start)(load));
                let single = u.par_iter().map(|u| u.map(|v| v as f32)).collect();
                self.departures.push(single);
            }
            Conditions::Mixed | Conditions::Symshear => {
                let homogeneous = (system.start)(load);
                system.operator.apply(&homogeneous, &mut force);
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
            Conditions::Mixed | Conditions::Symshear => {
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
