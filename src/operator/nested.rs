//! Owns what a two-level cycle needs of elements of higher order: the space of lower order inside theirs.

use super::MixedPrecision;
use super::coarsen::Coarsen;
use super::held::Held;

/// An operator with a coarser one whose displacements are among its own.
pub trait Nested: MixedPrecision {
    type Coarse: Coarsen;

    /// A bound of the largest eigenvalue of `D⁻¹A`, as [`Coarsen::eigenvalue_bound`].
    fn eigenvalue_bound(&self) -> f64;

    fn coarse(&self) -> &Self::Coarse;

    /// What is held of the coarser operator's sites.
    fn held_of_coarse(&self, held: &Held) -> Held;

    /// Forces on the coarser operator's sites: the transpose of [`Nested::add_prolonged`].
    fn restrict(&self, fine: &[[f32; 3]], coarse: &mut [[f32; 3]]);

    /// Adds a displacement of the coarser operator.
    fn add_prolonged(&self, coarse: &[[f32; 3]], fine: &mut [[f32; 3]]);

    /// Inverses of the 3 × 3 diagonal blocks: xx, yy, zz, yz, xz, xy; zero in held components.
    fn inverse_diagonal(&self, held: &Held) -> Vec<[f32; 6]>;
}
