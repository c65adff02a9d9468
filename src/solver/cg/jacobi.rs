//! Owns the diagonal preconditioner.

use crate::operator::{Operator, Preconditioner};
use rayon::prelude::*;

/// `z = D⁻¹ r`. Unknowns without stiffness (a zero diagonal) stay where they are.
pub struct Jacobi<const D: usize> {
    inverse: Vec<[f64; D]>,
}

impl<const D: usize> Jacobi<D> {
    pub fn new(operator: &impl Operator<D>) -> Self {
        let mut inverse = vec![[0.0; D]; operator.sites()];
        operator.diagonal(&mut inverse);
        for v in inverse.as_flattened_mut() {
            *v = if *v > 0.0 { v.recip() } else { 0.0 };
        }
        Jacobi { inverse }
    }
}

impl<const D: usize> Preconditioner<D> for Jacobi<D> {
    fn apply(&self, r: &[[f64; D]], z: &mut [[f64; D]]) {
        z.par_iter_mut()
            .with_min_len(1024)
            .zip(r)
            .zip(&self.inverse)
            .for_each(|((z, r), inverse)| {
                for c in 0..D {
                    z[c] = r[c] * inverse[c];
                }
            });
    }
}
