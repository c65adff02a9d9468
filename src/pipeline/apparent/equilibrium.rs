//! Owns equilibrium: the one way in which every system of equations is solved.

use crate::operator::held::Outside;
use crate::operator::{Functional, MixedPrecision};
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::{Displacements, System};
use crate::pipeline::apparent::params::{Conditions, Load, SolveParams};
use crate::solver::cg::fallback::minimise_or_fall_back;
use crate::solver::cg::{CgInfo, CgParams, CgStep};

/// Is called with the number of a load and how far its solve is.
pub type Observe<'a> = dyn FnMut(usize, CgStep) + 'a;

/// Displacements in equilibrium under each of the `loads`, which share supports and so one preconditioner: conjugate
/// gradients with multigrid, or with the diagonal where multigrid breaks down. Each load is solved when its item is taken.
pub fn equilibrium<'a, O: MixedPrecision, C: Precondition, G: Functional<3>>(
    system: &'a System<'_, O, C, G>,
    loads: &'a [usize],
    params: &SolveParams,
    observe: &'a mut Observe,
) -> impl Iterator<Item = (usize, Displacements, CgInfo)> {
    let mut cg = accuracy(params);
    let multigrid = system.coarsen.precondition(&system.held, &system.multigrid);
    loads.iter().map(move |&load| {
        let mut u = (system.start)(load);
        let outside = Outside {
            held: &system.held,
            forces: system.by_label.and_then(|l| l.by.forces()),
        };
        let info = minimise_or_fall_back(
            system.operator,
            outside,
            &multigrid,
            &mut u,
            &cg,
            system.goal.as_ref(),
            |step| observe(load, step),
        );
        cg.known_eigenvalue = info.eigenvalue;
        if let Some(labels) = system.by_label {
            labels.by.settle(labels.mesh, &mut u);
        }
        (load, u, info)
    })
}

/// Poisson's ratio above which tissue is nearly incompressible.
const NEARLY_INCOMPRESSIBLE: f64 = 0.49;

/// When conjugate gradients may stop. Under conditions that are not kinematic stresses are wanted, which are off to first order where the
/// energy is off to second.
fn accuracy(params: &SolveParams) -> CgParams {
    let stresses = params.load == Load::Stiffness && params.conditions != Conditions::Kinematic;
    // Motions that keep the volume are found late: a loose tolerance stopped at 2.6 times its error.
    let tolerance = match params.poisson > NEARLY_INCOMPRESSIBLE {
        true => params.tolerance.min(1e-3),
        false => params.tolerance,
    };
    CgParams {
        energy_tolerance: match stresses {
            true => tolerance.powi(2),
            false => tolerance,
        },
        max_iterations: params.max_iterations,
        ..CgParams::default()
    }
}
