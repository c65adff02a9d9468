//! Owns the cycle of one level, and the polynomial of several that solves an assembled one.

use super::aggregate::NONE;
use super::aggregate::Sums;
use super::chebyshev::Chebyshev;
use super::level::{Level, Six, with_rows};
use rayon::prelude::*;
use std::ops::Range;

/// Vectors of an assembled level, kept from cycle to cycle.
#[derive(Debug, Clone)]
pub struct Vectors {
    /// Right-hand side.
    pub b: Vec<Six>,
    /// Solution.
    pub x: Vec<Six>,
    /// The solution before, residual and result of a cycle, and its spare vector.
    before: Vec<Six>,
    r: Vec<Six>,
    z: Vec<Six>,
    spare: Vec<Six>,
}

impl Vectors {
    pub fn new(n: usize) -> Self {
        let zero = || vec![[0.0; 6]; n];
        Vectors {
            b: zero(),
            x: zero(),
            before: zero(),
            r: zero(),
            z: zero(),
            spare: zero(),
        }
    }
}

/// One cycle on an assembled level: `z ≈ A⁻¹ r`.
pub fn one_cycle(
    level: &impl Level<6>,
    how: &Smoothing,
    r: &[Six],
    z: &mut [Six],
    room: &mut Vectors,
    below: &mut impl Below,
) {
    cycle(level, how, r, &mut room.z, &mut room.spare, below);
    z.copy_from_slice(&room.z);
}

/// The problem below a level.
pub trait Below {
    /// Its right-hand side, to be filled in.
    fn right(&mut self) -> &mut [Six];
    /// Its solution.
    fn solve(&mut self) -> &[Six];
}

/// How one level smooths and prolongs.
#[derive(Debug, Clone)]
pub struct Smoothing {
    pub smoother: Chebyshev,
    /// Of the prolongator `(I − ω D⁻¹A) P₀`.
    pub omega: f32,
}

/// Solves `A x = b` by cycles, as many as `cycles` has degrees, put together
/// by its Chebyshev polynomial. The polynomial is fixed, so all of it is linear and symmetric.
pub fn accelerated(
    level: &impl Level<6>,
    how: &Smoothing,
    cycles: &Chebyshev,
    room: &mut Vectors,
    below: &mut impl Below,
) {
    let Vectors {
        b,
        x,
        before,
        r,
        z,
        spare,
    } = room;
    x.fill([0.0; 6]);
    before.fill([0.0; 6]);
    let chunk = level.chunk();
    for (k, &(momentum, step)) in cycles.steps.iter().enumerate() {
        let right = if k == 0 {
            &*b
        } else {
            r.par_chunks_mut(chunk).enumerate().for_each(|(c, r)| {
                let start = c * chunk;
                level.rows(start..start + r.len(), x, r);
                for (r, b) in r.iter_mut().zip(&b[start..]) {
                    *r = std::array::from_fn(|d| b[d] - r[d]);
                }
            });
            &*r
        };
        cycle(level, how, right, z, spare, below);
        let values = before.par_iter_mut().with_min_len(chunk).zip(&*x).zip(&*z);
        values.for_each(|((before, x), z)| {
            *before = std::array::from_fn(|d| x[d] + momentum * (x[d] - before[d]) + step * z[d]);
        });
        std::mem::swap(x, before);
    }
}

/// One cycle for `A x = b` from zero. In addition to `b` and `x` there is one vector more, `spare`.
pub fn cycle<const D: usize>(
    level: &impl Level<D>,
    how: &Smoothing,
    b: &[[f32; D]],
    x: &mut Vec<[f32; D]>,
    spare: &mut Vec<[f32; D]>,
    below: &mut impl Below,
) {
    how.smoother.start(level, b, x, spare);
    scaled_residual(level, b, x, spare);
    restrict(level, how.omega, b, x, spare, below.right());
    spread(level, below.solve(), spare);
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
    let chunk = level.chunk();
    t.par_chunks_mut(chunk).enumerate().for_each(|(c, t)| {
        let start = c * chunk;
        level.rows(start..start + t.len(), x, t);
        for (site, t) in (start..).zip(t) {
            let s: [f32; D] = std::array::from_fn(|d| b[site][d] - t[d]);
            *t = level.scale(site, &s);
        }
    });
}

/// `g = P₀ᵀ (s − ω A t)`, where `s = b − A x` and `t = D⁻¹ s`. The residual is recovered from `t` where that is exact,
/// and computed again elsewhere: one vector less to keep.
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
        with_rows(sites.len(), |image| {
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
    let chunk = level.chunk();
    let chunks = x.par_chunks_mut(chunk).enumerate();
    chunks.for_each(|(c, x)| {
        with_rows(x.len(), |rows| {
            let start = c * chunk;
            level.rows(start..start + x.len(), v, rows);
            for (i, (x, row)) in x.iter_mut().zip(rows).enumerate() {
                let scaled = level.scale(start + i, row);
                for d in 0..D {
                    x[d] += v[start + i][d] - omega * scaled[d];
                }
            }
        })
    });
}

/// `v = P₀ e`.
fn spread<const D: usize>(level: &impl Level<D>, e: &[Six], v: &mut [[f32; D]]) {
    let (aggregates, chunk) = (level.aggregates(), level.chunk());
    v.par_chunks_mut(chunk).enumerate().for_each(|(c, v)| {
        let start = c * chunk;
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
