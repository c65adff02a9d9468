//! Owns the V-cycle.

use super::aggregate::NONE;
use super::aggregate::Sums;
use super::chebyshev::{CHUNK, Chebyshev};
use super::level::{Level, Six};
use rayon::prelude::*;
use std::ops::Range;

/// Vectors of an assembled level, kept from cycle to cycle.
#[derive(Debug, Clone)]
pub struct Vectors {
    /// Right-hand side.
    pub b: Vec<Six>,
    pub x: Vec<Six>,
    pub spare: Vec<Six>,
}

impl Vectors {
    pub fn new(n: usize) -> Self {
        let zero = || vec![[0.0; 6]; n];
        Vectors {
            b: zero(),
            x: zero(),
            spare: zero(),
        }
    }
}

/// How one level smooths and prolongs.
#[derive(Debug, Clone)]
pub struct Smoothing {
    pub smoother: Chebyshev,
    /// Of the prolongator `(I − ω D⁻¹A) P₀`.
    pub omega: f32,
}

/// One cycle for `A x = b` from zero. `next(collect)` solves the coarse problem, whose right-hand side `collect` makes.
/// Beside `b` and `x` there is one vector more, `spare`.
pub fn cycle<'e, const D: usize>(
    level: &impl Level<D>,
    how: &Smoothing,
    b: &[[f32; D]],
    x: &mut Vec<[f32; D]>,
    spare: &mut Vec<[f32; D]>,
    next: impl FnOnce(&mut dyn FnMut(&mut [Six])) -> &'e [Six],
) {
    how.smoother.start(level, b, x, spare);
    scaled_residual(level, b, x, spare);
    let correction = next(&mut |g| restrict(level, how.omega, b, x, spare, g));
    spread(level, correction, spare);
    add_smoothed(level, how.omega, spare, x);
    how.smoother.go_on(level, b, x, spare);
}

/// `t = D⁻¹ (b − A x)`.
fn scaled_residual<const D: usize>(
    level: &impl Level<D>,
    b: &[[f32; D]],
    x: &[[f32; D]],
    t: &mut [[f32; D]],
) {
    t.par_chunks_mut(CHUNK).enumerate().for_each(|(c, t)| {
        let start = c * CHUNK;
        level.rows(start..start + t.len(), x, t);
        for (site, t) in (start..).zip(t) {
            let s: [f32; D] = std::array::from_fn(|d| b[site][d] - t[d]);
            *t = level.scale(site, &s);
        }
    });
}

/// `g = P₀ᵀ (s − ω A t)`, where `s = b − A x` and `t = D⁻¹ s`. The residual is had back from `t` where that is exact,
/// and made again elsewhere: a vector less to keep.
fn restrict<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    b: &[[f32; D]],
    x: &[[f32; D]],
    t: &[[f32; D]],
    g: &mut [Six],
) {
    let visit = |sites: Range<usize>, sums: &mut Sums<[f32; 8]>| {
        let start = sites.start;
        let mut image = [[0.0; D]; CHUNK];
        let image = &mut image[..sites.len()];
        level.rows(sites.clone(), t, image);
        let mut again = Vec::new();
        if level.unscale(start, &t[start]).is_none() {
            again.resize(sites.len(), [0.0; D]);
            level.rows(sites.clone(), x, &mut again);
        }
        level.each_modes(sites, |site, modes| {
            let Some(sum) = sums.of(site) else { return };
            let i = site - start;
            let s = level
                .unscale(site, &t[site])
                .unwrap_or_else(|| std::array::from_fn(|d| b[site][d] - again[i][d]));
            for d in 0..D {
                let v = s[d] - omega * image[i][d];
                for (sum, mode) in sum.iter_mut().zip(&modes[d]) {
                    *sum += mode * v;
                }
            }
        });
    };
    let add = |sum: &mut [f32; 8], part: &[f32; 8]| {
        sum.iter_mut().zip(part).for_each(|(s, p)| *s += p);
    };
    let mut wide = vec![[0.0; 8]; g.len()];
    level.aggregates().sum(&mut wide, [0.0; 8], visit, add);
    for (g, wide) in g.iter_mut().zip(&wide) {
        g.copy_from_slice(&wide[..6]);
    }
}

/// `x += v − ω D⁻¹ A v`.
fn add_smoothed<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    v: &[[f32; D]],
    x: &mut [[f32; D]],
) {
    x.par_chunks_mut(CHUNK).enumerate().for_each(|(c, x)| {
        let start = c * CHUNK;
        let mut rows = [[0.0; D]; CHUNK];
        let rows = &mut rows[..x.len()];
        level.rows(start..start + x.len(), v, rows);
        for (i, (x, row)) in x.iter_mut().zip(rows).enumerate() {
            let scaled = level.scale(start + i, row);
            for d in 0..D {
                x[d] += v[start + i][d] - omega * scaled[d];
            }
        }
    });
}

/// `v = P₀ e`.
fn spread<const D: usize>(level: &impl Level<D>, e: &[Six], v: &mut [[f32; D]]) {
    let aggregates = level.aggregates();
    v.par_chunks_mut(CHUNK).enumerate().for_each(|(c, v)| {
        let start = c * CHUNK;
        level.each_modes(start..start + v.len(), |site, modes| {
            let v = &mut v[site - start];
            *v = [0.0; D];
            let aggregate = aggregates.of(site);
            if aggregate != NONE {
                let e = &e[aggregate as usize];
                for d in 0..D {
                    v[d] = (0..6).map(|k| modes[d][k] * e[k]).sum();
                }
            }
        });
    });
}
