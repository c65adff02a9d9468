//! Owns what algebraic multigrid needs of its finest level, beyond the operator itself.

use super::Operator;
use std::ops::Range;

/// The coupling of two sites: `block[a][b]` is the force on component `a` of the row's site per unit displacement of
/// component `b` of the column's site.
pub type Block = [[f32; 3]; 3];

/// An operator on displacements that algebraic multigrid can coarsen. It is never assembled: rows are made when asked
/// for. All of it is the free operator: supports are told to the solver separately, as held components.
pub trait Coarsen: Operator<3> {
    /// Where a site is, in mm. Rigid motions are made from it.
    fn position(&self, site: usize) -> [f64; 3];

    /// Appends the non-zero blocks of one row, the diagonal block among them, each as (column's site, block).
    /// A site without a row (padding) appends nothing and is left out of everything.
    fn row(&self, site: usize, blocks: &mut Vec<(u32, Block)>);

    /// `y[i − sites.start] = (A x)_i` for `i` in `sites`, in single precision, on the calling thread.
    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]);
}
