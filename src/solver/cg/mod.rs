//! Owns preconditioned conjugate gradients for `minimise ½ uᵀ A u − fᵀ u` under prescribed unknowns and forces: the iterations and how
//! they end, in any precision.

pub mod correction;
mod double;
pub mod error;
pub mod fallback;
pub mod jacobi;
pub mod mixed;
mod single;
pub mod widened;

use crate::operator::Functional;
use crate::solver::cg::error::EnergyTail;
pub use double::minimise;

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
    /// [`CgInfo::eigenvalue`] of an earlier solve with the same preconditioner, of the same operator, or times the least factor by which an
    /// element's stiffness has fallen since. With it a good start needs no five iterations before it is trusted.
    pub known_eigenvalue: Option<f64>,
}

impl Default for CgParams {
    fn default() -> Self {
        CgParams {
            energy_tolerance: 1e-3,
            residual_tolerance: 1e-12,
            trusted_residual: f64::INFINITY,
            max_iterations: 200_000,
            reference_energy: None,
            known_eigenvalue: None,
        }
    }
}

/// Part of the start's energy below which the faces are joined by a mechanism. The start is the field of a homogeneous bar: 1e-10 of it is
/// far below the stiffness of any body that bears load and far above double precision's rounding.
const MECHANISM_ENERGY: f64 = 1e-10;

/// Fall of the residual's norm, or of the energy, after which both are computed again: far enough from what single precision resolves.
const REPLACE: f64 = 1e-3;

/// Energy, of that made the last time, above which it has risen by more than rounding: each iteration should lower it.
const RISE: f64 = 1.0 + 1e-6;

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
    /// The smallest eigenvalue of the preconditioned operator that was expected at the end: what a later solve may start from
    /// ([`CgParams::known_eigenvalue`]). None where the preconditioner broke down or nothing is known.
    pub eigenvalue: Option<f64>,
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

/// The vectors of a solve in the precision that they are kept in: the residual `r`, `z ≈ A⁻¹ r`, the direction `p` and `A p`.
trait Vectors<const D: usize> {
    /// Whether the iterations alone keep residual and energy exact. If not, both are made again whenever one has fallen by a thousand.
    const EXACT: bool;

    /// One unit of `r` and `p`, in the units of `u`.
    fn unit(&self) -> f64;

    /// Makes `r` from `u`, in a unit that is `factor` times the one before.
    fn residual(&mut self, u: &[[f64; D]], factor: f64) -> State;

    /// `z = M⁻¹ r`; returns `rᵀz`.
    fn precondition(&mut self) -> f64;

    /// `p = z + β p`, `u += α p`, `r −= α A p`; returns `α` and `‖r‖`. None where `pᵀAp` or `rᵀz` is not positive.
    fn step(&mut self, u: &mut [[f64; D]], rz: f64) -> Option<(f64, f64)>;

    /// The goal of `p`.
    fn along(&self, goal: &impl Functional<D>) -> f64;

    /// `fᵀp` of the forces; 0 without.
    fn work_along(&self) -> f64;

    /// Whether forces act.
    fn is_forced(&self) -> bool;
}

/// Whether an iteration can be made with these.
fn are_positive(curvature: f64, rz: f64) -> bool {
    curvature > 0.0 && rz > 0.0 && curvature.is_finite() && rz.is_finite()
}

/// The iterations of [`minimise`], in any precision.
fn iterate<V: Vectors<D>, F: Functional<D>, const D: usize>(
    mut vectors: V,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<&F>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let start = vectors.residual(u, 1.0);
    let forced = vectors.is_forced();
    // Of forces; what is minimised is the elastic energy less twice that work.
    let mut work = start.work;
    let whole = params.reference_energy.unwrap_or(start.energy);
    let mut tail = EnergyTail::knowing(params.known_eigenvalue);
    let mut goal_value = goal.map(|goal| goal.of(u));
    // The energy when it was last made from the displacements, and what the iterations had gained by then.
    let mut anchor = (start.energy, 0.0);
    let expected = |anchor: (f64, f64), tail: &EnergyTail| anchor.0 - (tail.total() - anchor.1);
    let (mut iterations, mut residual) = (0, 1.0);
    let mut ended = match start.norm == 0.0 {
        true => Ended::ResidualTolerance,
        false => Ended::IterationLimit,
    };
    while ended == Ended::IterationLimit {
        let rz = vectors.precondition();
        let unit = vectors.unit();
        if iterations > 0 {
            let energy = expected(anchor, &tail) + 2.0 * work;
            let of_energy = tail.update(unit * unit * rz).map(|e| e / energy);
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
        let Some((alpha, norm)) = vectors.step(u, rz) else {
            ended = Ended::Breakdown;
            break;
        };
        iterations += 1;
        tail.push(alpha, unit * unit * rz);
        if forced {
            work += unit * alpha * vectors.work_along();
        }
        if let (Some(goal), Some(value)) = (goal, goal_value.as_mut()) {
            let change = unit * alpha * vectors.along(goal);
            *value += change;
            tail.push_change(change);
        }
        residual = unit * norm / start.norm;
        let energy = expected(anchor, &tail);
        if residual <= params.residual_tolerance {
            ended = Ended::ResidualTolerance;
        } else if V::EXACT {
            if !forced && energy <= MECHANISM_ENERGY * whole {
                ended = Ended::Mechanism;
            }
        } else if norm < REPLACE || !forced && energy < REPLACE * anchor.0 {
            let now = vectors.residual(u, norm);
            work = now.work;
            let risen = now.energy > anchor.0 + (RISE - 1.0) * anchor.0.abs();
            ended = match checked(ended, energy, now.energy, anchor.0.abs()) {
                _ if !forced && now.energy.abs() <= MECHANISM_ENERGY * whole => Ended::Mechanism,
                _ if risen => Ended::Breakdown,
                Ended::Breakdown => Ended::Breakdown,
                _ if now.norm == 0.0 => Ended::ResidualTolerance,
                goes_on => goes_on,
            };
            anchor = (now.energy, tail.total());
        }
    }
    let end = vectors.residual(u, 1.0);
    ended = checked(ended, expected(anchor, &tail), end.energy, anchor.0.abs());
    // Where nothing is left but rounding, iterations break down. A good preconditioner gets there in a few.
    if ended == Ended::Breakdown && !forced && end.energy.abs() <= MECHANISM_ENERGY * whole {
        ended = Ended::Mechanism;
    }
    let energy = end.energy + 2.0 * end.work;
    CgInfo {
        ended,
        iterations,
        residual: if start.norm > 0.0 {
            end.norm / start.norm
        } else {
            0.0
        },
        energy,
        start_energy: start.energy + 2.0 * start.work,
        energy_error: energy_error(ended, &tail, energy, start.norm),
        goal_error: goal_value.map(|value| goal_error(ended, &tail, value, start.norm)),
        eigenvalue: match ended {
            Ended::Breakdown | Ended::Mechanism => None,
            _ => tail.eigenvalue().or(params.known_eigenvalue),
        },
    }
}

/// How a solve goes on or ends, given what its iterations say the energy is, what it is, and from what they began. In
/// single precision each iteration is off by some 1e-7 of what it lowers the energy by, so all of them by 1e-7 of the start: the bounds
/// leave room for a hundred times that, and for 1 % of a result far below the start.
fn checked(ended: Ended, expected: f64, energy: f64, start: f64) -> Ended {
    match (energy - expected).abs() <= 1e-2 * energy.abs() + 1e-5 * start {
        true => ended,
        false => Ended::Breakdown,
    }
}

/// Whether the estimated relative error of what is wanted meets its tolerance.
fn is_met(params: &CgParams, error: Option<f64>) -> bool {
    error.is_some_and(|e| (0.0..=params.energy_tolerance).contains(&e))
}

/// What to state as the excess of `energy` over its minimum.
fn energy_error(ended: Ended, tail: &EnergyTail, energy: f64, start_norm: f64) -> f64 {
    match (ended, tail.estimate()) {
        (Ended::Breakdown, _) => energy,
        (_, Some(e)) => e,
        (_, None) if start_norm > 0.0 => f64::INFINITY,
        _ => 0.0,
    }
}

/// What to state as the error of the goal.
fn goal_error(ended: Ended, tail: &EnergyTail, value: f64, start_norm: f64) -> f64 {
    match (ended, tail.goal_estimate()) {
        (Ended::Breakdown, _) => value.abs(),
        (_, Some(e)) => e,
        (_, None) if start_norm > 0.0 => f64::INFINITY,
        _ => 0.0,
    }
}

/// Of a displacement field: what is minimised, `uᵀAu − 2 fᵀu`, the work `fᵀu` of the forces, and the norm of its residual.
struct State {
    energy: f64,
    work: f64,
    norm: f64,
}
