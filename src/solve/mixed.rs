//! Owns conjugate gradients in mixed precision, for large models: 72 bytes a site in all instead of 150.
//!
//! The displacements are in double precision, residual, direction and their images in single. What single precision
//! loses is had back by making the residual anew from the displacements, in double precision, whenever it has fallen
//! by a thousand (van der Vorst & Ye 2000); so any accuracy is reached that double precision allows.

use crate::operator::SinglePreconditioner;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::par::{CHUNK, sum_chunks};
use crate::solve::cg::{CgInfo, CgParams, CgStep, Ended, NOTHING, energy_error, met};
use crate::solve::estimate::EnergyTail;
use rayon::prelude::*;

/// Fall of the residual's norm after which it is made anew: far enough from what single precision resolves.
const REPLACE: f64 = 1e-3;

type Single = Vec<[f32; 3]>;

/// As [`crate::solve::cg::minimise`].
pub fn minimise(
    operator: &impl Coarsen,
    held: &Held,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let n = operator.sites();
    let room = || vec![[0f32; 3]; n];
    let (mut r, mut p, mut z, mut spare): (Single, Single, Single, Single) =
        (room(), room(), room(), room());
    let start = residual(operator, held, u, 1.0, &mut r);
    // One unit of the single-precision vectors, in the units of `u`.
    let mut unit = start.norm;
    let mut tail = EnergyTail::default();
    let (mut iterations, mut ended) = (0, Ended::IterationLimit);
    let mut rz_before = 1.0;
    if start.norm == 0.0 {
        ended = Ended::ResidualTolerance;
    } else {
        residual(operator, held, u, unit, &mut r);
    }
    let mut fallen = 1.0;
    while ended == Ended::IterationLimit {
        preconditioner.apply_single(&r, &mut z, &mut spare);
        let rz = dot(&r, &z);
        let energy = start.energy - tail.total();
        if iterations > 0 {
            let error = tail.update(unit * unit * rz).map(|e| e / energy);
            observe(CgStep {
                iteration: iterations,
                residual: fallen,
                energy_error: error,
            });
            if let Some(met) = met(params, error, energy / start.energy) {
                ended = met;
                break;
            }
        }
        if iterations >= params.max_iterations {
            break;
        }
        let beta = if iterations == 0 { 0.0 } else { rz / rz_before };
        combine(&mut p, &z, beta as f32);
        // z now holds A p.
        let curvature = image(operator, held, &p, &mut z);
        if !(curvature > 0.0 && rz > 0.0 && curvature.is_finite() && rz.is_finite()) {
            ended = Ended::Breakdown;
            break;
        }
        let alpha = rz / curvature;
        let mut norm = advance(u, &mut r, &p, &z, alpha, unit).sqrt();
        rz_before = rz;
        iterations += 1;
        tail.push(alpha, unit * unit * rz);
        fallen = unit * norm / start.norm;
        if fallen <= params.residual_tolerance {
            ended = Ended::ResidualTolerance;
        } else if start.energy - tail.total() <= NOTHING * start.energy {
            ended = Ended::Mechanism;
        } else if norm < REPLACE {
            let before = unit;
            unit *= norm;
            norm = residual(operator, held, u, unit, &mut r).norm;
            let grown = before / unit;
            rz_before *= grown * grown;
            scale(&mut p, grown as f32);
            if norm == 0.0 {
                ended = Ended::ResidualTolerance;
            }
        }
    }
    let end = residual(operator, held, u, unit.max(f64::MIN_POSITIVE), &mut r);
    CgInfo {
        ended,
        iterations,
        residual: if start.norm > 0.0 {
            end.norm / start.norm
        } else {
            0.0
        },
        energy: end.energy,
        energy_error: energy_error(ended, &tail, end.energy, start.norm),
        goal_error: None,
    }
}

/// Of a displacement field: its energy `uᵀAu` and the norm of its residual.
struct State {
    energy: f64,
    norm: f64,
}

/// `r = −(A u) / unit` in the free components, chunk by chunk from double precision.
fn residual(
    operator: &impl Coarsen,
    held: &Held,
    u: &[[f64; 3]],
    unit: f64,
    r: &mut [[f32; 3]],
) -> State {
    let parts: Vec<[f64; 2]> = r
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(c, r)| {
            let start = c * CHUNK;
            let mut force = vec![[0.0; 3]; r.len()];
            operator.rows_f64(start..start + r.len(), u, &mut force);
            let (mut energy, mut squared) = (0.0, 0.0);
            for (i, (r, f)) in r.iter_mut().zip(&force).enumerate() {
                for d in 0..3 {
                    energy += u[start + i][d] * f[d];
                    let free = !held.is_held(start + i, d);
                    let v = if free { -f[d] } else { 0.0 };
                    squared += v * v;
                    r[d] = (v / unit) as f32;
                }
            }
            [energy, squared]
        })
        .collect();
    let sum = |k: usize| parts.iter().map(|p| p[k]).sum::<f64>();
    State {
        energy: sum(0),
        norm: sum(1).sqrt(),
    }
}

fn dot(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
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
fn combine(p: &mut [[f32; 3]], z: &[[f32; 3]], beta: f32) {
    p.par_chunks_mut(CHUNK)
        .zip(z.par_chunks(CHUNK))
        .for_each(|(p, z)| {
            for (p, z) in p.as_flattened_mut().iter_mut().zip(z.as_flattened()) {
                *p = z + beta * *p;
            }
        });
}

fn scale(p: &mut [[f32; 3]], factor: f32) {
    p.par_iter_mut()
        .with_min_len(CHUNK)
        .for_each(|p| *p = p.map(|v| v * factor));
}

/// `q = A p` in the free components; returns `p·q`.
fn image(operator: &impl Coarsen, held: &Held, p: &[[f32; 3]], q: &mut [[f32; 3]]) -> f64 {
    let parts: Vec<f64> = q
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(c, q)| {
            let sites = c * CHUNK..c * CHUNK + q.len();
            operator.rows_f32(sites.clone(), p, q);
            for (q, &bits) in q.iter_mut().zip(&held.0[sites.clone()]) {
                for (d, q) in q.iter_mut().enumerate() {
                    if bits & (1 << d) != 0 {
                        *q = 0.0;
                    }
                }
            }
            dot_chunk(&p[sites], q)
        })
        .collect();
    parts.iter().sum()
}

/// `u += unit α p`, `r −= α q`; returns `r·r`.
fn advance(
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::Operator;
    use crate::operator::coarsen::{Block, VisitRow};
    use std::ops::Range;

    /// A chain of springs along x, held across.
    struct Chain(usize);

    impl Operator<3> for Chain {
        fn sites(&self) -> usize {
            self.0
        }
        fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
            self.rows_f64(0..self.0, x, y);
        }
        fn diagonal(&self, d: &mut [[f64; 3]]) {
            d.fill([2.0; 3]);
        }
    }

    impl Coarsen for Chain {
        fn positions(&self, _: Range<usize>, _: &mut [[f64; 3]]) {}
        fn each_row(&self, _: Range<usize>, _: &mut VisitRow<Block>) {}
        fn reach(&self, sites: Range<usize>) -> Range<usize> {
            sites
        }
        fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
            for (i, y) in sites.zip(y) {
                let [left, right] = [i.saturating_sub(1), (i + 1).min(self.0 - 1)].map(|j| x[j][0]);
                *y = [2.0 * x[i][0] - left - right, 0.0, 0.0];
            }
        }
        fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
            for (i, y) in sites.zip(y) {
                let [left, right] = [i.saturating_sub(1), (i + 1).min(self.0 - 1)].map(|j| x[j][0]);
                *y = [2.0 * x[i][0] - left - right, 0.0, 0.0];
            }
        }
        fn eigenvalue_bound(&self) -> f64 {
            2.0
        }
    }

    struct Plain;

    impl SinglePreconditioner<3> for Plain {
        fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, _: &mut Vec<[f32; 3]>) {
            z.copy_from_slice(r);
        }
    }

    /// The stretch of a chain to ten digits more than single precision has, by making the residual anew.
    #[test]
    fn single_precision_vectors_do_not_limit_the_result() {
        let n = 120;
        let mut held = Held::none(n);
        for i in 0..n {
            held.hold(i, 1);
            held.hold(i, 2);
        }
        held.hold(0, 0);
        held.hold(n - 1, 0);
        let mut u = vec![[0.0; 3]; n];
        u[n - 1][0] = 1.0;
        let params = CgParams {
            energy_tolerance: 0.0,
            ..CgParams::default()
        };
        let info = minimise(&Chain(n), &held, &Plain, &mut u, &params, |_| ());
        assert!(
            info.ended == Ended::ResidualTolerance && info.residual < 1e-11,
            "{info:?}"
        );
        assert!(
            (info.energy * (n - 1) as f64 - 1.0).abs() < 1e-12,
            "{info:?}"
        );
        for (i, u) in u.iter().enumerate() {
            assert!((u[0] - i as f64 / (n - 1) as f64).abs() < 1e-10, "{i}");
        }
    }
}
