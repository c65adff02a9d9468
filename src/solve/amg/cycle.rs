//! Owns the V-cycle.

use super::aggregate::Aggregates;
use super::chebyshev::{CHUNK, Chebyshev};
use super::level::{Level, NONE, Six};
use rayon::prelude::*;

/// Vectors of one level, kept from cycle to cycle.
#[derive(Debug, Clone)]
pub struct Vectors<const D: usize> {
    /// Right-hand side.
    pub b: Vec<[f32; D]>,
    pub x: Vec<[f32; D]>,
    s: Vec<[f32; D]>,
    t: Vec<[f32; D]>,
}

impl<const D: usize> Vectors<D> {
    pub fn new(n: usize) -> Self {
        Vectors {
            b: vec![[0.0; D]; n],
            x: vec![[0.0; D]; n],
            s: vec![[0.0; D]; n],
            t: vec![[0.0; D]; n],
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

/// One cycle for `A x = b` from zero; `next` solves the coarse problem of its first argument into its second.
pub fn cycle<const D: usize>(
    level: &impl Level<D>,
    aggregates: &Aggregates,
    how: &Smoothing,
    v: &mut Vectors<D>,
    next: impl FnOnce(&mut dyn FnMut(&mut [Six]), &mut dyn FnMut(&[Six])),
) {
    let Vectors { b, x, s, t } = v;
    how.smoother.start(level, b, x, s);
    residual(level, b, x, s, t);
    subtract_image(level, how.omega, t, s);
    let s_now: &Vec<[f32; D]> = s;
    let mut collect_now = |g: &mut [Six]| collect(level, aggregates, s_now, g);
    let mut prolong = |e: &[Six]| {
        spread(level, e, t);
        add_prolonged(level, how.omega, t, x);
    };
    next(&mut collect_now, &mut prolong);
    how.smoother.go_on(level, b, x, s);
}

/// `s = b − A x`, `t = D⁻¹ s`.
fn residual<const D: usize>(
    level: &impl Level<D>,
    b: &[[f32; D]],
    x: &[[f32; D]],
    s: &mut [[f32; D]],
    t: &mut [[f32; D]],
) {
    s.par_chunks_mut(CHUNK)
        .zip(t.par_chunks_mut(CHUNK))
        .enumerate()
        .for_each(|(c, (s, t))| {
            let start = c * CHUNK;
            level.rows(start..start + s.len(), x, s);
            for (i, (s, t)) in s.iter_mut().zip(t).enumerate() {
                for d in 0..D {
                    s[d] = b[start + i][d] - s[d];
                }
                *t = level.scale(start + i, s);
            }
        });
}

/// `s −= ω A t`.
fn subtract_image<const D: usize>(
    level: &impl Level<D>,
    omega: f32,
    t: &[[f32; D]],
    s: &mut [[f32; D]],
) {
    s.par_chunks_mut(CHUNK).enumerate().for_each(|(c, s)| {
        let start = c * CHUNK;
        let mut rows = [[0.0; D]; CHUNK];
        let rows = &mut rows[..s.len()];
        level.rows(start..start + s.len(), t, rows);
        for (s, row) in s.iter_mut().zip(rows) {
            for d in 0..D {
                s[d] -= omega * row[d];
            }
        }
    });
}

/// `x += v − ω D⁻¹ A v`.
fn add_prolonged<const D: usize>(
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

/// `g = P₀ᵀ s`, gathered aggregate by aggregate.
fn collect<const D: usize>(
    level: &impl Level<D>,
    aggregates: &Aggregates,
    s: &[[f32; D]],
    g: &mut [Six],
) {
    g.par_iter_mut()
        .with_min_len(64)
        .enumerate()
        .for_each(|(a, g)| {
            let mut sum = [0f32; 8];
            for &i in aggregates.members(a) {
                let modes = level.modes(i as usize);
                for d in 0..D {
                    for k in 0..8 {
                        sum[k] += modes[d][k] * s[i as usize][d];
                    }
                }
            }
            g.copy_from_slice(&sum[..6]);
        });
}

/// `v = P₀ e`.
fn spread<const D: usize>(level: &impl Level<D>, e: &[Six], v: &mut [[f32; D]]) {
    v.par_chunks_mut(CHUNK).enumerate().for_each(|(c, v)| {
        for (i, v) in v.iter_mut().enumerate() {
            let site = c * CHUNK + i;
            let aggregate = level.aggregate(site);
            *v = [0.0; D];
            if aggregate != NONE {
                let (modes, e) = (level.modes(site), &e[aggregate as usize]);
                for d in 0..D {
                    v[d] = (0..6).map(|k| modes[d][k] * e[k]).sum();
                }
            }
        }
    });
}
