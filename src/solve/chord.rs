//! Owns the chord method for weakly coupled equations: local unknowns one by one, the others with a Cholesky factor kept
//! from step to step and renewed only when convergence slows. It stops at the residual of the whole system, so what it
//! finds is what Newton's method finds.

use crate::error::Result;
use crate::operator::nonlinear::Staggered;
use crate::operator::sparse::Sparse;
use crate::solve::direct::DirectLlt;
use crate::solve::newton::NotConverged;

pub struct Chord {
    stiffness: Sparse,
    llt: DirectLlt,
    ready: bool,
    pub tolerance: f64,
    pub max_iterations: usize,
}

/// What a solve took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chorded {
    pub iterations: usize,
    pub factorisations: usize,
    pub error: f64,
}

/// An iteration that leaves more than this share of the error calls for a new factor; measured best between 0.2 and 0.4
/// on the femur scenes.
const SLOW: f64 = 0.3;

impl Chord {
    /// `pattern` and `order` are those of the unknowns that are not local.
    pub fn new(
        pattern: Sparse,
        order: &[usize],
        tolerance: f64,
        max_iterations: usize,
    ) -> Result<Self> {
        Ok(Chord {
            llt: DirectLlt::new(&pattern, order)?,
            stiffness: pattern,
            ready: false,
            tolerance,
            max_iterations,
        })
    }

    /// Solves from the guess `q`, in place.
    pub fn solve(
        &mut self,
        equations: &impl Staggered,
        q: &mut [f64],
    ) -> Result<Chorded, NotConverged> {
        let local = equations.local();
        let mut r = vec![0.0; q.len()];
        let mut diagonal = vec![0.0; local];
        let mut done = Chorded {
            iterations: 0,
            factorisations: 0,
            error: f64::INFINITY,
        };
        equations.local_diagonal(q, &mut diagonal);
        let mut fresh = false;
        loop {
            equations.residual(q, &mut r);
            let before = std::mem::replace(&mut done.error, equations.error(&r));
            if done.error < self.tolerance {
                return Ok(done);
            }
            if done.iterations >= self.max_iterations || !done.error.is_finite() {
                // The factor may be what is wrong: the next attempt starts with a new one.
                self.ready = false;
                return Err(NotConverged::Diverged { error: done.error });
            }
            if !self.ready || (done.error > SLOW * before && !fresh) {
                self.renew(equations, q)?;
                done.factorisations += 1;
                fresh = true;
            } else {
                fresh = false;
            }
            self.update(equations, q, &mut r, &diagonal);
            done.iterations += 1;
        }
    }

    /// The response of the unknowns that are not local to the residual `r`, at `q`, in place; local ones stay.
    pub fn respond(
        &mut self,
        equations: &impl Staggered,
        q: &[f64],
        r: &mut [f64],
    ) -> Result<(), NotConverged> {
        if !self.ready {
            self.renew(equations, q)?;
        }
        let (local, placements) = r.split_at_mut(equations.local());
        local.fill(0.0);
        self.llt.solve(placements);
        Ok(())
    }

    fn renew(&mut self, equations: &impl Staggered, q: &[f64]) -> Result<(), NotConverged> {
        equations.stiffness(q, &mut self.stiffness);
        let factor = self.llt.factorize(&self.stiffness);
        self.ready = factor.is_ok();
        factor.map_err(|_| NotConverged::Singular)
    }

    /// Local unknowns first, then the others with the residual those leave.
    fn update(
        &mut self,
        equations: &impl Staggered,
        q: &mut [f64],
        r: &mut [f64],
        diagonal: &[f64],
    ) {
        let local = diagonal.len();
        let mut dq = vec![0.0; q.len()];
        for k in 0..local {
            dq[k] = -r[k] / diagonal[k];
        }
        if local > 0 {
            let share = equations.share(q, &dq);
            q.iter_mut().zip(&dq).for_each(|(q, dq)| *q += share * dq);
            equations.residual(q, r);
        }
        let (_, placements) = r.split_at_mut(local);
        self.llt.solve(placements);
        q[local..]
            .iter_mut()
            .zip(placements)
            .for_each(|(q, dq)| *q += *dq);
    }
}
