//! Owns the stress of a lattice as a functional of its displacements, which a solve can have as its goal instead of the energy.

use crate::operator::Functional;
use crate::par::sum_chunks;
use crate::physics::lattice::Virial;

/// The stress of a lattice times its volume, in N mm: a functional of the displacements.
pub struct Stress<'a, M> {
    pub model: &'a M,
    /// Which sites count; all where there is none. Computed once: every iteration needs the stress.
    pub counts: Option<&'a [bool]>,
}

impl<M: Virial> Stress<'_, M> {
    fn sum<S: Copy + Into<f64> + Sync>(&self, u: &[[S; 3]]) -> f64 {
        let counts = |s: usize| self.counts.is_none_or(|counts| counts[s]);
        sum_chunks(u.len(), |sites| self.model.virial(u, sites, counts))
    }
}

impl<M: Virial> Functional<3> for Stress<'_, M> {
    fn of(&self, u: &[[f64; 3]]) -> f64 {
        self.sum(u)
    }

    fn of_single(&self, u: &[[f32; 3]]) -> f64 {
        self.sum(u)
    }
}
