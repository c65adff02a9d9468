//! Owns what the equations of a time step have in common, whatever their bonds resist.

use super::BondBased;
use crate::discretisation::plane::family::Family;
use crate::operator::reduction::Reduction;

/// What a step asks of any model of bonds.
pub trait Bonds {
    /// Families of the material points.
    fn family(&self) -> &Family;
    /// Share of each point's cell that belongs to the body, where not all are whole.
    fn shares(&self) -> Option<&[f64]>;
    /// Points in all, fictitious ones included.
    fn points(&self) -> usize;
}

/// One time step's equations: unknowns through `map`, held values in `given` (`x = T q + g`).
pub struct Step<'a, M = BondBased> {
    pub model: &'a M,
    pub map: &'a Reduction,
    pub given: &'a [f64],
    /// Densities of the material points before the step.
    pub old: &'a [f64],
    pub dt: f64,
    /// Force on each value (placements only); empty: none.
    pub load: &'a [f64],
}

impl<M: Bonds> Step<'_, M> {
    pub(super) fn expand(&self, q: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.map.values()];
        self.map.expand(q, self.given, &mut values);
        values
    }

    /// Unknowns that are densities; they come first.
    pub(super) fn densities(&self) -> usize {
        self.map.unknowns_before(self.model.points())
    }

    /// Force density of the load on a value of point `a`.
    pub(super) fn load_at(&self, value: usize, a: usize) -> f64 {
        let share = self.model.shares().map_or(1.0, |s| s[a]);
        let cell = share * self.model.family().stencil.spacing.powi(2);
        self.load.get(value).map_or(0.0, |f| f / cell)
    }

    /// Adds `by` to the column of `value`, if it has one.
    pub(super) fn put(&self, value: usize, by: f64, add: &mut impl FnMut(usize, f64)) {
        if let Some(column) = self.map.unknown(value) {
            add(column, by);
        }
    }
}
