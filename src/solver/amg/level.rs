//! Owns what the cycle, the smoother and the Galerkin product know of one level.

use super::aggregate::Aggregates;
use crate::operator::coarsen::VisitRow;
use std::cell::RefCell;
use std::ops::Range;

/// Six coarse unknowns per aggregate: the amplitudes of its rigid motions.
pub type Six = [f32; 6];

/// The values of the six rigid motions at one site, a row per component, padded to eight lanes.
pub type Modes<const D: usize> = [[f32; 8]; D];

/// Calls `f` with room for the rows of `n` sites, whatever is in it, which the thread keeps.
pub fn with_rows<const D: usize>(n: usize, f: impl FnOnce(&mut [[f32; D]])) {
    thread_local! {
        static ROOM: RefCell<Vec<f32>> = const { RefCell::new(Vec::new()) };
    }
    ROOM.with_borrow_mut(|room| {
        if room.len() < n * D {
            room.resize(n * D, 0.0);
        }
        f(room[..n * D].as_chunks_mut().0);
    });
}

/// One level with `D` unknowns per site, in single precision.
pub trait Level<const D: usize>: Sync {
    fn sites(&self) -> usize;
    /// Sites per task.
    fn chunk(&self) -> usize;
    /// Rows of `A x`, as [`crate::operator::coarsen::Coarsen::rows_f32`].
    fn rows(&self, sites: Range<usize>, x: &[[f32; D]], y: &mut [[f32; D]]);
    /// Calls `visit` with every site of the range, in order, and the columns and blocks of its row.
    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<[[f32; D]; D]>);
    /// A range that holds every column of these rows.
    fn reach(&self, sites: Range<usize>) -> Range<usize>;
    /// `D⁻¹ r` at a site, zero in held components.
    fn scale(&self, site: usize, r: &[f32; D]) -> [f32; D];
    /// `D⁻¹` at a site, zero rows and columns for held components.
    fn inverse(&self, site: usize) -> [[f32; D]; D];
    /// `D t` at a site on its free components, where [`Level::scale`] has an exact inverse.
    fn unscale(&self, site: usize, t: &[f32; D]) -> Option<[f32; D]>;
    /// The mean of the diagonal of `D` at a site.
    fn stiffness(&self, site: usize) -> f32;
    fn aggregates(&self) -> &Aggregates;
    /// Calls `visit` with every site of the range, in order, and the motions of its aggregate there, zero in held
    /// components and for sites without one.
    fn each_modes(&self, sites: Range<usize>, visit: impl FnMut(usize, Modes<D>));
    /// A bound of the largest eigenvalue of `D⁻¹A`, or a good guess with a margin.
    fn eigenvalue_bound(&self) -> f32;
}
