//! Owns what to do when a strong preconditioner is found not to be positive: carry on with the diagonal one.

use crate::operator::held::{Constrained, Held};
use crate::operator::{Functional, MixedPrecision, SinglePreconditioner};
use crate::solver::cg;
use crate::solver::cg::jacobi::Jacobi;
use crate::solver::cg::mixed;
use crate::solver::cg::{CgInfo, CgParams, CgStep, Ended};

/// Residual, of the start's, above which the diagonal's estimate of its error is not believed. With so weak a
/// preconditioner slow motions are found late: a phantom of BV/TV 0.1 stood still 26 % above its modulus for a hundred
/// iterations, and at a residual of 1e-3 a real stack was 4 % off, at 1e-4 0.07 % (`reports/stability.md`).
const BELIEVED_RESIDUAL: f64 = 1e-4;

/// [`mixed::minimise`]; should `preconditioner` break down, from where it came to with the diagonal, in double
/// precision. Iterations are those of both.
pub fn minimise_or_fall_back<F: Functional<3>>(
    operator: &impl MixedPrecision,
    held: &Held,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    goal: Option<&F>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let first = mixed::minimise(
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
    let diagonal = Jacobi::new(&Constrained {
        inner: operator,
        held,
    });
    let left = CgParams {
        max_iterations: params.max_iterations.saturating_sub(first.iterations),
        whole_energy: Some(first.start_energy),
        believed_residual: BELIEVED_RESIDUAL / first.residual,
        ..*params
    };
    let second = cg::minimise(operator, held, &diagonal, u, &left, goal, |step| {
        observe(CgStep {
            iteration: first.iterations + step.iteration,
            ..step
        });
    });
    CgInfo {
        iterations: first.iterations + second.iterations,
        residual: first.residual * second.residual,
        start_energy: first.start_energy,
        ..second
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::cg::ENERGY_ALONE;
    use crate::solver::cg::mixed::tests::{Chain, stretched};

    struct Indefinite;

    impl SinglePreconditioner<3> for Indefinite {
        fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, _: &mut Vec<[f32; 3]>) {
            for (i, (r, z)) in r.iter().zip(z).enumerate() {
                z[0] = if i < 25 { r[0] } else { -2.0 * r[0] };
            }
        }
    }

    #[test]
    fn an_indefinite_preconditioner_does_not_cost_the_result() {
        let (held, mut u) = stretched(50);
        let params = CgParams {
            energy_tolerance: 1e-12,
            ..CgParams::default()
        };
        let chain = Chain::of(50);
        let info = minimise_or_fall_back(
            &chain,
            &held,
            &Indefinite,
            &mut u,
            &params,
            ENERGY_ALONE,
            |_| (),
        );
        assert!(info.ended.converged());
        // A chain of 49 unit springs stretched by 1: energy uᵀAu = 1/49.
        assert!((info.energy * 49.0 - 1.0).abs() < 1e-10, "{info:?}");
    }
}
