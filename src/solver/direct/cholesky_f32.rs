//! Owns Cholesky factors in single precision, for methods that iterate anyway: half the memory and about half the time of
//! double precision. The matrix is scaled to a unit diagonal first, which takes large contrasts out of the rounding.

use crate::error::Result;
use crate::operator::sparse::Sparse;
use crate::solver::direct::{numeric_cholesky, symbolic_cholesky};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky};
use faer::{Conj, MatMut, Par};

/// An approximate inverse of a symmetric positive definite matrix.
pub struct SingleCholesky {
    symbolic: SymbolicCholesky<u32>,
    numeric: Vec<f32>,
    /// `1/√a_ii`.
    scale: Vec<f64>,
    scratch: MemBuffer,
    x: Vec<f32>,
}

impl SingleCholesky {
    /// `order[k]` is the row eliminated `k`-th.
    pub fn new(a: &Sparse, order: &[usize]) -> Result<Self> {
        let symbolic = symbolic_cholesky(a, order)?;
        let scratch = symbolic.solve_in_place_scratch::<f32>(1, Par::Seq);
        Ok(SingleCholesky {
            symbolic,
            numeric: Vec::new(),
            scale: Vec::new(),
            scratch: MemBuffer::new(scratch),
            x: vec![0.0; a.n()],
        })
    }

    /// Refuses a matrix that is not positive definite in single precision.
    pub fn factorize(&mut self, a: &Sparse) -> Result<()> {
        let diagonal = |i: usize| a.row(i).find(|(j, _)| *j == i).map_or(0.0, |(_, v)| v);
        self.scale = (0..a.n()).map(|i| diagonal(i).sqrt().recip()).collect();
        let scale = &self.scale;
        let row = |i: usize| a.row(i).map(move |(j, v)| (scale[i] * v * scale[j]) as f32);
        let value: Vec<f32> = (0..a.n()).flat_map(row).collect();
        numeric_cholesky(&self.symbolic, a, &value, &mut self.numeric)
    }

    /// `A x ≈ b` in place.
    ///
    /// # Panics
    /// Before the first [`SingleCholesky::factorize`].
    pub fn solve(&mut self, x: &mut [f64]) {
        assert!(!self.numeric.is_empty(), "factorised first");
        let scaled = || x.iter().zip(&self.scale).map(|(x, s)| x * s);
        // Single precision spans few decades: the right-hand side is brought to size 1.
        let size = scaled().fold(0.0, |m: f64, v| m.max(v.abs()));
        if size == 0.0 || !size.is_finite() {
            return;
        }
        let single: Vec<f32> = scaled().map(|v| (v / size) as f32).collect();
        self.x.copy_from_slice(&single);
        let n = self.x.len();
        LltRef::new(&self.symbolic, &self.numeric[..]).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
        for ((x, s), single) in x.iter_mut().zip(&self.scale).zip(&self.x) {
            *x = *single as f64 * size * s;
        }
    }
}
