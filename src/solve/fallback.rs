//! Owns what to do when a strong preconditioner is found not to be positive: carry on with the diagonal one.

use crate::operator::coarsen::Coarsen;
use crate::operator::held::{Constrained, Held};
use crate::operator::{Operator, Preconditioner, SinglePreconditioner};
use crate::solve::cg::{CgInfo, CgParams, CgStep, Ended, Goal, minimise_towards};
use crate::solve::jacobi::Jacobi;
use crate::solve::mixed;

/// [`minimise`](crate::solve::cg::minimise) with `preconditioner`; should that break down, from where it came to with the
/// diagonal. Iterations are those of both.
pub fn minimise_or_fall_back<const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    observe: impl FnMut(CgStep),
) -> CgInfo {
    towards_or_fall_back(operator, held, preconditioner, u, params, None, observe)
}

/// [`minimise_or_fall_back`], to the accuracy of a goal ([`minimise_towards`]).
#[allow(clippy::too_many_arguments)] // minimise's, and the goal
pub fn towards_or_fall_back<const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<Goal<D>>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let first = minimise_towards(
        operator,
        held,
        preconditioner,
        u,
        params,
        goal,
        &mut observe,
    );
    if first.ended != Ended::Breakdown {
        return first;
    }
    carry_on(&first, operator, held, u, params, goal, observe)
}

/// The same by [`mixed`], before it falls back.
pub fn minimise_mixed_or_fall_back(
    operator: &impl Coarsen,
    held: &Held,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let first = mixed::minimise(operator, held, preconditioner, u, params, &mut observe);
    if first.ended != Ended::Breakdown {
        return first;
    }
    carry_on(&first, operator, held, u, params, None, observe)
}

#[allow(clippy::too_many_arguments)] // minimise's, the goal, and what came first
fn carry_on<const D: usize>(
    first: &CgInfo,
    operator: &impl Operator<D>,
    held: &Held,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<Goal<D>>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let diagonal = Jacobi::new(&Constrained {
        inner: operator,
        held,
    });
    let left = CgParams {
        max_iterations: params.max_iterations.saturating_sub(first.iterations),
        ..*params
    };
    let second = minimise_towards(operator, held, &diagonal, u, &left, goal, |step| {
        observe(CgStep {
            iteration: first.iterations + step.iteration,
            ..step
        });
    });
    CgInfo {
        iterations: first.iterations + second.iterations,
        residual: first.residual * second.residual,
        ..second
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Chain;

    impl Operator<1> for Chain {
        fn sites(&self) -> usize {
            50
        }
        fn apply(&self, x: &[[f64; 1]], y: &mut [[f64; 1]]) {
            for i in 0..50 {
                let left = if i > 0 { x[i - 1][0] } else { x[i][0] };
                let right = if i < 49 { x[i + 1][0] } else { x[i][0] };
                y[i][0] = 2.0 * x[i][0] - left - right;
            }
        }
        fn diagonal(&self, d: &mut [[f64; 1]]) {
            d.fill([2.0]);
        }
    }

    struct Indefinite;

    impl Preconditioner<1> for Indefinite {
        fn apply(&self, r: &[[f64; 1]], z: &mut [[f64; 1]]) {
            for (i, (r, z)) in r.iter().zip(z).enumerate() {
                z[0] = if i < 25 { r[0] } else { -2.0 * r[0] };
            }
        }
    }

    #[test]
    fn an_indefinite_preconditioner_does_not_cost_the_result() {
        let mut held = Held::none(50);
        held.hold(0, 0);
        held.hold(49, 0);
        let mut u = vec![[0.0]; 50];
        u[49][0] = 1.0;
        let params = CgParams {
            energy_tolerance: 1e-12,
            ..CgParams::default()
        };
        let info = minimise_or_fall_back(&Chain, &held, &Indefinite, &mut u, &params, |_| ());
        assert!(info.ended.converged());
        // A chain of 49 unit springs stretched by 1: energy uᵀAu = 1/49.
        assert!((info.energy * 49.0 - 1.0).abs() < 1e-10, "{info:?}");
    }
}
