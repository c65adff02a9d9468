//! Owns the choice of precision, and what to do when one does not suffice or a preconditioner is found not to be positive:
//! carry on in double precision, then with the diagonal.

use crate::operator::held::{Constrained, Held, Outside};
use crate::operator::{Functional, MixedPrecision, SinglePreconditioner};
use crate::solver::cg;
use crate::solver::cg::jacobi::Jacobi;
use crate::solver::cg::mixed;
use crate::solver::cg::widened::Widened;
use crate::solver::cg::{CgInfo, CgParams, CgStep, Ended};

/// Residual, of the start's, above which the diagonal's estimate of its error is not trusted. With so weak a
/// preconditioner slow motions are found late: a phantom of BV/TV 0.1 stood still 26 % above its modulus for a hundred
/// iterations, and at a residual of 1e-3 a real stack was 4 % off, at 1e-4 0.07 % (`reports/stability.md`).
const TRUSTED_RESIDUAL: f64 = 1e-4;

/// Largest over smallest stiffness of sites above which conjugate gradients is in double precision. In single precision
/// what a stiff part turning rounds to is as much as what a part 1e4 times as soft bears: two random phases stood still
/// 65 % above their modulus.
const MOST_SPREAD: f64 = 1e4;

/// Residual, of the start's, above which an estimated error is not trusted where stiffness differs by more than
/// [`MOST_SPREAD`], times that spread. The residual is mostly the force of the stiff parts; that of the soft parts vanishes next to it: two
/// random phases at a contrast of 1e6 stood still 32 % above their modulus at residuals of 1e-5 to 1e-6.
const SOFT_RESIDUAL: f64 = 0.1;

/// [`mixed::minimise`], or conjugate gradients in double precision where stiffness differs by more than 1e4 or the former
/// breaks down; should `preconditioner` break down, too, from where it came to with the diagonal. Iterations are those of
/// all.
pub fn minimise_or_fall_back<'a, F: Functional<3>>(
    operator: &impl MixedPrecision,
    outside: impl Into<Outside<'a, 3>>,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    goal: Option<&F>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let outside = outside.into();
    let held = outside.held;
    let mut done = None;
    let mut params = *params;
    let spread = spread(operator, held);
    if spread > MOST_SPREAD {
        params.trusted_residual = params.trusted_residual.min(SOFT_RESIDUAL / spread);
    } else {
        let info = mixed::minimise(
            operator,
            outside,
            preconditioner,
            u,
            &params,
            goal,
            &mut observe,
        );
        if info.ended != Ended::Breakdown {
            return info;
        }
        done = Some(info);
    }
    let widened = Widened::new(preconditioner, operator.sites());
    let left = left_of(&params, done.as_ref());
    let info = cg::minimise(operator, outside, &widened, u, &left, goal, |step| {
        observe(after(done.as_ref(), step));
    });
    let info = joined(done, info);
    if info.ended != Ended::Breakdown {
        return info;
    }
    let diagonal = Jacobi::new(&Constrained {
        inner: operator,
        held,
    });
    let left = CgParams {
        trusted_residual: TRUSTED_RESIDUAL / info.residual,
        known_eigenvalue: None,
        ..left_of(&params, Some(&info))
    };
    let last = cg::minimise(operator, outside, &diagonal, u, &left, goal, |step| {
        observe(after(Some(&info), step));
    });
    // What is known of the diagonal tells nothing of the preconditioner.
    CgInfo {
        eigenvalue: None,
        ..joined(Some(info), last)
    }
}

/// Largest over smallest entry of the diagonal that is free and not zero.
fn spread(operator: &impl MixedPrecision, held: &Held) -> f64 {
    let mut diagonal = vec![[0.0; 3]; operator.sites()];
    operator.diagonal(&mut diagonal);
    let (mut least, mut most) = (f64::INFINITY, 0.0f64);
    for (site, d) in diagonal.iter().enumerate() {
        for (c, &d) in d.iter().enumerate() {
            if d > 0.0 && !held.is_held(site, c) {
                (least, most) = (least.min(d), most.max(d));
            }
        }
    }
    if most > 0.0 { most / least } else { 1.0 }
}

/// What `params` leave to a solve that goes on from another.
fn left_of(params: &CgParams, done: Option<&CgInfo>) -> CgParams {
    match done {
        None => *params,
        Some(done) => CgParams {
            max_iterations: params.max_iterations.saturating_sub(done.iterations),
            reference_energy: Some(done.start_energy),
            ..*params
        },
    }
}

/// A step of a solve that goes on from another, counted from the first one's start.
fn after(done: Option<&CgInfo>, step: CgStep) -> CgStep {
    CgStep {
        iteration: step.iteration + done.map_or(0, |d| d.iterations),
        ..step
    }
}

fn joined(first: Option<CgInfo>, second: CgInfo) -> CgInfo {
    let Some(first) = first else {
        return second;
    };
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
