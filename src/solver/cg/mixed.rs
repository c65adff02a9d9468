//! Owns conjugate gradients in mixed precision, for large models: 72 bytes a site in all instead of 150.
//!
//! The displacements are in double precision, residual, direction and their images in single. What single precision
//! loses is restored: residual and energy are computed again from the displacements, in double precision, whenever one of
//! them has fallen by a thousand (van der Vorst & Ye 2000); so any accuracy is reached that double precision
//! allows.

use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision, SinglePreconditioner};
use crate::par::{CHUNK, sum_chunks};
use crate::solver::cg::error::EnergyTail;
use crate::solver::cg::{
    CgInfo, CgParams, CgStep, Ended, MECHANISM_ENERGY, State, checked, energy_error, goal_error,
    is_met,
};
use rayon::prelude::*;

/// Fall of the residual's norm, or of the energy, after which both are computed again: far enough from what single precision resolves.
const REPLACE: f64 = 1e-3;

/// Energy, of that made the last time, above which it has risen by more than rounding: each iteration should lower it.
const RISE: f64 = 1.0 + 1e-6;

/// Part of the residual's norm below which an entry is what rounding left of none. Carried on, its products would fall
/// below what single precision holds in full, and such take a hundred times as long.
const ROUNDING: f64 = 1e-15;

type Single = Vec<[f32; 3]>;

/// As [`crate::solver::cg::minimise`].
pub fn minimise<F: Functional<3>>(
    operator: &impl MixedPrecision,
    held: &Held,
    preconditioner: &impl SinglePreconditioner<3>,
    u: &mut [[f64; 3]],
    params: &CgParams,
    goal: Option<&F>,
    mut observe: impl FnMut(CgStep),
) -> CgInfo {
    let n = operator.sites();
    let room = || vec![[0f32; 3]; n];
    let (mut r, mut p, mut z, mut spare): (Single, Single, Single, Single) =
        (room(), room(), room(), room());
    let start = residual(operator, held, u, 1.0, &mut r);
    let whole = params.reference_energy.unwrap_or(start.energy);
    // One unit of the single-precision vectors, in the units of `u`.
    let mut unit = start.norm;
    let mut tail = EnergyTail::default();
    let mut goal_value = goal.map(|goal| goal.of(u));
    let (mut iterations, mut ended) = (0, Ended::IterationLimit);
    let mut rz_before = 1.0;
    if start.norm == 0.0 {
        ended = Ended::ResidualTolerance;
    } else {
        residual(operator, held, u, unit, &mut r);
    }
    let mut fallen = 1.0;
    // The energy when it was last made from the displacements, and what the iterations had gained by then.
    let mut anchor = (start.energy, 0.0);
    while ended == Ended::IterationLimit {
        preconditioner.apply_single(&r, &mut z, &mut spare);
        let rz = dot(&r, &z);
        let energy = anchor.0 - (tail.total() - anchor.1);
        if iterations > 0 {
            let of_energy = tail.update(unit * unit * rz).map(|e| e / energy);
            let error = tail.with_goal(of_energy, goal_value);
            observe(CgStep {
                iteration: iterations,
                residual: fallen,
                energy_error: error,
            });
            if is_met(params, error) {
                ended = Ended::EnergyTolerance;
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
        if let (Some(goal), Some(value)) = (goal, goal_value.as_mut()) {
            let change = unit * alpha * goal.of_single(&p);
            *value += change;
            tail.push_change(change);
        }
        fallen = unit * norm / start.norm;
        let expected = anchor.0 - (tail.total() - anchor.1);
        if fallen <= params.residual_tolerance {
            ended = Ended::ResidualTolerance;
        } else if norm < REPLACE || expected < REPLACE * anchor.0 {
            let before = unit;
            unit *= norm;
            let now = residual(operator, held, u, unit, &mut r);
            ended = checked(ended, expected, now.energy, anchor.0);
            if now.energy > RISE * anchor.0 {
                ended = Ended::Breakdown;
            }
            anchor = (now.energy, tail.total());
            norm = now.norm;
            let grown = before / unit;
            rz_before *= grown * grown;
            scale(&mut p, grown as f32);
            if ended == Ended::Breakdown {
                break;
            }
            if now.energy <= MECHANISM_ENERGY * whole {
                ended = Ended::Mechanism;
            } else if norm == 0.0 {
                ended = Ended::ResidualTolerance;
            }
        }
    }
    let end = residual(operator, held, u, unit.max(f64::MIN_POSITIVE), &mut r);
    let expected = anchor.0 - (tail.total() - anchor.1);
    ended = checked(ended, expected, end.energy, anchor.0);
    CgInfo {
        ended,
        iterations,
        residual: if start.norm > 0.0 {
            end.norm / start.norm
        } else {
            0.0
        },
        energy: end.energy,
        start_energy: start.energy,
        energy_error: energy_error(ended, &tail, end.energy, start.norm),
        goal_error: goal_value.map(|value| goal_error(ended, &tail, value, start.norm)),
    }
}

/// `r = −(A u) / unit` in the free components, part by part from double precision.
fn residual(
    operator: &impl MixedPrecision,
    held: &Held,
    u: &[[f64; 3]],
    unit: f64,
    r: &mut [[f32; 3]],
) -> State {
    let consume = |first: usize, force: &[[f64; 3]], r: &mut [[f32; 3]]| {
        let (mut energy, mut squared) = (0.0, 0.0);
        for (i, (r, f)) in r.iter_mut().zip(force).enumerate() {
            for d in 0..3 {
                energy += u[first + i][d] * f[d];
                let free = !held.is_held(first + i, d);
                let v = if free { -f[d] } else { 0.0 };
                squared += v * v;
                let v = v / unit;
                r[d] = if v.abs() > ROUNDING { v as f32 } else { 0.0 };
            }
        }
        [energy, squared]
    };
    let [energy, squared] = operator.for_each_chunk(u, r, consume);
    State {
        energy,
        norm: squared.sqrt(),
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
fn image(operator: &impl MixedPrecision, held: &Held, p: &[[f32; 3]], q: &mut [[f32; 3]]) -> f64 {
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
pub(super) mod tests {
    use super::*;
    use crate::operator::Operator;
    use crate::operator::coarsen::{Block, Coarsen, VisitRow};
    use crate::solver::cg::ENERGY_ALONE;
    use std::ops::Range;

    /// A chain of unit springs along x, but for the first; held across.
    pub struct Chain {
        pub sites: usize,
        pub first: f64,
    }

    impl Chain {
        pub fn of(sites: usize) -> Self {
            Chain { sites, first: 1.0 }
        }

        fn pull(&self, i: usize, u: impl Fn(usize) -> f64) -> f64 {
            let spring = |i: usize| if i == 0 { self.first } else { 1.0 };
            let left = if i > 0 {
                spring(i - 1) * (u(i) - u(i - 1))
            } else {
                0.0
            };
            let last = i + 1 == self.sites;
            left + if last {
                0.0
            } else {
                spring(i) * (u(i) - u(i + 1))
            }
        }
    }

    /// What the first spring bears.
    struct Reaction(f64);

    impl Functional<3> for Reaction {
        fn of(&self, u: &[[f64; 3]]) -> f64 {
            self.0 * (u[1][0] - u[0][0])
        }
        fn of_single(&self, u: &[[f32; 3]]) -> f64 {
            self.0 * f64::from(u[1][0] - u[0][0])
        }
    }

    impl Operator<3> for Chain {
        fn sites(&self) -> usize {
            self.sites
        }
        fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
            self.rows_f64(0..self.sites, x, y);
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
                *y = [self.pull(i, |i| x[i][0]), 0.0, 0.0];
            }
        }
        fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
            for (i, y) in sites.zip(y) {
                *y = [self.pull(i, |i| f64::from(x[i][0])) as f32, 0.0, 0.0];
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

    /// The chain held at its ends and stretched by one.
    pub fn stretched(n: usize) -> (Held, Vec<[f64; 3]>) {
        let mut held = Held::none(n);
        for i in 0..n {
            held.hold(i, 1);
            held.hold(i, 2);
        }
        held.hold(0, 0);
        held.hold(n - 1, 0);
        let mut u = vec![[0.0; 3]; n];
        u[n - 1][0] = 1.0;
        (held, u)
    }

    /// The stretch of a chain to ten digits more than single precision has, by computing the residual again.
    #[test]
    fn single_precision_vectors_do_not_limit_the_result() {
        let n = 120;
        let (held, mut u) = stretched(n);
        let params = CgParams {
            energy_tolerance: 0.0,
            ..CgParams::default()
        };
        let info = minimise(
            &Chain::of(n),
            &held,
            &Plain,
            &mut u,
            &params,
            ENERGY_ALONE,
            |_| (),
        );
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

    /// Nine tenths of a millionth of the start's energy, and still its error is what is stated.
    #[test]
    fn what_keeps_little_of_the_starts_energy_converges() {
        let first = 9e-7;
        let chain = Chain { sites: 30, first };
        let (held, mut u) = stretched(30);
        let goal = Reaction(first);
        let params = CgParams::default();
        let info = minimise(&chain, &held, &Plain, &mut u, &params, Some(&goal), |_| ());
        assert_eq!(info.ended, Ended::EnergyTolerance, "{info:?}");
        let exact = 1.0 / (1.0 / first + 28.0);
        assert!((info.energy / exact - 1.0).abs() <= 1e-3, "{info:?}");
        assert!(info.energy - exact <= info.energy_error, "{info:?}");
        assert!(
            info.goal_error.unwrap() <= 1e-3 * goal.of(&u).abs(),
            "{info:?}"
        );
    }

    /// A preconditioner that is not symmetric spoils the recurrences; what they then say is not trusted.
    #[test]
    fn an_energy_that_is_not_what_the_iterations_say_is_a_breakdown() {
        assert_eq!(
            checked(Ended::EnergyTolerance, 1.0, 1.02, 5.0),
            Ended::Breakdown
        );
        assert_eq!(checked(Ended::Mechanism, 0.0, 1e-3, 10.0), Ended::Breakdown);
        assert_eq!(checked(Ended::Mechanism, 0.0, 1e-9, 10.0), Ended::Mechanism);
    }
}
