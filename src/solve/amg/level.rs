//! Owns what the cycle, the smoother and the Galerkin product know of one level.

use std::ops::Range;

/// No aggregate: padding, or a site with nothing free.
pub const NONE: u32 = u32::MAX;

/// Six coarse unknowns per aggregate: the amplitudes of its rigid motions.
pub type Six = [f32; 6];

/// The values of the six rigid motions at one site, a row per component, padded to eight lanes.
pub type Modes<const D: usize> = [[f32; 8]; D];

/// One level with `D` unknowns per site, in single precision.
pub trait Level<const D: usize>: Sync {
    fn sites(&self) -> usize;
    /// Rows of `A x`, as [`crate::operator::coarsen::Coarsen::rows_f32`].
    fn rows(&self, sites: Range<usize>, x: &[[f32; D]], y: &mut [[f32; D]]);
    /// Appends the blocks of one row.
    fn row(&self, site: usize, blocks: &mut Vec<(u32, [[f32; D]; D])>);
    /// `D⁻¹ r` at a site, zero in held components.
    fn scale(&self, site: usize, r: &[f32; D]) -> [f32; D];
    /// The aggregate of a site, or [`NONE`].
    fn aggregate(&self, site: usize) -> u32;
    /// The motions of a site's aggregate, zero in held components.
    fn modes(&self, site: usize) -> Modes<D>;
}
