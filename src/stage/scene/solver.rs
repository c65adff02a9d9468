//! Owns the choice of the method that solves a step.

use crate::error::{Error, Result};
use crate::operator::nonlinear::Staggered;
use crate::operator::sparse::Sparse;
use crate::solve::chord::Chord;
use crate::solve::newton::{Newton, NotConverged};
use crate::stage::scene::march::Advance;
use crate::topology::dissection::nested_dissection;
use serde::{Deserialize, Serialize};

/// `[physics.*.solver]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolverParams {
    pub method: Method,
    /// Bound on `max(|R_ρ|/ρ*, δ |R_x|/E)`.
    pub tolerance: f64,
    pub max_iterations: usize,
}

impl Default for SolverParams {
    fn default() -> Self {
        SolverParams {
            method: Method::Newton,
            tolerance: 1e-10,
            max_iterations: 30,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Newton on density and placement together, exact tangent, a sparse LU each iteration.
    #[default]
    Newton,
    /// Density and placement in turn, a Cholesky factor of the stiffness reused over steps. For many unknowns and slow
    /// growth; it stops at the same residual.
    Reuse,
}

pub enum Equilibrium {
    Newton(Box<Newton>),
    Chord(Box<Chord>),
}

impl Equilibrium {
    /// `whole` is the pattern of all unknowns, `placements` of those at `positions`; only the one needed is built.
    pub fn new(
        params: &SolverParams,
        whole: impl Fn() -> Sparse,
        placements: impl Fn() -> Sparse,
        positions: &[[f64; 2]],
        reach: f64,
    ) -> Result<Self> {
        let usable = (1e-14..1e-2).contains(&params.tolerance) && params.max_iterations > 0;
        if !usable {
            return Err(Error::setting(
                "solver.tolerance",
                format!(
                    "found {} and max_iterations {}",
                    params.tolerance, params.max_iterations
                ),
                "take a tolerance from 1e-14 to 1e-2 and at least one iteration",
            ));
        }
        let (tolerance, most) = (params.tolerance, params.max_iterations);
        Ok(match params.method {
            Method::Newton => Equilibrium::Newton(Box::new(Newton::new(whole(), tolerance, most)?)),
            Method::Reuse => {
                let order = nested_dissection(positions, reach);
                Equilibrium::Chord(Box::new(Chord::new(placements(), order, tolerance, most)?))
            }
        })
    }

    /// Moves the unknowns with a change of the given values, to first order: `to` are the equations with a small `share`
    /// of the change, `from` those without it. The factor is that of the state before, where the body is at rest.
    pub fn predict(
        &mut self,
        from: &impl Staggered,
        to: &impl Staggered,
        share: f64,
        q: &mut [f64],
    ) -> Result<(), NotConverged> {
        let (mut r0, mut r1) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        from.residual(q, &mut r0);
        to.residual(q, &mut r1);
        let mut dq: Vec<f64> = r1.iter().zip(&r0).map(|(b, a)| (b - a) / share).collect();
        match self {
            Equilibrium::Newton(newton) => newton.respond(from, q, &mut dq)?,
            Equilibrium::Chord(chord) => chord.respond(from, q, &mut dq)?,
        }
        q.iter_mut().zip(&dq).for_each(|(q, dq)| *q += dq);
        Ok(())
    }

    /// Solves a step from the guess `q`. `rate` is how the unknowns moved before, per unit of time, and the time
    /// step: the reusing method starts from where they would go on to.
    pub fn solve(
        &mut self,
        step: &impl Staggered,
        q: &mut [f64],
        rate: Option<(&[f64], f64)>,
    ) -> Result<Advance, NotConverged> {
        match self {
            Equilibrium::Newton(newton) => {
                let done = newton.solve(step, q)?;
                let iterations = done.errors.len() - 1;
                let error = done.errors[iterations];
                Ok(Advance {
                    iterations,
                    factorisations: iterations,
                    error,
                })
            }
            Equilibrium::Chord(chord) => {
                if let Some((rate, dt)) = rate {
                    q.iter_mut().zip(rate).for_each(|(q, v)| *q += v * dt);
                }
                let done = chord.solve(step, q)?;
                Ok(Advance {
                    iterations: done.iterations,
                    factorisations: done.factorisations,
                    error: done.error,
                })
            }
        }
    }
}
