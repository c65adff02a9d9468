//! Owns the coarsest level: a dense Cholesky factor with diagonal pivoting, in double precision.
//!
//! Rigid motions that no support stops, and mechanisms, make the matrix singular. Elimination takes the largest pivot
//! left and ends where only pivots below the matrix' own rounding remain: those unknowns stay zero. That is a symmetric
//! generalised inverse, exact on what is stiff; a small shift instead would blow the free motions up by its inverse.

use super::blocks::BlockMatrix;
use super::coarse::LEAST_STIFFNESS;
use super::cycle::Vectors;

/// Pivots below this share of the unit diagonal are rounding of the single-precision matrix.
const LEAST_PIVOT: f64 = 2e-6;

pub struct Coarsest {
    /// Unit-diagonal scaling; zero for unknowns without stiffness.
    scale: Vec<f64>,
    /// Unknowns in the order of their elimination; those from `rank` on stay zero.
    order: Vec<usize>,
    rank: usize,
    /// `L` by columns, `n` entries each.
    factor: Vec<f64>,
}

impl Coarsest {
    /// `mean_site_stiffness`: as for [`super::coarse::Coarse::new`].
    pub fn new(matrix: &BlockMatrix, mean_site_stiffness: &[f32]) -> Self {
        let n = 6 * matrix.rows();
        let scale = unit_scaling(matrix, mean_site_stiffness);
        let mut a = vec![0.0; n * n];
        for i in 0..matrix.rows() {
            for (j, block, transposed) in matrix.row(i) {
                for c in 0..6 {
                    for r in 0..6 {
                        let (p, q) = (6 * i + r, 6 * j as usize + c);
                        let at = if transposed { 6 * r + c } else { 6 * c + r };
                        a[q * n + p] = f64::from(block[at]) * scale[p] * scale[q];
                    }
                }
            }
        }
        let mut order: Vec<usize> = (0..n).collect();
        let rank = factorise(&mut a, &mut order);
        Coarsest {
            scale,
            order,
            rank,
            factor: a,
        }
    }

    /// `x` of `room` from its `b`.
    pub fn solve(&self, room: &mut Vectors) {
        let Vectors { b, x, .. } = room;
        let n = self.order.len();
        let b = b.as_flattened();
        let mut v: Vec<f64> = self.order[..self.rank]
            .iter()
            .map(|&p| f64::from(b[p]) * self.scale[p])
            .collect();
        for k in 0..self.rank {
            let column = &self.factor[k * n + k..k * n + self.rank];
            v[k] /= column[0];
            let pivot = v[k];
            v[k + 1..]
                .iter_mut()
                .zip(&column[1..])
                .for_each(|(v, l)| *v -= l * pivot);
        }
        for k in (0..self.rank).rev() {
            let column = &self.factor[k * n + k..k * n + self.rank];
            let below: f64 = v[k + 1..]
                .iter()
                .zip(&column[1..])
                .map(|(v, l)| v * l)
                .sum();
            v[k] = (v[k] - below) / column[0];
        }
        let x = x.as_flattened_mut();
        x.fill(0.0);
        for (&p, v) in self.order.iter().zip(&v) {
            x[p] = (v * self.scale[p]) as f32;
        }
    }
}

fn unit_scaling(matrix: &BlockMatrix, mean_site_stiffness: &[f32]) -> Vec<f64> {
    let mut scale = vec![0.0; 6 * matrix.rows()];
    for i in 0..matrix.rows() {
        for c in 0..6 {
            let d = f64::from(matrix.diagonal(i)[7 * c]);
            let least = LEAST_STIFFNESS * f64::from(mean_site_stiffness[i]);
            scale[6 * i + c] = if d > least { d.sqrt().recip() } else { 0.0 };
        }
    }
    scale
}

/// Cholesky with diagonal pivoting of the lower triangle, in place; returns the rank.
fn factorise(a: &mut [f64], order: &mut [usize]) -> usize {
    let n = order.len();
    for k in 0..n {
        let largest = (k..n).max_by(|&i, &j| a[i * n + i].total_cmp(&a[j * n + j]));
        let Some(p) = largest.filter(|&p| a[p * n + p] > LEAST_PIVOT) else {
            return k;
        };
        swap(a, order, k, p);
        let root = a[k * n + k].sqrt();
        let (done, rest) = a.split_at_mut((k + 1) * n);
        let column = &mut done[k * n + k..];
        column[0] = root;
        column[1..].iter_mut().for_each(|l| *l /= root);
        for (j, target) in rest.chunks_exact_mut(n).enumerate() {
            let factor = column[j + 1];
            if factor != 0.0 {
                let target = &mut target[k + 1 + j..];
                target
                    .iter_mut()
                    .zip(&column[j + 1..])
                    .for_each(|(t, l)| *t -= factor * l);
            }
        }
    }
    n
}

/// Swaps unknowns `k < p` of the lower triangle, the columns already done included.
fn swap(a: &mut [f64], order: &mut [usize], k: usize, p: usize) {
    if k == p {
        return;
    }
    let n = order.len();
    order.swap(k, p);
    for c in 0..k {
        a.swap(c * n + k, c * n + p);
    }
    a.swap(k * n + k, p * n + p);
    for i in k + 1..p {
        a.swap(k * n + i, i * n + p);
    }
    for i in p + 1..n {
        a.swap(k * n + i, p * n + i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_singular_matrix_is_inverted_where_it_is_stiff() {
        // A free chain of unit springs: its rigid motion leaves one pivot over.
        let n = 7;
        let mut a = vec![0.0; n * n];
        for i in 0..n - 1 {
            for (p, q, v) in [
                (i, i, 1.0),
                (i + 1, i + 1, 1.0),
                (i, i + 1, -1.0),
                (i + 1, i, -1.0),
            ] {
                a[q * n + p] += v;
            }
        }
        let matrix = a.clone();
        let mut order: Vec<usize> = (0..n).collect();
        let rank = factorise(&mut a, &mut order);
        assert_eq!(rank, n - 1);
        // L Lᵀ is the matrix in the order of elimination.
        for p in 0..rank {
            for q in 0..=p {
                let product: f64 = (0..=q).map(|k| a[k * n + p] * a[k * n + q]).sum();
                assert!(
                    (product - matrix[order[q] * n + order[p]]).abs() < 1e-14,
                    "{p} {q}"
                );
            }
        }
    }
}
