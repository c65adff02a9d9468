//! Owns the seam for nonlinear equations `R(q) = 0`: what a solver may know of a model during one time step.

use crate::operator::MixedPrecision;
use crate::operator::sparse::Sparse;

/// Equations with their exact tangent.
pub trait Nonlinear: Sync {
    /// `R(q)`.
    fn residual(&self, q: &[f64], r: &mut [f64]);
    /// `∂R/∂q`, into the pattern the model was given.
    fn tangent(&self, q: &[f64], k: &mut Sparse);
    /// Dimensionless size of a residual.
    fn error(&self, r: &[f64]) -> f64;
    /// The largest share of the update `dq` that keeps `q + share dq` admissible, at most 1.
    fn share(&self, q: &[f64], dq: &[f64]) -> f64;
}

/// Equations whose first `local()` unknowns couple weakly: they can be updated one by one, and the others with a
/// stiffness of their own.
pub trait Staggered: Nonlinear {
    fn local(&self) -> usize;
    /// `∂R_i/∂q_i` of the local unknowns.
    fn local_diagonal(&self, q: &[f64], d: &mut [f64]);
    /// `−∂R/∂q` among the other unknowns; symmetric positive definite but for followers.
    fn stiffness(&self, q: &[f64], k: &mut Sparse);
}

/// The largest share of `dq`, at most 1, under which none of the first `local` unknowns, all positive, loses more than 70 %.
pub fn positive_share(local: usize, q: &[f64], dq: &[f64]) -> f64 {
    let loss = |k: usize| -dq[k] / q[k];
    let worst = (0..local).map(loss).fold(0.0, f64::max);
    (0.7 / worst.max(1e-300)).min(1.0)
}

/// A body whose forces depend on displacements and on what happened before, step by step. Everything is the free body: supports are
/// given to the solver separately, as held components.
pub trait Incremental: Sync {
    type Tangent: MixedPrecision;

    /// Forces that the displacements `u` take at the end of the step.
    fn forces(&mut self, u: &[[f64; 3]], f: &mut [[f64; 3]]);
    /// `∂f/∂u` at the displacements whose forces were asked for last; symmetric, and positive semi-definite.
    fn tangent(&self) -> Self::Tangent;
}
