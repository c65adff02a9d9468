//! Owns smoothing: Chebyshev polynomials in `D⁻¹A`.
//!
//! Every site gathers and writes only itself, so the smoother is symmetric and the same on any number of threads.
//! Rows are made a chunk at a time and used while they are in the cache.

use super::level::{Level, with_rows};
use rayon::prelude::*;

/// Coefficients of `x₊ = x + momentum (x − x₋) + step D⁻¹(b − A x)`, one pair a degree.
#[derive(Debug, Clone)]
pub struct Chebyshev {
    pub steps: Vec<(f32, f32)>,
}

impl Chebyshev {
    /// Damps error components of eigenvalues from `largest / range` to `largest` of `D⁻¹A`.
    pub fn new(largest: f32, range: f32, degree: usize) -> Self {
        let (a, b) = (largest / range, largest);
        let (theta, delta) = (0.5 * (a + b), 0.5 * (b - a));
        let sigma = theta / delta;
        let mut rho = 1.0 / sigma;
        let mut steps = vec![(0.0, 1.0 / theta)];
        for _ in 1..degree {
            let next = 1.0 / (2.0 * sigma - rho);
            steps.push((next * rho, 2.0 * next / delta));
            rho = next;
        }
        Chebyshev { steps }
    }

    /// Smooths `A x = b` from `x = 0`; `other` is room for one more vector.
    pub fn start<const D: usize>(
        &self,
        level: &impl Level<D>,
        b: &[[f32; D]],
        x: &mut Vec<[f32; D]>,
        other: &mut Vec<[f32; D]>,
    ) {
        let step = self.steps[0].1;
        let chunk = level.chunk();
        x.par_chunks_mut(chunk).enumerate().for_each(|(c, x)| {
            for (i, x) in x.iter_mut().enumerate() {
                let site = c * chunk + i;
                *x = level.scale(site, &b[site]).map(|v| step * v);
            }
        });
        if self.steps.len() > 1 {
            other.par_iter_mut().for_each(|v| *v = [0.0; D]);
        }
        for &(momentum, step) in &self.steps[1..] {
            sweep(level, b, x, other, momentum, step);
            std::mem::swap(x, other);
        }
    }

    /// Smooths `A x = b` from the `x` given.
    pub fn go_on<const D: usize>(
        &self,
        level: &impl Level<D>,
        b: &[[f32; D]],
        x: &mut Vec<[f32; D]>,
        other: &mut Vec<[f32; D]>,
    ) {
        for &(momentum, step) in &self.steps {
            sweep(level, b, x, other, momentum, step);
            std::mem::swap(x, other);
        }
    }
}

/// `before = x + momentum (x − before) + step D⁻¹(b − A x)`.
fn sweep<const D: usize>(
    level: &impl Level<D>,
    b: &[[f32; D]],
    x: &[[f32; D]],
    before: &mut [[f32; D]],
    momentum: f32,
    step: f32,
) {
    let chunk = level.chunk();
    before
        .par_chunks_mut(chunk)
        .enumerate()
        .for_each(|(c, before)| {
            with_rows(before.len(), |rows| {
                let start = c * chunk;
                level.rows(start..start + before.len(), x, rows);
                for (i, (before, row)) in before.iter_mut().zip(rows).enumerate() {
                    let site = start + i;
                    let r: [f32; D] = std::array::from_fn(|d| b[site][d] - row[d]);
                    let s = level.scale(site, &r);
                    let x = &x[site];
                    // Without momentum what was there before does not count, whatever it is.
                    for d in 0..D {
                        let turn = if momentum == 0.0 {
                            0.0
                        } else {
                            momentum * (x[d] - before[d])
                        };
                        before[d] = x[d] + turn + step * s[d];
                    }
                }
            })
        });
}
