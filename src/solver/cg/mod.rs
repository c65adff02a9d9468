//! Owns preconditioned conjugate gradients for `minimise ½ uᵀ A u` under prescribed unknowns.

pub mod correction;
pub mod error;
pub mod fallback;
pub mod jacobi;
pub mod mixed;
pub mod widened;

use crate::operator::held::{Constrained, Held};
use crate::operator::{Functional, Operator, Preconditioner};
use crate::par::{CHUNK, dot};
use crate::solver::cg::error::EnergyTail;
use rayon::prelude::*;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgParams {
    /// Estimated relative error of the energy `uᵀAu` (and of the goal, where there is one) at which to stop; 0 never
    /// stops by it.
    pub energy_tolerance: f64,
    /// `‖r‖ / ‖r₀‖` at which to stop.
    pub residual_tolerance: f64,
    /// `‖r‖ / ‖r₀‖` above which an estimated error is not trusted.
    pub trusted_residual: f64,
    pub max_iterations: usize,
    /// Energy `uᵀAu` that a mechanism's is compared with; the start's where there is none.
    pub reference_energy: Option<f64>,
}

impl Default for CgParams {
    fn default() -> Self {
        CgParams {
            energy_tolerance: 1e-3,
            residual_tolerance: 1e-12,
            trusted_residual: f64::INFINITY,
            max_iterations: 200_000,
            reference_energy: None,
        }
    }
}

/// Part of the start's energy below which the faces are joined by a mechanism. The start is the field of a homogeneous bar: 1e-10 of it is
/// far below the stiffness of any body that bears load and far above double precision's rounding.
pub(super) const MECHANISM_ENERGY: f64 = 1e-10;

/// How a solve by conjugate gradients ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The estimated energy error met its tolerance.
    EnergyTolerance,
    /// The residual met its tolerance.
    ResidualTolerance,
    /// The energy fell to nothing: what connects the held unknowns only turns and shifts.
    Mechanism,
    /// The settings' number of iterations was reached.
    IterationLimit,
    /// `pᵀAp <= 0`, a value that is not finite, or an energy other than what the iterations came to: the operator or
    /// preconditioner is not symmetric and positive on the free unknowns.
    Breakdown,
}

impl Ended {
    /// Whether the result can be used.
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
    /// `uᵀAu` of the start.
    pub start_energy: f64,
    /// Estimated excess of `energy` over its minimum.
    pub energy_error: f64,
    /// Estimated error of the goal, where there is one.
    pub goal_error: Option<f64>,
}

/// The goal of a solve of which nothing but the energy is wanted.
pub enum NoGoal {}

pub const ENERGY_ALONE: Option<&NoGoal> = None;

impl<const D: usize> Functional<D> for NoGoal {
    fn of(&self, _: &[[f64; D]]) -> f64 {
        match *self {}
    }

    fn of_single(&self, _: &[[f32; D]]) -> f64 {
        match *self {}
    }
}

/// Progress, reported once an iteration.
#[derive(Debug, Clone, Copy)]
pub struct CgStep {
    /// Number of the iteration, from 1.
    pub iteration: usize,
    /// `‖r‖ / ‖r₀‖`.
    pub residual: f64,
    /// Estimated relative error of the energy, or of the goal, once there is one.
    pub energy_error: Option<f64>,
}

/// Minimises `½ uᵀAu` over the unknowns that are not held, starting from (and keeping the held values of) `u`.
///
/// The energy is what prescribed displacements minimise, so its error is the squared energy norm of the algebraic
/// error, which conjugate gradients estimates from its own coefficients ([`EnergyTail`]).
///
/// Where a `goal` is wanted instead of the energy, it is found to the same accuracy. Iteration `j` changes it by
/// `α_j J(p_j)`, exactly; what later iterations will change it by is estimated from the sizes of the past changes
/// ([`EnergyTail::goal_estimate`]). Their signs may differ, so this errs on the safe side.
pub fn minimise<F: Functional<D>, const D: usize>(
    operator: &impl Operator<D>,
    held: &Held,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<&F>,
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
    let whole = params.reference_energy.unwrap_or(start_energy);
    let mut z = vec![[0.0; D]; n];
    let mut p = vec![[0.0; D]; n];
    // A p of the last iteration.
    let mut image = vec![[0.0; D]; n];
    let mut alpha = 0.0;
    let mut tail = EnergyTail::default();
    let mut goal_value = goal.map(|goal| goal.of(u));
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
            let error = tail.with_goal(of_energy, goal_value);
            observe(CgStep {
                iteration: iterations,
                residual,
                energy_error: error,
            });
            let believed = error.filter(|_| residual <= params.trusted_residual);
            if is_met(params, believed) {
                ended = Ended::EnergyTolerance;
                break;
            }
        }
        if iterations >= params.max_iterations {
            break;
        }
        // z·(r − r₋) / (r₋·z₋) with r − r₋ = −α A p: what rounding makes of the preconditioner is not quite symmetric.
        let beta = match iterations {
            0 => 0.0,
            _ => -alpha * dot(&z, &image) / rz_before,
        };
        combine(&mut p, &z, beta);
        constrained.apply(&p, &mut image);
        let curvature = dot(&p, &image);
        if !(curvature > 0.0 && rz > 0.0 && curvature.is_finite() && rz.is_finite()) {
            ended = Ended::Breakdown;
            break;
        }
        // The step that minimises along p; r·p is r·z but for rounding.
        alpha = dot(&r, &p) / curvature;
        residual = advance(u, &mut r, &p, &image, alpha).sqrt() / start_norm;
        rz_before = rz;
        iterations += 1;
        tail.push(alpha, rz);
        if let (Some(goal), Some(value)) = (goal, goal_value.as_mut()) {
            let change = alpha * goal.of(&p);
            *value += change;
            tail.push_change(change);
        }
        if residual <= params.residual_tolerance {
            ended = Ended::ResidualTolerance;
        } else if start_energy - tail.total() <= MECHANISM_ENERGY * whole {
            ended = Ended::Mechanism;
        }
    }
    // What follows needs one vector more.
    drop((z, p, image));
    let end = state(operator, held, u);
    ended = checked(ended, start_energy - tail.total(), end.energy, start_energy);
    CgInfo {
        ended,
        iterations,
        residual: if start_norm > 0.0 {
            end.norm / start_norm
        } else {
            0.0
        },
        energy: end.energy,
        start_energy,
        energy_error: energy_error(ended, &tail, end.energy, start_norm),
        goal_error: goal_value.map(|value| goal_error(ended, &tail, value, start_norm)),
    }
}

/// How a solve goes on or ends, given what its iterations say the energy is, what it is, and from what they began. In
/// single precision each iteration is off by some 1e-7 of what it lowers the energy by, so all of them by 1e-7 of the start: the bounds
/// leave room for a hundred times that, and for 1 % of a result far below the start.
pub(super) fn checked(ended: Ended, expected: f64, energy: f64, start: f64) -> Ended {
    match (energy - expected).abs() <= 1e-2 * energy.abs() + 1e-5 * start {
        true => ended,
        false => Ended::Breakdown,
    }
}

/// Whether the estimated relative error of what is wanted meets its tolerance.
pub(super) fn is_met(params: &CgParams, error: Option<f64>) -> bool {
    error.is_some_and(|e| (0.0..=params.energy_tolerance).contains(&e))
}

/// What to state as the excess of `energy` over its minimum.
pub(super) fn energy_error(ended: Ended, tail: &EnergyTail, energy: f64, start_norm: f64) -> f64 {
    match (ended, tail.estimate()) {
        (Ended::Breakdown, _) => energy,
        (_, Some(e)) => e,
        (_, None) if start_norm > 0.0 => f64::INFINITY,
        _ => 0.0,
    }
}

/// What to state as the error of the goal.
pub(super) fn goal_error(ended: Ended, tail: &EnergyTail, value: f64, start_norm: f64) -> f64 {
    match (ended, tail.goal_estimate()) {
        (Ended::Breakdown, _) => value.abs(),
        (_, Some(e)) => e,
        (_, None) if start_norm > 0.0 => f64::INFINITY,
        _ => 0.0,
    }
}

/// Of a displacement field: its energy `uᵀAu` and the norm of its residual.
pub(super) struct State {
    pub energy: f64,
    pub norm: f64,
}

/// State of `u`.
fn state<const D: usize>(operator: &impl Operator<D>, held: &Held, u: &[[f64; D]]) -> State {
    let mut r = vec![[0.0; D]; operator.sites()];
    operator.apply(u, &mut r);
    let energy = dot(u, &r);
    held.clear(&mut r);
    State {
        energy,
        norm: dot(&r, &r).sqrt(),
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
