//! Owns vectors in single precision, and what conjugate gradients does with them.

use crate::operator::MixedPrecision;
use crate::operator::held::Held;
use crate::par::{CHUNK, sum_chunks};
use rayon::prelude::*;

/// Three unknowns a site.
pub type Single = Vec<[f32; 3]>;

/// Part of a vector's norm below which an entry is what rounding left of none. Carried on, its products would fall
/// below what single precision holds in full, and such take a hundred times as long.
const ROUNDING: f64 = 1e-15;

/// An entry of a vector, given as a part of its norm.
pub fn narrow(v: f64) -> f32 {
    if v.abs() > ROUNDING { v as f32 } else { 0.0 }
}

/// `aᵀb`, summed in double precision.
pub fn dot(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    sum_chunks(a.len(), |range| dot_chunk(&a[range.clone()], &b[range]))
}

fn dot_chunk(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let mut lanes = [0.0; 3];
    for (a, b) in a.iter().zip(b) {
        for d in 0..3 {
            lanes[d] += f64::from(a[d]) * f64::from(b[d]);
        }
    }
    lanes.iter().sum()
}

/// `p = z + β p`.
pub fn combine(p: &mut [[f32; 3]], z: &[[f32; 3]], beta: f32) {
    p.par_chunks_mut(CHUNK)
        .zip(z.par_chunks(CHUNK))
        .for_each(|(p, z)| {
            for (p, z) in p.as_flattened_mut().iter_mut().zip(z.as_flattened()) {
                *p = z + beta * *p;
            }
        });
}

/// `p = factor p`.
pub fn scale(p: &mut [[f32; 3]], factor: f32) {
    p.par_iter_mut()
        .with_min_len(CHUNK)
        .for_each(|p| *p = p.map(|v| v * factor));
}

/// `q = A p` in the free components; returns `p·q`.
pub fn image(
    operator: &impl MixedPrecision,
    held: &Held,
    p: &[[f32; 3]],
    q: &mut [[f32; 3]],
) -> f64 {
    operator.apply_single(p, q, |first, q| {
        let sites = first..first + q.len();
        for (q, &bits) in q.iter_mut().zip(&held.0[sites.clone()]) {
            for (d, q) in q.iter_mut().enumerate() {
                if bits & (1 << d) != 0 {
                    *q = 0.0;
                }
            }
        }
        dot_chunk(&p[sites], q)
    })
}

/// `u += unit α p`, `r −= α q`; returns `r·r`.
pub fn advance(
    u: &mut [[f64; 3]],
    r: &mut [[f32; 3]],
    p: &[[f32; 3]],
    q: &[[f32; 3]],
    alpha: f64,
    unit: f64,
) -> f64 {
    let step = unit * alpha;
    let chunks = (
        u.par_chunks_mut(CHUNK),
        r.par_chunks_mut(CHUNK),
        p.par_chunks(CHUNK),
        q.par_chunks(CHUNK),
    );
    let parts: Vec<f64> = chunks
        .into_par_iter()
        .map(|(u, r, p, q)| {
            let mut lanes = [0.0; 3];
            for (((u, r), p), q) in u.iter_mut().zip(r).zip(p).zip(q) {
                for d in 0..3 {
                    u[d] += step * f64::from(p[d]);
                    r[d] -= alpha as f32 * q[d];
                    lanes[d] += f64::from(r[d]) * f64::from(r[d]);
                }
            }
            lanes.iter().sum()
        })
        .collect();
    parts.iter().sum()
}
