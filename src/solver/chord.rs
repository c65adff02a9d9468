//! Owns the chord method for weakly coupled equations: local unknowns one by one, the others with a Cholesky factor kept
//! from step to step and renewed only when convergence slows, both accelerated together. It stops at the residual of the
//! whole system, so what it finds is what Newton's method finds.

use crate::error::Result;
use crate::operator::nonlinear::Staggered;
use crate::operator::sparse::Sparse;
use crate::solver::anderson::Anderson;
use crate::solver::direct::cholesky_f32::SingleCholesky;
use crate::solver::direct::{DirectLlt, DirectLu};
use crate::solver::newton::NotConverged;

pub struct Chord {
    stiffness: Sparse,
    order: Vec<usize>,
    factor: Factor,
    ready: bool,
    /// Iterations since the factor was made, and the unknowns it was made at.
    age: usize,
    made_at: Vec<f64>,
    pub tolerance: f64,
    pub max_iterations: usize,
}

/// Single precision, until a matrix proves too ill-conditioned for it; without square roots' demand of definiteness, once
/// one is not positive definite (bonds under compression at a clamped corner).
enum Factor {
    Single(Box<SingleCholesky>),
    Double(Box<DirectLlt>),
    Indefinite(Box<DirectLu>),
}

/// What a solve took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chorded {
    pub iterations: usize,
    pub factorisations: usize,
    pub error: f64,
}

/// A solve that takes more iterations than this calls for a new factor ...
const PATIENCE: usize = 10;
/// ... unless the factor has served fewer iterations than this: one factor costs as much as 20 (short horizons) to 60
/// (wide ones) iterations on the femur scenes.
const WORTH: usize = 50;
/// An error this many times that before calls for a new factor at once.
const DIVERGING: f64 = 3.0;

impl Chord {
    /// `pattern` and `order` are those of the unknowns that are not local.
    pub fn new(
        pattern: Sparse,
        order: Vec<usize>,
        tolerance: f64,
        max_iterations: usize,
    ) -> Result<Self> {
        Ok(Chord {
            factor: Factor::Single(Box::new(SingleCholesky::new(&pattern, &order)?)),
            stiffness: pattern,
            order,
            ready: false,
            age: 0,
            made_at: Vec::new(),
            tolerance,
            max_iterations,
        })
    }

    /// What it takes to make the factor in use again: the unknowns it was made at, its age and its kind.
    pub fn factor_in_use(&self) -> Option<(&[f64], [f64; 2])> {
        let kind = match self.factor {
            Factor::Single(_) => 0.0,
            Factor::Double(_) => 1.0,
            Factor::Indefinite(_) => 2.0,
        };
        self.ready
            .then_some((self.made_at.as_slice(), [self.age as f64, kind]))
    }

    /// Makes the factor again that [`Chord::factor_in_use`] described, of the equations it belonged to.
    pub fn remake(
        &mut self,
        equations: &impl Staggered,
        q: &[f64],
        [age, kind]: [f64; 2],
    ) -> Result<(), NotConverged> {
        for _ in 0..kind as usize {
            let next = self.factor.next(&self.stiffness, &self.order);
            self.factor = next.ok_or(NotConverged::Singular)?;
        }
        self.renew(equations, q)?;
        self.age = age as usize;
        Ok(())
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
        let mut anderson = Anderson::default();
        let mut done = Chorded {
            iterations: 0,
            factorisations: 0,
            error: f64::INFINITY,
        };
        let mut cut = false;
        equations.local_diagonal(q, &mut diagonal);
        loop {
            equations.residual(q, &mut r);
            let before = std::mem::replace(&mut done.error, equations.error(&r));
            if done.error < self.tolerance {
                return Ok(done);
            }
            if done.iterations >= self.max_iterations || !done.error.is_finite() {
                // The factor may be what is wrong: the next attempt starts with a new one.
                self.ready = false;
                return Err(NotConverged::after(done.error, cut));
            }
            if self.is_stale(&done, before) {
                self.renew(equations, q)?;
                done.factorisations += 1;
                anderson.restart();
            }
            let (update, share) = self.update(equations, q, &mut r, &diagonal);
            cut = share < 1.0;
            let next = anderson.next(q, &update, local);
            let change: Vec<f64> = next.iter().zip(&*q).map(|(n, q)| n - q).collect();
            if equations.share(q, &change) == 1.0 {
                q.copy_from_slice(&next);
            } else {
                anderson.restart();
                q.iter_mut().zip(&update).for_each(|(q, dq)| *q += dq);
            }
            done.iterations += 1;
            self.age += 1;
        }
    }

    fn is_stale(&self, done: &Chorded, before: f64) -> bool {
        let slow = done.iterations > 0 && done.iterations.is_multiple_of(PATIENCE);
        let grows = done.error > DIVERGING * before;
        !self.ready || (self.age >= WORTH && slow) || (self.age >= PATIENCE && grows)
    }

    /// The response of the unknowns that are not local to the residual `r`, at `q`, in place; local ones stay. True if
    /// it took a new factor.
    pub fn respond(
        &mut self,
        equations: &impl Staggered,
        q: &[f64],
        r: &mut [f64],
    ) -> Result<bool, NotConverged> {
        let renewed = !self.ready;
        if renewed {
            self.renew(equations, q)?;
        }
        let (local, placements) = r.split_at_mut(equations.local());
        local.fill(0.0);
        self.factor.solve(placements);
        Ok(renewed)
    }

    fn renew(&mut self, equations: &impl Staggered, q: &[f64]) -> Result<(), NotConverged> {
        equations.stiffness(q, &mut self.stiffness);
        self.age = 0;
        self.made_at = q.to_vec();
        self.ready = false;
        while self.factor.factorize(&self.stiffness).is_err() {
            let next = self.factor.next(&self.stiffness, &self.order);
            self.factor = next.ok_or(NotConverged::Singular)?;
        }
        self.ready = true;
        Ok(())
    }

    /// Local unknowns first, then the others with the residual those leave; and the share of both that is admissible.
    fn update(
        &mut self,
        equations: &impl Staggered,
        q: &[f64],
        r: &mut [f64],
        diagonal: &[f64],
    ) -> (Vec<f64>, f64) {
        let local = diagonal.len();
        let mut share = 1.0;
        let mut dq = vec![0.0; q.len()];
        for k in 0..local {
            dq[k] = -r[k] / diagonal[k];
        }
        if local > 0 {
            share = equations.share(q, &dq);
            dq.iter_mut().for_each(|dq| *dq *= share);
            let moved: Vec<f64> = q.iter().zip(&dq).map(|(q, dq)| q + dq).collect();
            equations.residual(&moved, r);
        }
        dq[local..].copy_from_slice(&r[local..]);
        self.factor.solve(&mut dq[local..]);
        let whole = equations.share(q, &dq);
        if whole < 1.0 {
            dq.iter_mut().for_each(|dq| *dq *= whole);
        }
        (dq, share * whole)
    }
}

impl Factor {
    /// What takes a matrix that this one does not; None where there is nothing more.
    fn next(&self, pattern: &Sparse, order: &[usize]) -> Option<Factor> {
        match self {
            Factor::Single(_) => {
                let llt = DirectLlt::new(pattern, order).ok()?;
                Some(Factor::Double(Box::new(llt)))
            }
            Factor::Double(_) => {
                let lu = DirectLu::new(pattern).ok()?;
                Some(Factor::Indefinite(Box::new(lu)))
            }
            Factor::Indefinite(_) => None,
        }
    }

    fn factorize(&mut self, a: &Sparse) -> Result<()> {
        match self {
            Factor::Single(llt) => llt.factorize(a),
            Factor::Double(llt) => llt.factorize(a),
            Factor::Indefinite(lu) => lu.factorize(a),
        }
    }

    fn solve(&mut self, x: &mut [f64]) {
        match self {
            Factor::Single(llt) => llt.solve(x),
            Factor::Double(llt) => llt.solve(x),
            Factor::Indefinite(lu) => lu.solve(x),
        }
    }
}
