//! Owns equilibrium of a factorised system when only a few of its rows change: everything else is condensed onto those
//! rows, once, and what changes there is solved for in the dense remainder.

use crate::par;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, Mat, MatMut, MatRef, Par};

/// Iterations of a solve at most. S is a good preconditioner of S less a change of a few of its rows: a solve takes tens of iterations, or
/// the rest is nearly singular, and the caller is better served by a new S.
const MOST_ITERATIONS: usize = 200;

/// The Schur complement S of a factorised matrix on `size` rows, kept as its dense Cholesky factor.
pub struct SchurComplement {
    factor: Mat<f64>,
}

/// The result of a solve with the Schur complement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZoneInfo {
    pub iterations: usize,
    pub converged: bool,
}

impl SchurComplement {
    /// From the factor's corner, see [`DirectLlt::corner`](crate::solver::direct::DirectLlt::corner).
    pub fn new(corner: &[f64], size: usize) -> Self {
        SchurComplement {
            factor: MatRef::from_column_major_slice(corner, size, size).to_owned(),
        }
    }

    pub fn size(&self) -> usize {
        self.factor.nrows()
    }

    /// `x = S⁻¹ x`.
    fn inverse(&self, x: &mut [f64]) {
        let n = x.len();
        let mut x = MatMut::from_column_major_slice_mut(x, n, 1);
        solve_lower_triangular_in_place(self.factor.as_ref(), x.as_mut(), Par::Seq);
        solve_upper_triangular_in_place(self.factor.as_ref().transpose(), x.as_mut(), Par::Seq);
    }

    /// Solves (S - C) d = b for d by conjugate gradients preconditioned with S, from the start value in `d`, to a
    /// residual of `tolerance` relative to `scale` in the norm of S⁻¹. `change(x, y)` adds C x to y.
    pub fn solve(
        &self,
        change: impl Fn(&[f64], &mut [f64]),
        b: &[f64],
        d: &mut [f64],
        scale: f64,
        tolerance: f64,
    ) -> ZoneInfo {
        let n = b.len();
        // S d is kept with each vector: S⁻¹ is at hand, S is not.
        let mut sd = self.multiply(d);
        let mut r: Vec<f64> = b.iter().zip(&sd).map(|(b, s)| b - s).collect();
        change(d, &mut r);
        let (mut p, mut sp) = (vec![0.0; n], vec![0.0; n]);
        let mut before = f64::INFINITY;
        for iterations in 0..MOST_ITERATIONS {
            let mut z = r.clone();
            self.inverse(&mut z);
            let rz = inner(&r, &z);
            if rz.max(0.0).sqrt() <= tolerance * scale {
                return ZoneInfo {
                    iterations,
                    converged: true,
                };
            }
            let beta = rz / before;
            before = rz;
            combine(&mut p, &z, beta);
            combine(&mut sp, &r, beta);
            let mut change_p = vec![0.0; n];
            change(&p, &mut change_p);
            let curvature = inner(&p, &sp) - inner(&p, &change_p);
            if !curvature.is_finite() || curvature <= 0.0 {
                return ZoneInfo {
                    iterations,
                    converged: false,
                };
            }
            let alpha = rz / curvature;
            for i in 0..n {
                d[i] += alpha * p[i];
                sd[i] += alpha * sp[i];
                r[i] -= alpha * (sp[i] - change_p[i]);
            }
        }
        ZoneInfo {
            iterations: MOST_ITERATIONS,
            converged: false,
        }
    }

    /// `S x`.
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        if x.iter().all(|v| *v == 0.0) {
            return vec![0.0; x.len()];
        }
        let x = MatRef::from_column_major_slice(x, x.len(), 1);
        let product = &self.factor * (self.factor.transpose() * x);
        (0..product.nrows()).map(|i| product[(i, 0)]).collect()
    }

    /// Takes a change for good: S becomes S - C, `change` as C's entries (row, column, value), symmetric. False, and
    /// nothing done, if the result is not positive definite.
    pub fn absorb(&mut self, change: impl Iterator<Item = (usize, usize, f64)>) -> bool {
        let n = self.size();
        let mut s = Mat::<f64>::zeros(n, n);
        faer::linalg::matmul::matmul(
            s.as_mut(),
            Accum::Replace,
            self.factor.as_ref(),
            self.factor.as_ref().transpose(),
            1.0,
            Par::Seq,
        );
        change.for_each(|(i, j, value)| s[(i, j)] -= value);
        match s.llt(faer::Side::Lower) {
            Ok(llt) => {
                self.factor = llt.L().to_owned();
                true
            }
            Err(_) => false,
        }
    }
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    par::sum_chunks(a.len(), |range| range.map(|i| a[i] * b[i]).sum())
}

/// p = z + beta p.
fn combine(p: &mut [f64], z: &[f64], beta: f64) {
    for (p, z) in p.iter_mut().zip(z) {
        *p = z + beta * *p;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Schur complement, tridiagonal (2, -1), that loses its spring between rows 3 and 4.
    #[test]
    fn a_changed_complement_solves_the_changed_system() {
        let n = 12;
        let s = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        });
        let mut schur = SchurComplement {
            factor: s.llt(faer::Side::Lower).unwrap().L().to_owned(),
        };
        let cut = |x: &[f64], y: &mut [f64]| {
            y[3] += 0.9 * (x[3] - x[4]);
            y[4] -= 0.9 * (x[3] - x[4]);
        };
        let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut d = vec![0.0; n];
        let info = schur.solve(cut, &b, &mut d, 1.0, 1e-13);
        // A change of rank one needs two iterations.
        assert!(info.converged && info.iterations <= 3, "{info:?}");
        let residual = |d: &[f64]| {
            let mut worst = 0.0_f64;
            for i in 0..n {
                let mut cd = vec![0.0; n];
                cut(d, &mut cd);
                let sd: f64 = (0..n).map(|j| s[(i, j)] * d[j]).sum();
                worst = worst.max((sd - cd[i] - b[i]).abs());
            }
            worst
        };
        assert!(residual(&d) < 1e-12);
        let entries = [(3, 3, 0.9), (4, 4, 0.9), (3, 4, -0.9), (4, 3, -0.9)];
        assert!(schur.absorb(entries.into_iter()));
        let mut d = vec![0.0; n];
        let info = schur.solve(|_, _| {}, &b, &mut d, 1.0, 1e-13);
        assert!(info.iterations <= 1 && residual(&d) < 1e-12);
    }
}
