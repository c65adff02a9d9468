//! Owns the use of a single-precision preconditioner by conjugate gradients in double precision.

use crate::operator::{Preconditioner, SinglePreconditioner};
use crate::par::{CHUNK, dot};
use rayon::prelude::*;
use std::sync::Mutex;

type Single = Vec<[f32; 3]>;

/// A single-precision preconditioner as one in double precision: residuals are scaled to norm 1 on the way in, so that
/// none is too small for single precision, and what comes out is scaled back.
pub struct Widened<'a, P> {
    inner: &'a P,
    /// Residual, result and what the preconditioner asks for, used by one call at a time.
    room: Mutex<[Single; 3]>,
}

impl<'a, P> Widened<'a, P> {
    pub fn new(inner: &'a P, sites: usize) -> Self {
        let zero = || vec![[0.0; 3]; sites];
        Widened {
            inner,
            room: Mutex::new([zero(), zero(), zero()]),
        }
    }
}

impl<P: SinglePreconditioner<3> + Sync> Preconditioner<3> for Widened<'_, P> {
    fn apply(&self, r: &[[f64; 3]], z: &mut [[f64; 3]]) {
        let mut room = self.room.lock().unwrap_or_else(|e| e.into_inner());
        let [narrow, result, spare] = &mut *room;
        let norm = dot(r, r).sqrt();
        if norm == 0.0 {
            z.fill([0.0; 3]);
            return;
        }
        narrow
            .par_iter_mut()
            .with_min_len(CHUNK)
            .zip(r)
            .for_each(|(n, r)| *n = r.map(|v| rounded(v / norm)));
        self.inner.apply_single(narrow, result, spare);
        z.par_iter_mut()
            .with_min_len(CHUNK)
            .zip(&*result)
            .for_each(|(z, v)| *z = v.map(|v| norm * f64::from(v)));
    }
}

/// Part of the residual's norm below which an entry is zero: its products would fall below what single precision holds in
/// full, and such take a hundred times as long.
const ROUNDING: f64 = 1e-15;

fn rounded(v: f64) -> f32 {
    match v.abs() > ROUNDING {
        true => v as f32,
        false => 0.0,
    }
}
