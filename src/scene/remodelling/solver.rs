//! Owns the choice of the method that solves a step.

use crate::error::{Error, Result};
use crate::operator::nonlinear::Staggered;
use crate::operator::sparse::Sparse;
use crate::scene::state::State;
use crate::solver::chord::Chord;
use crate::solver::direct::dissection::nested_dissection;
use crate::solver::newton::{Newton, NotConverged};
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
    /// growth; it stops at the same residual. A step it cannot take is halved, or left to Newton's method if that is
    /// cheap.
    Reuse,
}

/// What one accepted step took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Advance {
    pub iterations: usize,
    pub factorisations: usize,
    /// Largest dimensionless residual left.
    pub error: f64,
}

pub enum Equilibrium {
    Newton(Box<Newton>),
    Reuse(Box<Reuse>),
}

/// The reusing method, and Newton's for the steps it cannot take, made when first needed.
pub struct Reuse {
    chord: Chord,
    newton: Option<Newton>,
}

/// Up to this many unknowns a step that the reusing method cannot take is given to Newton's at once: its sparse LU takes
/// about a second there. Beyond, the step is halved first, as the reusing method may well take the halves.
const MONOLITHIC: usize = 20_000;

/// The equations a factor belongs to: what was given, the time step, and the densities before it.
#[derive(Debug, Clone, PartialEq)]
pub struct FactorOrigin {
    pub given: Vec<f64>,
    pub dt: f64,
    pub old: Vec<f64>,
}

impl FactorOrigin {
    pub fn save(&self, state: &mut State) {
        state.put("factor.given", self.given.as_slice());
        state.put("factor.dt", [self.dt]);
        state.put("factor.old", self.old.as_slice());
    }

    /// None where the state holds none; `values` is how many are given or not.
    pub fn restore(state: &State, values: usize) -> Result<Option<FactorOrigin>> {
        let Some(old) = state.find("factor.old") else {
            return Ok(None);
        };
        Ok(Some(FactorOrigin {
            given: state.array("factor.given", values)?.to_vec(),
            dt: state.number("factor.dt")?,
            old: old.to_vec(),
        }))
    }
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
                Equilibrium::Reuse(Box::new(Reuse {
                    chord: Chord::new(placements(), order, tolerance, most)?,
                    newton: None,
                }))
            }
        })
    }

    /// Moves the unknowns with a change of the given values, to first order: `to` are the equations with a small `share`
    /// of the change, `from` those without it. The factor is that of the state before, where the body is at rest. True if
    /// that factor is new, and kept.
    pub fn predict(
        &mut self,
        from: &impl Staggered,
        to: &impl Staggered,
        share: f64,
        q: &mut [f64],
    ) -> Result<bool, NotConverged> {
        let (mut r0, mut r1) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        from.residual(q, &mut r0);
        to.residual(q, &mut r1);
        let mut dq: Vec<f64> = r1.iter().zip(&r0).map(|(b, a)| (b - a) / share).collect();
        // Without load, bone may be gone within the step: there is nothing to start from but the guess itself.
        if dq.iter().any(|v| !v.is_finite()) {
            return Ok(false);
        }
        let renewed = match self {
            Equilibrium::Newton(newton) => {
                newton.respond(from, q, &mut dq)?;
                false
            }
            Equilibrium::Reuse(reuse) => reuse.chord.respond(from, q, &mut dq)?,
        };
        q.iter_mut().zip(&dq).for_each(|(q, dq)| *q += dq);
        Ok(renewed)
    }

    /// Solves a step from the guess `q`. `rate` is how the unknowns moved before, per unit of time, and the time
    /// step: the reusing method starts from where they would go on to. `whole` is the pattern of all unknowns.
    pub fn solve(
        &mut self,
        step: &impl Staggered,
        q: &mut [f64],
        rate: Option<(&[f64], f64)>,
        whole: impl Fn() -> Sparse,
    ) -> Result<Advance, NotConverged> {
        match self {
            Equilibrium::Newton(newton) => monolithic(newton, step, q),
            Equilibrium::Reuse(reuse) => reuse.solve(step, q, rate, whole),
        }
    }

    pub fn save(&self, state: &mut State) {
        let Equilibrium::Reuse(reuse) = self else {
            return;
        };
        if let Some((q, kind)) = reuse.chord.factor_in_use() {
            state.put("factor.q", q);
            state.put("factor.kind", kind);
        }
    }

    /// Makes the factor again that was in use; `step` are the equations it belonged to.
    pub fn restore(&mut self, step: &impl Staggered, state: &State, unknowns: usize) -> Result<()> {
        let Equilibrium::Reuse(reuse) = self else {
            return Ok(());
        };
        if state.find("factor.q").is_none() {
            return Ok(());
        }
        let q = state.array("factor.q", unknowns)?;
        let kind = state.array("factor.kind", 2)?;
        let made = reuse.chord.remake(step, q, [kind[0], kind[1]]);
        made.map_err(|why| {
            Error::specimen(
                format!("its saved state: {why}"),
                "start from the beginning with --force",
            )
        })
    }
}

impl Reuse {
    fn solve(
        &mut self,
        step: &impl Staggered,
        q: &mut [f64],
        rate: Option<(&[f64], f64)>,
        whole: impl Fn() -> Sparse,
    ) -> Result<Advance, NotConverged> {
        let start = (q.len() <= MONOLITHIC).then(|| q.to_vec());
        if let Some((rate, dt)) = rate {
            let ahead: Vec<f64> = rate.iter().map(|v| v * dt).collect();
            if step.share(q, &ahead) == 1.0 {
                q.iter_mut().zip(&ahead).for_each(|(q, d)| *q += d);
            }
        }
        let failed = match self.chord.solve(step, q) {
            Ok(done) => {
                return Ok(Advance {
                    iterations: done.iterations,
                    factorisations: done.factorisations,
                    error: done.error,
                });
            }
            Err(failed) => failed,
        };
        let start = start.ok_or(failed)?;
        q.copy_from_slice(&start);
        let Chord {
            tolerance,
            max_iterations,
            ..
        } = self.chord;
        let mut newton = match self.newton.take() {
            Some(newton) => newton,
            None => Newton::new(whole(), tolerance, max_iterations).map_err(|_| failed)?,
        };
        let done = monolithic(&mut newton, step, q);
        self.newton = Some(newton);
        done
    }
}

fn monolithic(
    newton: &mut Newton,
    step: &impl Staggered,
    q: &mut [f64],
) -> Result<Advance, NotConverged> {
    let done = newton.solve(step, q)?;
    let iterations = done.errors.len() - 1;
    Ok(Advance {
        iterations,
        factorisations: iterations,
        error: done.errors[iterations],
    })
}
