//! Owns the coarsest level: a dense Cholesky factor in double precision.

use super::blocks::BlockMatrix;
use super::level::Six;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

pub struct Coarsest {
    factor: Option<Llt<f64>>,
    scale: Vec<f64>,
}

impl Coarsest {
    /// Rigid motions left free and dropped motions make the matrix singular: it is scaled to a unit diagonal and
    /// shifted by as little as makes it positive.
    pub fn new(matrix: &BlockMatrix) -> Self {
        let n = 6 * matrix.rows();
        if n == 0 {
            return Coarsest {
                factor: None,
                scale: Vec::new(),
            };
        }
        let mut scale = vec![0.0; n];
        for i in 0..matrix.rows() {
            for (_, block) in matrix.row(i).filter(|(j, _)| *j as usize == i) {
                for c in 0..6 {
                    let d = f64::from(block[7 * c]);
                    scale[6 * i + c] = if d > 0.0 { d.sqrt().recip() } else { 0.0 };
                }
            }
        }
        let mut a = Mat::<f64>::zeros(n, n);
        for i in 0..matrix.rows() {
            for (j, block) in matrix.row(i) {
                for c in 0..6 {
                    for r in 0..6 {
                        let (p, q) = (6 * i + r, 6 * j as usize + c);
                        a[(p, q)] = f64::from(block[6 * c + r]) * scale[p] * scale[q];
                    }
                }
            }
        }
        let mut factor = None;
        for shift in [3e-7, 3e-6, 3e-5, 3e-4, 3e-3] {
            for i in 0..n {
                a[(i, i)] = 1.0 + shift;
            }
            factor = a.llt(Side::Lower).ok();
            if factor.is_some() {
                break;
            }
        }
        Coarsest { factor, scale }
    }

    pub fn solve(&self, b: &[Six], x: &mut [Six]) {
        let mut v = Mat::<f64>::from_fn(6 * b.len(), 1, |i, _| {
            f64::from(b[i / 6][i % 6]) * self.scale[i]
        });
        if let Some(factor) = &self.factor {
            factor.solve_in_place(&mut v);
        }
        for (i, x) in x.as_flattened_mut().iter_mut().enumerate() {
            *x = (v[(i, 0)] * self.scale[i]) as f32;
        }
    }
}
