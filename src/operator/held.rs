//! Owns prescribed unknowns: rows of an operator that are held at their value.

use crate::operator::Operator;
use rayon::prelude::*;

/// Per site, bit `c` set where component `c` is held.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Held(pub Vec<u8>);

impl Held {
    pub fn none(sites: usize) -> Self {
        Held(vec![0; sites])
    }

    pub fn hold(&mut self, site: usize, component: usize) {
        self.0[site] |= 1 << component;
    }

    pub fn is_held(&self, site: usize, component: usize) -> bool {
        self.0[site] & (1 << component) != 0
    }

    /// Unknowns left free.
    pub fn free<const D: usize>(&self) -> usize {
        self.0.len() * D
            - self
                .0
                .iter()
                .map(|b| b.count_ones() as usize)
                .sum::<usize>()
    }

    /// Zeroes the held components.
    pub fn clear<const D: usize>(&self, v: &mut [[f64; D]]) {
        v.par_iter_mut()
            .with_min_len(1024)
            .zip(&self.0)
            .for_each(|(v, &bits)| {
                if bits != 0 {
                    for (c, v) in v.iter_mut().enumerate() {
                        if bits & (1 << c) != 0 {
                            *v = 0.0;
                        }
                    }
                }
            });
    }
}

/// What acts on a body from outside: prescribed unknowns, and forces on the others.
#[derive(Debug, Clone, Copy)]
pub struct Outside<'a, const D: usize> {
    /// The unknowns that keep their values.
    pub held: &'a Held,
    /// Force on each unknown; what stands in held components goes into the support. None: no forces.
    pub forces: Option<&'a [[f64; D]]>,
}

impl<'a, const D: usize> From<&'a Held> for Outside<'a, D> {
    fn from(held: &'a Held) -> Self {
        Outside { held, forces: None }
    }
}

/// An operator restricted to the free unknowns: held rows of the result are zero. Symmetric as long as the held
/// components of what it is applied to are zero, which search directions keep.
pub struct Constrained<'a, O, const D: usize> {
    pub inner: &'a O,
    pub held: &'a Held,
}

impl<O: Operator<D>, const D: usize> Operator<D> for Constrained<'_, O, D> {
    fn sites(&self) -> usize {
        self.inner.sites()
    }

    fn apply(&self, x: &[[f64; D]], y: &mut [[f64; D]]) {
        self.inner.apply(x, y);
        self.held.clear(y);
    }

    /// The inner diagonal, 1 on held rows.
    fn diagonal(&self, d: &mut [[f64; D]]) {
        self.inner.diagonal(d);
        for (d, &bits) in d.iter_mut().zip(&self.held.0) {
            for (c, d) in d.iter_mut().enumerate() {
                if bits & (1 << c) != 0 {
                    *d = 1.0;
                }
            }
        }
    }
}
