//! Owns what algebraic multigrid needs of its finest level, beyond the operator itself.

use super::{MixedPrecision, Operator};
use crate::par::{CHUNK, each_chunk};
use std::ops::Range;
use std::sync::Arc;

/// The coupling of two sites: `block[a][b]` is the force on component `a` of the row's site per unit displacement of
/// component `b` of the column's site.
pub type Block = [[f32; 3]; 3];

/// Is called with a site, the columns of its row and as many blocks.
pub type VisitRow<'v, B> = dyn FnMut(usize, &[u32], &[B]) + 'v;

/// An operator on displacements that algebraic multigrid can coarsen. It is never assembled: rows are made when asked
/// for. All of it is the free operator: supports are passed to the solver separately, as held components.
///
/// Everything is by ranges of sites, on the calling thread, so that whoever asks decides how much of it is
/// alive at a time.
pub trait Coarsen: Operator<3> {
    /// Where sites are, in mm. Rigid motions are made from it.
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]);

    /// Calls `visit` with every site of the range, in order, and the non-zero blocks of its row, the diagonal block
    /// among them: the columns' sites, and as many blocks. A site with an empty row (padding) is left out of everything.
    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>);

    /// Calls `visit` with every site of the range, in order, and the diagonal block of its row, zero where that is empty.
    fn each_diagonal(&self, sites: Range<usize>, visit: &mut dyn FnMut(usize, &Block)) {
        self.each_row(sites, &mut |site, columns, blocks| {
            let own = columns.iter().position(|&j| j as usize == site);
            visit(site, own.map_or(&[[0.0; 3]; 3], |k| &blocks[k]));
        });
    }

    /// A range that holds every column of these rows. Need not be tight.
    fn reach(&self, sites: Range<usize>) -> Range<usize>;

    /// Of each site of the range, whether what it joins meets there in an edge or a corner only, so that parts turn about it.
    fn hinges(&self, _sites: Range<usize>, hinges: &mut [bool]) {
        hinges.fill(false);
    }

    /// Whether all that joins sites is of one stiffness: then every coupling is a strong one.
    fn is_uniform(&self) -> bool {
        false
    }

    /// Sites per task: products with fewer rows at a time may cost more a row.
    fn chunk(&self) -> usize {
        CHUNK
    }

    /// `y[i − sites.start] = (A x)_i` for `i` in `sites`.
    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]);

    /// The same in single precision.
    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]);

    /// A bound of the largest eigenvalue of `D⁻¹A`, `D` the 3 × 3 diagonal blocks, that holds whatever is held. From
    /// parts: where `A = Σ A_e` and each part's eigenvalues are below the bound, so are those of the sum.
    fn eigenvalue_bound(&self) -> f64;
}

/// What refers to an operator can be coarsened as it.
macro_rules! refers {
    ($($of:ty: [$($bound:tt)*]),+) => {$(
        impl<O: Coarsen + $($bound)*> Coarsen for $of {
            fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
                (**self).positions(sites, x);
            }

            fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
                (**self).each_row(sites, visit);
            }

            fn each_diagonal(&self, sites: Range<usize>, visit: &mut dyn FnMut(usize, &Block)) {
                (**self).each_diagonal(sites, visit);
            }

            fn reach(&self, sites: Range<usize>) -> Range<usize> {
                (**self).reach(sites)
            }

            fn hinges(&self, sites: Range<usize>, hinges: &mut [bool]) {
                (**self).hinges(sites, hinges);
            }

            fn is_uniform(&self) -> bool {
                (**self).is_uniform()
            }

            fn chunk(&self) -> usize {
                (**self).chunk()
            }

            fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
                (**self).rows_f64(sites, x, y);
            }

            fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
                (**self).rows_f32(sites, x, y);
            }

            fn eigenvalue_bound(&self) -> f64 {
                (**self).eigenvalue_bound()
            }
        }
    )+};
}

refers!(&O: [], Arc<O>: [Send]);

/// What can be applied to any range of rows needs no more than that.
impl<O: Coarsen> MixedPrecision for O {
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64 {
        let [sum] = each_chunk(y, self.chunk(), |first, y| {
            self.rows_f32(first..first + y.len(), x, y);
            [finish(first, y)]
        });
        sum
    }

    fn for_each_chunk(
        &self,
        x: &[[f64; 3]],
        out: &mut [[f32; 3]],
        consume: impl Fn(usize, &[[f64; 3]], &mut [[f32; 3]]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        each_chunk(out, self.chunk(), |first, out| {
            let mut image = vec![[0.0; 3]; out.len()];
            self.rows_f64(first..first + out.len(), x, &mut image);
            consume(first, &image, out)
        })
    }
}
