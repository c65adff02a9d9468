//! Owns conjugate gradients in double precision.

use super::{CgInfo, CgParams, CgStep, State, Vectors, are_positive, iterate};
use crate::operator::held::{Constrained, Outside};
use crate::operator::{Functional, Operator, Preconditioner};
use crate::par::{CHUNK, dot};
use rayon::prelude::*;

/// Minimises `½ uᵀAu − fᵀu` over the unknowns that are not held, starting from (and keeping the held values of) `u`.
///
/// The energy is what prescribed displacements minimise, so its error is the squared energy norm of the algebraic
/// error, which conjugate gradients estimates from its own coefficients ([`EnergyTail`](crate::solver::cg::error::EnergyTail)).
///
/// Where a `goal` is wanted instead of the energy, it is found to the same accuracy. Iteration `j` changes it by
/// `α_j J(p_j)`, exactly; what later iterations will change it by is estimated from the sizes of the past changes
/// ([`goal_estimate`](crate::solver::cg::error::EnergyTail::goal_estimate)). Their signs may differ, so this errs on the safe side.
pub fn minimise<'a, F: Functional<D>, const D: usize>(
    operator: &impl Operator<D>,
    outside: impl Into<Outside<'a, D>>,
    preconditioner: &impl Preconditioner<D>,
    u: &mut [[f64; D]],
    params: &CgParams,
    goal: Option<&F>,
    observe: impl FnMut(CgStep),
) -> CgInfo {
    let room = || vec![[0.0; D]; operator.sites()];
    let Outside { held, forces } = outside.into();
    let vectors = Double {
        forces,
        operator: Constrained {
            inner: operator,
            held,
        },
        preconditioner,
        r: room(),
        z: room(),
        p: room(),
        image: room(),
        last: None,
    };
    iterate(vectors, u, params, goal, observe)
}

struct Double<'a, O, P, const D: usize> {
    operator: Constrained<'a, O, D>,
    forces: Option<&'a [[f64; D]]>,
    preconditioner: &'a P,
    r: Vec<[f64; D]>,
    z: Vec<[f64; D]>,
    p: Vec<[f64; D]>,
    /// `A p` of the last iteration.
    image: Vec<[f64; D]>,
    /// `α` and `rᵀz` of the last iteration.
    last: Option<(f64, f64)>,
}

impl<O: Operator<D>, P: Preconditioner<D>, const D: usize> Vectors<D> for Double<'_, O, P, D> {
    const EXACT: bool = true;

    fn unit(&self) -> f64 {
        1.0
    }

    fn residual(&mut self, u: &[[f64; D]], _: f64) -> State {
        self.operator.inner.apply(u, &mut self.r);
        let energy = dot(u, &self.r);
        let work = self.forces.map_or(0.0, |forces| dot(u, forces));
        if let Some(forces) = self.forces {
            subtract(&mut self.r, forces);
        }
        self.operator.held.clear(&mut self.r);
        negate(&mut self.r);
        State {
            energy: energy - 2.0 * work,
            work,
            norm: dot(&self.r, &self.r).sqrt(),
        }
    }

    fn precondition(&mut self) -> f64 {
        self.preconditioner.apply(&self.r, &mut self.z);
        self.operator.held.clear(&mut self.z);
        dot(&self.r, &self.z)
    }

    fn step(&mut self, u: &mut [[f64; D]], rz: f64) -> Option<(f64, f64)> {
        // z·(r − r₋) / (r₋·z₋) with r − r₋ = −α A p: what rounding makes of the preconditioner is not quite symmetric.
        let beta = match self.last {
            None => 0.0,
            Some((alpha, rz_before)) => -alpha * dot(&self.z, &self.image) / rz_before,
        };
        combine(&mut self.p, &self.z, beta);
        self.operator.apply(&self.p, &mut self.image);
        let curvature = dot(&self.p, &self.image);
        are_positive(curvature, rz).then(|| {
            // The step that minimises along p; r·p is r·z but for rounding.
            let alpha = dot(&self.r, &self.p) / curvature;
            self.last = Some((alpha, rz));
            let squared = advance(u, &mut self.r, &self.p, &self.image, alpha);
            (alpha, squared.sqrt())
        })
    }

    fn along(&self, goal: &impl Functional<D>) -> f64 {
        goal.of(&self.p)
    }

    fn work_along(&self) -> f64 {
        self.forces.map_or(0.0, |forces| dot(&self.p, forces))
    }

    fn is_forced(&self) -> bool {
        self.forces.is_some()
    }
}

/// `r −= f`.
fn subtract<const D: usize>(r: &mut [[f64; D]], f: &[[f64; D]]) {
    r.par_iter_mut()
        .with_min_len(CHUNK)
        .zip(f)
        .for_each(|(r, f)| (0..D).for_each(|c| r[c] -= f[c]));
}

fn negate<const D: usize>(r: &mut [[f64; D]]) {
    r.par_iter_mut()
        .with_min_len(CHUNK)
        .for_each(|r| *r = r.map(|v| -v));
}

/// `p = z + β p`.
fn combine<const D: usize>(p: &mut [[f64; D]], z: &[[f64; D]], beta: f64) {
    p.par_iter_mut()
        .with_min_len(CHUNK)
        .zip(z)
        .for_each(|(p, z)| {
            for c in 0..D {
                p[c] = z[c] + beta * p[c];
            }
        });
}

/// `u += α p`, `r −= α q`; returns `r·r`, summed chunk by chunk.
fn advance<const D: usize>(
    u: &mut [[f64; D]],
    r: &mut [[f64; D]],
    p: &[[f64; D]],
    q: &[[f64; D]],
    alpha: f64,
) -> f64 {
    let chunks = (
        u.par_chunks_mut(CHUNK),
        r.par_chunks_mut(CHUNK),
        p.par_chunks(CHUNK),
        q.par_chunks(CHUNK),
    );
    let parts: Vec<f64> = chunks
        .into_par_iter()
        .map(|(u, r, p, q)| {
            let mut sum = 0.0;
            for (((u, r), p), q) in u.iter_mut().zip(r).zip(p).zip(q) {
                for c in 0..D {
                    u[c] += alpha * p[c];
                    r[c] -= alpha * q[c];
                    sum += r[c] * r[c];
                }
            }
            sum
        })
        .collect();
    parts.iter().sum()
}
