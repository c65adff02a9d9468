//! Owns preconditioned conjugate gradients for `minimise ½ uᵀ A u` under prescribed unknowns.

use crate::operator::held::{Constrained, Held};
use crate::operator::{Operator, Preconditioner};
use crate::par::{CHUNK, dot};
use crate::solve::estimate::EnergyTail;
use rayon::prelude::*;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgParams {
    /// Estimated relative error of the energy `uᵀAu` (and of the goal, where there is one) at which to stop; 0 never
    /// stops by it.
    pub energy_tolerance: f64,
    /// `‖r‖ / ‖r₀‖` at which to stop.
    pub residual_tolerance: f64,
    pub max_iterations: usize,
}

impl Default for CgParams {
    fn default() -> Self {
        CgParams {
            energy_tolerance: 1e-3,
            residual_tolerance: 1e-12,
            max_iterations: 200_000,
        }
    }
}

/// Part of the start's energy below which the rest is nothing. The start is the field of a homogeneous bar: 1e-10 of it is
/// far below any bone's stiffness and far above double precision's rounding.
pub(super) const NOTHING: f64 = 1e-10;

/// Part of the start's energy below which the estimate of its error is not to be trusted: motions that cost so little are
/// found last, and until they are nothing tells of them (a serpentine of 881 voxels, 4e-6 of a bar's energy, settles for
/// a hundred iterations 5 % above its modulus).
const FAINT: f64 = 1e-5;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The estimated energy error met its tolerance.
    EnergyTolerance,
    /// The residual met its tolerance.
    ResidualTolerance,
    /// The estimated error met its tolerance, but too little energy is left for the estimate to be trusted: the energy is
    /// an upper bound.
    Faint,
    /// The energy fell to nothing: what connects the held unknowns only turns and shifts.
    Mechanism,
    IterationLimit,
    /// `pᵀAp <= 0` or a value that is not finite: the operator or preconditioner is not positive on the free unknowns.
    Breakdown,
}

impl Ended {
    pub fn converged(self) -> bool {
        matches!(
            self,
            Ended::EnergyTolerance | Ended::ResidualTolerance | Ended::Mechanism
        )
    }
}

/// What a solve came to.
#[derive(Debug, Clone, PartialEq)]
pub struct CgInfo {
    pub ended: Ended,
    pub iterations: usize,
    /// True `‖r‖ / ‖r₀‖`, recomputed at the end.
    pub residual: f64,
    /// `uᵀAu` of the result.
    pub energy: f64,
    /// Estimated excess of `energy` over its minimum.
    pub energy_error: f64,
    /// Estimated error of the goal, where there is one.
    pub goal_error: Option<f64>,
}

/// A linear functional of the unknowns that is wanted instead of the energy.
pub type Goal<'a, const D: usize> = &'a (dyn Fn(&[[f64; D]]) -> f64 + Sync);

/// Progress, told once an iteration.
#[derive(Debug, Clone, Copy)]
pub struct CgStep {
    pub iteration: usize,
    pub residual: f64,
    /// Estimated relative error of the energy, or of the goal, once there is one.
    pub energy_error: Option<f64>,
}

/// Minimises `½ uᵀAu` over the unknowns that are not held, starting from (and keeping the held values of) `u`.
///
/// The energy is what prescribed displacements minimise, so its error is the squared energy norm of the algebraic
/// error, which conjugate gradients estimates from its own coefficients ([`EnergyTail`]).
pub fn minimise<const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    observe: impl FnMut(CgStep),
) -> CgInfo {
    minimise_towards(operator, held, preconditioner, u, params, None, observe)
}

/// [`minimise`], to the accuracy of a goal. Iteration `j` changes it by `α_j J(p_j)`, exactly; what later iterations will
/// change it by is estimated from the sizes of the past changes ([`EnergyTail::goal_estimate`]). Their signs may differ,
/// so this errs on the safe side. The energy must have met the same tolerance.
#[allow(clippy::too_many_arguments)] // minimise's, and the goal
pub fn minimise_towards<const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<Goal<D>>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let n = operator.sites();
    let constrained = Constrained {
        inner: operator,
        held,
    };
    let mut r = vec![[0.0; D]; n];
    operator.apply(u, &mut r);
    let start_energy = dot(u, &r);
    held.clear(&mut r);
    negate(&mut r);
    let start_norm = dot(&r, &r).sqrt();
    let mut z = vec![[0.0; D]; n];
    let mut p = vec![[0.0; D]; n];
    let mut tail = EnergyTail::default();
    let mut goal_value = goal.map(|goal| goal(u));
    let (mut rz_before, mut residual): (f64, f64) = (1.0, 1.0);
    let (mut iterations, mut ended) = (0, Ended::IterationLimit);
    if start_norm == 0.0 {
        ended = Ended::ResidualTolerance;
    }
    while ended == Ended::IterationLimit {
        preconditioner.apply(&r, &mut z);
        held.clear(&mut z);
        let rz = dot(&r, &z);
        let energy = start_energy - tail.total();
        if iterations > 0 {
            let of_energy = tail.update(rz).map(|e| e / energy);
            let of_goal = goal_value.and_then(|value| Some(tail.goal_estimate()? / value.abs()));
            let error = of_energy.map(|e| of_goal.map_or(e, |g| e.max(g)));
            observe(CgStep {
                iteration: iterations,
                residual,
                energy_error: error,
            });
            if let Some(met) = met(params, error, energy / start_energy) {
                ended = met;
                break;
            }
        }
        if iterations >= params.max_iterations {
            break;
        }
        let beta = if iterations == 0 { 0.0 } else { rz / rz_before };
        combine(&mut p, &z, beta);
        // z now holds A p.
        constrained.apply(&p, &mut z);
        let curvature = dot(&p, &z);
        if !(curvature > 0.0 && rz > 0.0 && curvature.is_finite() && rz.is_finite()) {
            ended = Ended::Breakdown;
            break;
        }
        let alpha = rz / curvature;
        residual = advance(u, &mut r, &p, &z, alpha).sqrt() / start_norm;
        rz_before = rz;
        iterations += 1;
        tail.push(alpha, rz);
        if let (Some(goal), Some(value)) = (goal, goal_value.as_mut()) {
            let change = alpha * goal(&p);
            *value += change;
            tail.push_change(change);
        }
        if residual <= params.residual_tolerance {
            ended = Ended::ResidualTolerance;
        } else if start_energy - tail.total() <= NOTHING * start_energy {
            ended = Ended::Mechanism;
        }
    }
    // What follows needs one vector more.
    drop((z, p));
    let info = finish(operator, held, u, &tail, start_norm, iterations, ended);
    let converged = if start_norm > 0.0 { f64::INFINITY } else { 0.0 };
    CgInfo {
        goal_error: goal.map(|_| tail.goal_estimate().unwrap_or(converged)),
        ..info
    }
}

/// How an iteration ends the solve, should the estimated relative error of what is wanted meet its tolerance. `left` is
/// the part of the start's energy that is left.
pub(super) fn met(params: &CgParams, error: Option<f64>, left: f64) -> Option<Ended> {
    let met = left > 0.0 && error.is_some_and(|e| e <= params.energy_tolerance);
    met.then_some(match left < FAINT {
        true => Ended::Faint,
        false => Ended::EnergyTolerance,
    })
}

/// What to state as the excess of `energy` over its minimum.
pub(super) fn energy_error(ended: Ended, tail: &EnergyTail, energy: f64, start_norm: f64) -> f64 {
    match (ended, tail.estimate()) {
        (Ended::Faint, _) => energy,
        (_, Some(e)) => e,
        (_, None) if start_norm > 0.0 => f64::INFINITY,
        _ => 0.0,
    }
}

fn finish<const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    u: &[[f64; D]],
    tail: &EnergyTail,
    start_norm: f64,
    iterations: usize,
    ended: Ended,
) -> CgInfo {
    let mut r = vec![[0.0; D]; operator.sites()];
    operator.apply(u, &mut r);
    let energy = dot(u, &r);
    held.clear(&mut r);
    let residual = if start_norm > 0.0 {
        dot(&r, &r).sqrt() / start_norm
    } else {
        0.0
    };
    CgInfo {
        ended,
        iterations,
        residual,
        energy,
        energy_error: energy_error(ended, tail, energy, start_norm),
        goal_error: None,
    }
}

fn negate<const D: usize>(r: &mut [[f64; D]]) {
    r.par_iter_mut()
        .with_min_len(CHUNK)
        .for_each(|r| *r = r.map(|v| -v));
}

/// `p = z + β p`.
fn combine<const D: usize>(p: &mut [[f64; D]], z: &[[f64; D]], beta: f64) {
    p.par_iter_mut()
        .with_min_len(CHUNK)
        .zip(z)
        .for_each(|(p, z)| {
            for c in 0..D {
                p[c] = z[c] + beta * p[c];
            }
        });
}

/// `u += α p`, `r −= α q`; returns `r·r`, summed chunk by chunk.
fn advance<const D: usize>(
    u: &mut [[f64; D]],
    r: &mut [[f64; D]],
    p: &[[f64; D]],
    q: &[[f64; D]],
    alpha: f64,
) -> f64 {
    let chunks = (
        u.par_chunks_mut(CHUNK),
        r.par_chunks_mut(CHUNK),
        p.par_chunks(CHUNK),
        q.par_chunks(CHUNK),
    );
    let parts: Vec<f64> = chunks
        .into_par_iter()
        .map(|(u, r, p, q)| {
            let mut sum = 0.0;
            for (((u, r), p), q) in u.iter_mut().zip(r).zip(p).zip(q) {
                for c in 0..D {
                    u[c] += alpha * p[c];
                    r[c] -= alpha * q[c];
                    sum += r[c] * r[c];
                }
            }
            sum
        })
        .collect();
    parts.iter().sum()
}
