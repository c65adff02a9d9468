//! Owns smoothing: Chebyshev polynomials in `D⁻¹A`, and the largest eigenvalue that they need.
//!
//! Every site gathers and writes only itself, so the smoother is symmetric and the same on any number of threads.
//! Rows are made a chunk at a time and used while they are in the cache.

use super::level::Level;
use rayon::prelude::*;

/// Sites per task.
pub const CHUNK: usize = 2048;

/// Coefficients of `x₊ = x + momentum (x − x₋) + step D⁻¹(b − A x)`, one pair a degree.
#[derive(Debug, Clone)]
pub struct Chebyshev {
    steps: Vec<(f32, f32)>,
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
        x.par_chunks_mut(CHUNK).enumerate().for_each(|(c, x)| {
            for (i, x) in x.iter_mut().enumerate() {
                let site = c * CHUNK + i;
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
    before
        .par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(c, before)| {
            let start = c * CHUNK;
            let mut rows = [[0.0; D]; CHUNK];
            let rows = &mut rows[..before.len()];
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
        });
}

/// The largest eigenvalue of `D⁻¹A` to a few percent from below, by power iteration.
pub fn largest_eigenvalue<const D: usize>(level: &impl Level<D>) -> f32 {
    let n = level.sites();
    let mut x: Vec<[f32; D]> = (0..n)
        .into_par_iter()
        .map(|i| {
            let noise: [f32; D] = std::array::from_fn(|d| noise((i * D + d) as u32));
            level.scale(i, &noise)
        })
        .collect();
    let mut y = vec![[0.0; D]; n];
    let mut largest = 0.0;
    for _ in 0..POWER_STEPS {
        // (x, A D⁻¹ A x) / (x, A x) lies nearer the largest than (x, A x) / (x, D x).
        let parts: Vec<(f64, f64)> = y
            .par_chunks_mut(CHUNK)
            .enumerate()
            .map(|(c, y)| {
                let start = c * CHUNK;
                let mut rows = [[0.0; D]; CHUNK];
                let rows = &mut rows[..y.len()];
                level.rows(start..start + y.len(), &x, rows);
                let (mut top, mut bottom) = (0.0, 0.0);
                for (i, (y, row)) in y.iter_mut().zip(rows).enumerate() {
                    *y = level.scale(start + i, row);
                    for d in 0..D {
                        top += f64::from(row[d] * y[d]);
                        bottom += f64::from(row[d] * x[start + i][d]);
                    }
                }
                (top, bottom)
            })
            .collect();
        let top: f64 = parts.iter().map(|p| p.0).sum();
        let bottom: f64 = parts.iter().map(|p| p.1).sum();
        if !(top > 0.0 && bottom > 0.0) {
            break;
        }
        largest = (top / bottom) as f32;
        let shrink = largest.recip();
        y.par_iter_mut().for_each(|y| *y = y.map(|v| v * shrink));
        std::mem::swap(&mut x, &mut y);
    }
    largest
}

const POWER_STEPS: usize = 15;

/// A number between −1 and 1 that looks random, the same on every machine.
fn noise(i: u32) -> f32 {
    let mut h = i.wrapping_mul(0x9E37_79B9) ^ 0x5bd1_e995;
    h = (h ^ (h >> 15)).wrapping_mul(0x85EB_CA6B);
    h = (h ^ (h >> 13)).wrapping_mul(0xC2B2_AE35);
    (h ^ (h >> 16)) as f32 / u32::MAX as f32 * 2.0 - 1.0
}
