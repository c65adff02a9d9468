//! Owns sparse direct solution by faer: the symbolic factorisation is done once per pattern and reused.

pub mod cholesky_f32;
pub mod dissection;
pub mod fill;
pub mod inertia;
pub mod network;
pub mod schur;

use crate::error::{Error, Result};
use crate::operator::sparse::Sparse;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::solvers::SolveCore;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::SupernodalLltRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side};

/// `LU` of an unsymmetric matrix, columns ordered by COLAMD.
pub struct DirectLu {
    symbolic: SymbolicLu<u32>,
    numeric: Option<Lu<u32, f64>>,
}

impl DirectLu {
    /// Symbolic part, from the pattern alone.
    pub fn new(a: &Sparse) -> Result<Self> {
        let symbolic =
            SymbolicLu::try_new(pattern(a)).map_err(|e| failed("LU", format!("{e:?}")))?;
        Ok(DirectLu {
            symbolic,
            numeric: None,
        })
    }

    /// Numeric part. Compressed rows are the compressed columns of the transpose, which is what is factorised.
    pub fn factorize(&mut self, a: &Sparse) -> Result<()> {
        let matrix = SparseColMatRef::new(pattern(a), &a.value[..]);
        let numeric = Lu::try_new_with_symbolic(self.symbolic.clone(), matrix);
        self.numeric = Some(numeric.map_err(|e| failed("LU", format!("{e:?}")))?);
        Ok(())
    }

    /// `A x = b` in place.
    ///
    /// # Panics
    /// Before the first [`DirectLu::factorize`].
    pub fn solve(&self, x: &mut [f64]) {
        let n = x.len();
        let lu = self.numeric.as_ref().expect("factorised first");
        lu.solve_transpose_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
        );
    }
}

/// `L Lᵀ` of a symmetric positive definite matrix in a given elimination order.
pub struct DirectLlt {
    symbolic: SymbolicCholesky<u32>,
    numeric: Vec<f64>,
    solve_scratch: MemBuffer,
}

impl DirectLlt {
    /// `order[k]` is the row eliminated `k`-th, for instance from
    /// [`nested_dissection`](crate::solver::direct::dissection::nested_dissection).
    pub fn new(a: &Sparse, order: &[usize]) -> Result<Self> {
        let symbolic = symbolic_cholesky(a, order)?;
        let scratch = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        Ok(DirectLlt {
            symbolic,
            numeric: Vec::new(),
            solve_scratch: MemBuffer::new(scratch),
        })
    }

    /// Refuses a matrix that is not positive definite.
    pub fn factorize(&mut self, a: &Sparse) -> Result<()> {
        numeric_cholesky(&self.symbolic, a, &a.value, &mut self.numeric)
    }

    /// The factor's lower right corner: the Cholesky factor of the Schur complement of the `count` rows eliminated
    /// last, dense, column by column (zeros above its diagonal).
    ///
    /// # Panics
    /// Before the first [`DirectLlt::factorize`].
    pub fn corner(&self, count: usize) -> Vec<f64> {
        let n = self.symbolic.nrows();
        let first = n - count;
        let mut corner = vec![0.0; count * count];
        let mut put = |row: usize, column: usize, value: f64| {
            if column >= first && row >= column {
                corner[(column - first) * count + row - first] = value;
            }
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let factor = SupernodalLltRef::new(symbolic, &self.numeric[..]);
                for s in 0..symbolic.n_supernodes() {
                    let (node, end) = (factor.supernode(s), symbolic.supernode_end()[s] as usize);
                    for j in first.max(node.start())..end.max(first) {
                        let column = node.val().col(j - node.start());
                        let size = end - node.start();
                        (0..size).for_each(|i| put(node.start() + i, j, column[i]));
                        let pattern = node.pattern().iter().enumerate();
                        pattern.for_each(|(i, &row)| put(row as usize, j, column[size + i]));
                    }
                }
            }
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                let (start, rows) = (symbolic.col_ptr(), symbolic.row_idx());
                for j in first..n {
                    let range = start[j] as usize..start[j + 1] as usize;
                    range.for_each(|k| put(rows[k] as usize, j, self.numeric[k]));
                }
            }
        }
        corner
    }

    /// `A x = b` in place.
    ///
    /// # Panics
    /// Before the first [`DirectLlt::factorize`].
    pub fn solve(&mut self, x: &mut [f64]) {
        let n = x.len();
        if n == 0 {
            return;
        }
        assert!(!self.numeric.is_empty(), "factorised first");
        LltRef::new(&self.symbolic, &self.numeric).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(x, n, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_scratch),
        );
    }
}

/// Symbolic part of a Cholesky factorisation in the given elimination order.
pub(super) fn symbolic_cholesky(a: &Sparse, order: &[usize]) -> Result<SymbolicCholesky<u32>> {
    let forward: Vec<u32> = order.iter().map(|&i| i as u32).collect();
    let mut inverse = vec![0; forward.len()];
    forward
        .iter()
        .enumerate()
        .for_each(|(k, &i)| inverse[i as usize] = k as u32);
    factorize_symbolic_cholesky(
        pattern(a),
        Side::Upper,
        SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, a.n())),
        CholeskySymbolicParams::default(),
    )
    .map_err(|e| failed("Cholesky", format!("{e:?}")))
}

/// Numeric part in the precision of `value`, the values of `a`'s pattern.
pub(super) fn numeric_cholesky<T: RealField>(
    symbolic: &SymbolicCholesky<u32>,
    a: &Sparse,
    value: &[T],
    numeric: &mut Vec<T>,
) -> Result<()> {
    numeric.resize(symbolic.len_val(), T::zero_impl());
    let scratch = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
    symbolic
        .factorize_numeric_llt(
            numeric,
            SparseColMatRef::new(pattern(a), value),
            Side::Upper,
            Default::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Default::default(),
        )
        .map_err(|_| failed("Cholesky", "the stiffness is not positive definite".into()))?;
    Ok(())
}

fn pattern(a: &Sparse) -> SymbolicSparseColMatRef<'_, u32> {
    SymbolicSparseColMatRef::new_checked(a.n(), a.n(), &a.start, None, &a.column)
}

fn failed(method: &str, found: String) -> Error {
    Error::specimen(
        format!("the {method} factorisation failed: {found}"),
        "check that every part is held against rigid motion",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::direct::dissection::nested_dissection;

    /// A five-point Laplacian with convection, so that a transposed solve would show.
    fn grid(m: usize, skew: f64) -> Sparse {
        let near = move |i: usize| {
            let (x, y) = ((i % m) as i64, (i / m) as i64);
            let all = [
                (x, y, 4.1),
                (x + 1, y, -1.0 - skew),
                (x - 1, y, -1.0),
                (x, y + 1, -1.0),
                (x, y - 1, -1.0 + skew),
            ];
            let inside = move |v: i64| (0..m as i64).contains(&v);
            all.into_iter()
                .filter(move |(x, y, _)| inside(*x) && inside(*y))
                .map(move |(x, y, a)| (y as usize * m + x as usize, a))
        };
        let mut a =
            Sparse::from_pattern(m * m, |i, list| list.extend(near(i).map(|(j, _)| j as u32)));
        a.fill(|rows| {
            for i in rows.range() {
                near(i).for_each(|(j, v)| rows.add(i, j, v));
            }
        });
        a
    }

    fn residual(a: &Sparse, x: &[f64], b: &[f64]) -> f64 {
        let mut y = vec![0.0; b.len()];
        a.apply(x, &mut y);
        y.iter().zip(b).fold(0.0, |m, (y, b)| (y - b).abs().max(m))
    }

    #[test]
    fn lu_and_llt_solve_their_matrices() {
        let b: Vec<f64> = (0..900).map(|i| (i as f64 * 0.37).sin()).collect();
        let skew = grid(30, 0.7);
        let mut lu = DirectLu::new(&skew).unwrap();
        lu.factorize(&skew).unwrap();
        let mut x = b.clone();
        lu.solve(&mut x);
        assert!(residual(&skew, &x, &b) < 1e-13);

        let symmetric = grid(30, 0.0);
        let positions: Vec<[f64; 2]> = (0..900)
            .map(|i| [(i % 30) as f64, (i / 30) as f64])
            .collect();
        let mut llt = DirectLlt::new(&symmetric, &nested_dissection(&positions, 1.0)).unwrap();
        llt.factorize(&symmetric).unwrap();
        let mut x = b.clone();
        llt.solve(&mut x);
        assert!(residual(&symmetric, &x, &b) < 1e-13);
    }

    /// The corner's product is the Schur complement: A_ww - A_wf A_ff⁻¹ A_fw, whose inverse is a block of A⁻¹.
    #[test]
    fn the_corner_is_the_factor_of_the_schur_complement() {
        for m in [5, 30] {
            let a = grid(m, 0.0);
            let n = m * m;
            let positions: Vec<[f64; 2]> =
                (0..n).map(|i| [(i % m) as f64, (i / m) as f64]).collect();
            let order = nested_dissection(&positions, 1.0);
            let mut llt = DirectLlt::new(&a, &order).unwrap();
            llt.factorize(&a).unwrap();
            let w = 7;
            let l = llt.corner(w);
            for column in 0..w {
                let mut x = vec![0.0; n];
                x[order[n - w + column]] = 1.0;
                llt.solve(&mut x);
                // L Lᵀ applied to the block's column of the inverse is a unit vector.
                let part: Vec<f64> = (0..w).map(|i| x[order[n - w + i]]).collect();
                let half: Vec<f64> = (0..w)
                    .map(|j| (j..w).map(|i| l[j * w + i] * part[i]).sum())
                    .collect();
                for i in 0..w {
                    let found: f64 = (0..=i).map(|j| l[j * w + i] * half[j]).sum();
                    assert!((found - f64::from(u8::from(i == column))).abs() < 1e-12);
                }
            }
        }
    }
}
