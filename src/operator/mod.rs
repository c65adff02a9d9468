//! The seam: what a solver may know of a model, and nothing else.
//!
//! `D` is the number of unknowns per site: 1 for conduction, 2 and 3 for displacements, 3 in the plane with rotation.

pub mod coarsen;
pub mod held;
pub mod nonlinear;
pub mod probe;
pub mod reduction;
pub mod sparse;

/// A symmetric positive semi-definite linear operator on `sites() × D` unknowns.
pub trait Operator<const D: usize>: Sync {
    fn sites(&self) -> usize;
    /// `y = A x`. Both of length `sites()`.
    fn apply(&self, x: &[[f64; D]], y: &mut [[f64; D]]);
    /// The diagonal of `A`.
    fn diagonal(&self, d: &mut [[f64; D]]);
}

/// An approximate inverse, symmetric and positive definite on the free unknowns: `z ≈ A⁻¹ r`.
pub trait Preconditioner<const D: usize>: Sync {
    fn apply(&self, r: &[[f64; D]], z: &mut [[f64; D]]);
}

/// The same in single precision, for solvers that keep their vectors so.
pub trait SinglePreconditioner<const D: usize>: Sync {
    /// `z ≈ A⁻¹ r`, zero in held components; `spare` is room for one vector more. Both change places at will.
    fn apply_single(&self, r: &[[f32; D]], z: &mut Vec<[f32; D]>, spare: &mut Vec<[f32; D]>);
}
