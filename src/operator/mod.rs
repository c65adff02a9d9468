//! The seam: what a solver may know of a model, and nothing else.
//!
//! `D` is the number of unknowns per site: 1 for conduction, 2 and 3 for displacements, 3 in the plane with rotation.

pub mod assembled;
pub mod coarsen;
pub mod held;
pub mod nested;
pub mod nonlinear;
pub mod probe;
pub mod reduction;
pub mod sparse;

use std::sync::Arc;

/// A symmetric positive semi-definite linear operator on `sites() × D` unknowns.
pub trait Operator<const D: usize>: Sync {
    fn sites(&self) -> usize;
    /// `y = A x`. Both of length `sites()`.
    fn apply(&self, x: &[[f64; D]], y: &mut [[f64; D]]);
    /// The diagonal of `A`.
    fn diagonal(&self, d: &mut [[f64; D]]);
}

/// What refers to an operator is one.
macro_rules! refers {
    ($($of:ty: [$($bound:tt)*]),+) => {$(
        impl<const D: usize, O: Operator<D> + $($bound)*> Operator<D> for $of {
            fn sites(&self) -> usize {
                (**self).sites()
            }

            fn apply(&self, x: &[[f64; D]], y: &mut [[f64; D]]) {
                (**self).apply(x, y);
            }

            fn diagonal(&self, d: &mut [[f64; D]]) {
                (**self).diagonal(d);
            }
        }
    )+};
}

refers!(&O: [], Arc<O>: [Send]);

/// An approximate inverse, symmetric and positive definite on the free unknowns: `z ≈ A⁻¹ r`.
pub trait Preconditioner<const D: usize>: Sync {
    fn apply(&self, r: &[[f64; D]], z: &mut [[f64; D]]);
}

/// The same in single precision, for solvers that keep their vectors so.
pub trait SinglePreconditioner<const D: usize>: Sync {
    /// `z ≈ A⁻¹ r`, zero in held components; `spare` is room for one vector more. Both change places at will.
    fn apply_single(&self, r: &[[f32; D]], z: &mut Vec<[f32; D]>, spare: &mut Vec<[f32; D]>);
}

impl<const D: usize, P: SinglePreconditioner<D> + Send> SinglePreconditioner<D> for Arc<P> {
    fn apply_single(&self, r: &[[f32; D]], z: &mut Vec<[f32; D]>, spare: &mut Vec<[f32; D]>) {
        (**self).apply_single(r, z, spare);
    }
}

/// An operator for solvers that keep most of their vectors in single precision.
pub trait MixedPrecision: Operator<3> {
    /// `y = A x` in single precision, part by part. Each part, with its first site, is given to `finish` while it is in
    /// the cache; what that returns is added up in the order of the parts.
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64;

    /// `A x` in double precision, part by part, never all of it at once: `consume` has each part's first site, `A x` there
    /// and as much of `out`. What it returns is added up in the order of the parts.
    fn for_each_chunk(
        &self,
        x: &[[f64; 3]],
        out: &mut [[f32; 3]],
        consume: impl Fn(usize, &[[f64; 3]], &mut [[f32; 3]]) -> [f64; 2] + Sync,
    ) -> [f64; 2];
}

/// A linear functional of the unknowns.
pub trait Functional<const D: usize>: Sync {
    fn of(&self, u: &[[f64; D]]) -> f64;
    fn of_single(&self, u: &[[f32; D]]) -> f64;
}
