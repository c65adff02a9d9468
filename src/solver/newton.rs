//! Owns Newton's method with an exact tangent and sparse LU, one time step at a time.

use crate::error::Result;
use crate::operator::nonlinear::Nonlinear;
use crate::operator::sparse::Sparse;
use crate::solver::direct::DirectLu;

/// What is kept from step to step: the pattern and its symbolic factorisation.
pub struct Newton {
    tangent: Sparse,
    lu: DirectLu,
    pub tolerance: f64,
    pub max_iterations: usize,
}

/// How the equations of a step were solved.
#[derive(Debug, Clone, PartialEq)]
pub struct Converged {
    /// Error before each iteration, and after the last.
    pub errors: Vec<f64>,
}

/// Why they were not.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NotConverged {
    /// Too many iterations, or a residual that is no number.
    #[error("the iterations did not converge (residual {error:.1e})")]
    Diverged { error: f64 },
    /// The last update had to be cut to stay admissible, or left no number.
    #[error("the last update would leave the admissible range")]
    Inadmissible,
    #[error("the tangent is singular or not positive definite")]
    Singular,
}

impl NotConverged {
    /// Of iterations whose last update was `cut` to stay admissible, or not.
    pub fn after(error: f64, cut: bool) -> Self {
        match cut || !error.is_finite() {
            true => NotConverged::Inadmissible,
            false => NotConverged::Diverged { error },
        }
    }
}

impl Newton {
    pub fn new(pattern: Sparse, tolerance: f64, max_iterations: usize) -> Result<Self> {
        Ok(Newton {
            lu: DirectLu::new(&pattern)?,
            tangent: pattern,
            tolerance,
            max_iterations,
        })
    }

    /// Solves from the guess `q`, in place. One more iteration than the tolerance asks for is never done.
    pub fn solve(
        &mut self,
        equations: &impl Nonlinear,
        q: &mut [f64],
    ) -> Result<Converged, NotConverged> {
        let mut r = vec![0.0; q.len()];
        let mut errors = Vec::new();
        let mut cut = false;
        loop {
            equations.residual(q, &mut r);
            let error = equations.error(&r);
            errors.push(error);
            if error < self.tolerance {
                return Ok(Converged { errors });
            }
            if errors.len() > self.max_iterations || !error.is_finite() {
                return Err(NotConverged::after(error, cut));
            }
            equations.tangent(q, &mut self.tangent);
            let factor = self.lu.factorize(&self.tangent);
            factor.map_err(|_| NotConverged::Singular)?;
            r.iter_mut().for_each(|v| *v = -*v);
            self.lu.solve(&mut r);
            let share = equations.share(q, &r);
            cut = share < 1.0;
            q.iter_mut().zip(&r).for_each(|(q, dq)| *q += share * dq);
        }
    }

    /// `−(∂R/∂q)⁻¹ r` at `q`, in place.
    pub fn respond(
        &mut self,
        equations: &impl Nonlinear,
        q: &[f64],
        r: &mut [f64],
    ) -> Result<(), NotConverged> {
        equations.tangent(q, &mut self.tangent);
        let factor = self.lu.factorize(&self.tangent);
        factor.map_err(|_| NotConverged::Singular)?;
        self.lu.solve(r);
        r.iter_mut().for_each(|v| *v = -*v);
        Ok(())
    }
}
