//! Owns bond-based peridynamics in the plane: harmonic bonds weighted by the mean density of their ends, with or
//! without growth. Schaller et al. (2022), eqs 11 to 13, 17 to 20 and A1 to A5, as corrected: the sum of eq 19 runs over
//! the bonds' energies, A1's `−1` is `−δ_ab`, and `∂ξ/∂x_b = (δ_ib − δ_ab) 1`.
//!
//! Values are numbered densities first (point `p`), then placements (`points + 2p + axis`). Only material points have
//! equations; fictitious ones follow or are held.

mod kernel;
pub mod shear;
mod step;

use crate::discretisation::plane::Points;
use crate::discretisation::plane::family::{Bond, Family, Stencil};
use crate::operator::nonlinear::{Nonlinear, Staggered, positive_share};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::growth::{Growth, Weight};
use kernel::Padded;
pub use kernel::PointState;
pub use step::{Bonds, Step};

/// Bonds, their stiffness and their density law. Unit thickness.
#[derive(Debug, Clone)]
pub struct BondBased {
    /// Families of the material points.
    pub family: Family,
    /// Micromodulus `C` of `ψ = C L (l/L − 1)² / 2`.
    pub micromodulus: f64,
    /// Young's modulus at the reference density; scales the residual of equilibrium.
    pub young: f64,
    pub weight: Weight,
    pub growth: Option<Growth>,
    /// Share of each point's cell that belongs to the body, where not all are whole.
    pub shares: Option<Vec<f64>>,
    /// Points in all, fictitious ones included.
    pub points: usize,
    padded: Padded,
}

/// What bonds are made of.
#[derive(Debug, Clone)]
pub struct Material {
    pub micromodulus: f64,
    pub young: f64,
    pub weight: Weight,
    pub growth: Option<Growth>,
}

/// `C` for the continuum's horizon integral: `9 E / (π δ³)` (equal energies at small biaxial strain, plane stress,
/// ν = 1/3).
pub fn micromodulus_continuous(young: f64, stencil: &Stencil) -> f64 {
    9.0 * young / (std::f64::consts::PI * stencil.horizon.powi(3))
}

/// `C` for the sum over the stencil: `6 E / Σ L V`.
pub fn micromodulus_discrete(young: f64, stencil: &Stencil) -> f64 {
    6.0 * young / stencil.integrate(|b| b.length)
}

/// A bond seen from one end.
struct Pair {
    /// Deformed bond vector.
    xi: [f64; 2],
    length: f64,
    /// `w V` and `∂w/∂ρ V`, the latter by the density of either end.
    weight: f64,
    by_density: f64,
    /// `C (1/L − 1/l)`: force per bond vector.
    pull: f64,
    energy: f64,
}

impl BondBased {
    /// `rows` material points come first in `points`; the others are fictitious. `shares` are those of all points.
    pub fn new(
        points: &Points,
        rows: usize,
        stencil: Stencil,
        material: Material,
        shares: Option<Vec<f64>>,
    ) -> Self {
        let micromodulus = material.micromodulus;
        BondBased {
            padded: Padded::new(points, rows, &stencil, micromodulus, shares.as_deref()),
            family: Family::new(points, rows, stencil),
            micromodulus,
            young: material.young,
            weight: material.weight,
            growth: material.growth,
            shares,
            points: points.len(),
        }
    }

    fn pair(&self, values: &[f64], a: usize, i: usize, bond: &Bond) -> Pair {
        let x = |p: usize, d: usize| values[self.points + 2 * p + d];
        let xi = [x(i, 0) - x(a, 0), x(i, 1) - x(a, 1)];
        let length = (xi[0] * xi[0] + xi[1] * xi[1]).sqrt();
        let (w, dw) = self.weight.at(0.5 * (values[a] + values[i]));
        let share = self.shares.as_ref().map_or(1.0, |s| s[i]);
        let volume = share * bond.share * self.family.stencil.spacing.powi(2);
        let strain = length / bond.length - 1.0;
        Pair {
            xi,
            length,
            weight: w * volume,
            by_density: 0.5 * dw * volume,
            pull: self.micromodulus * (1.0 / bond.length - 1.0 / length),
            energy: 0.5 * self.micromodulus * bond.length * strain * strain,
        }
    }

    /// The state of every material point.
    pub fn states(&self, values: &[f64]) -> Vec<PointState> {
        self.padded.states(values, self.family.rows(), self.weight)
    }

    /// The state of one point, bond by bond.
    pub fn state(&self, values: &[f64], a: usize) -> PointState {
        let mut state = PointState::default();
        for (i, b) in self.family.of(a) {
            let p = self.pair(values, a, i, b);
            state.energy += 0.5 * p.weight * p.energy;
            state.by_density += 0.5 * p.by_density * p.energy;
            (0..2).for_each(|d| state.force[d] += p.weight * p.pull * p.xi[d]);
        }
        state
    }

    /// Entries of `∂R/∂q` among the unknowns from `first` on, numbered from there: those of each unknown's own point and of its family.
    pub fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        Sparse::from_pattern(map.unknowns() - first, |row, list| {
            self.columns(map, row + first, first, list);
        })
    }

    fn columns(&self, map: &Reduction, row: usize, first: usize, list: &mut Vec<u32>) {
        let a = self.point_of(map.equation(row));
        let near = self.family.of(a).map(|(i, _)| i).chain([a]);
        for value in near.flat_map(|i| self.values_of(i)) {
            list.extend(
                map.unknown(value)
                    .filter(|&q| q >= first)
                    .map(|q| (q - first) as u32),
            );
        }
    }

    fn values_of(&self, p: usize) -> [usize; 3] {
        [p, self.points + 2 * p, self.points + 2 * p + 1]
    }

    fn point_of(&self, value: usize) -> usize {
        if value < self.points {
            value
        } else {
            (value - self.points) / 2
        }
    }
}

impl Bonds for BondBased {
    fn family(&self) -> &Family {
        &self.family
    }

    fn shares(&self) -> Option<&[f64]> {
        self.shares.as_deref()
    }

    fn points(&self) -> usize {
        self.points
    }
}

impl Step<'_> {
    fn equation(&self, states: &[PointState], values: &[f64], value: usize) -> f64 {
        let model = self.model;
        let PointState { energy, force, .. } = states[model.point_of(value)];
        match (value.checked_sub(model.points), &model.growth) {
            (Some(place), _) => force[place % 2] + self.load_at(value, place / 2),
            (None, Some(growth)) => {
                growth
                    .balance(values[value], self.old[value], energy, self.dt)
                    .residual
            }
            (None, None) => 0.0,
        }
    }

    /// Row of a density's equation (eqs A1 and A2).
    fn density_row(&self, values: &[f64], row: usize, a: usize, add: &mut impl FnMut(usize, f64)) {
        let Some(growth) = &self.model.growth else {
            return;
        };
        let balance = growth.balance(
            values[a],
            self.old[a],
            self.model.state(values, a).energy,
            self.dt,
        );
        add(row, balance.by_density);
        for (i, b) in self.model.family.of(a) {
            let p = self.model.pair(values, a, i, b);
            let half = 0.5 * balance.by_energy;
            let by = half * p.by_density * p.energy;
            self.put(a, by, add);
            self.put(i, by, add);
            for d in 0..2 {
                let by = half * p.weight * p.pull * p.xi[d];
                self.put(self.model.points + 2 * i + d, by, add);
                self.put(self.model.points + 2 * a + d, -by, add);
            }
        }
    }

    /// Row of equilibrium along axis `d` (eqs A4 and A5).
    fn force_row(&self, values: &[f64], a: usize, d: usize, add: &mut impl FnMut(usize, f64)) {
        for (i, b) in self.model.family.of(a) {
            let p = self.model.pair(values, a, i, b);
            let by = p.by_density * p.pull * p.xi[d];
            self.put(a, by, add);
            self.put(i, by, add);
            let along = p.weight * self.model.micromodulus / p.length.powi(3);
            for e in 0..2 {
                let both = if d == e { p.weight * p.pull } else { 0.0 };
                let by = along * p.xi[d] * p.xi[e] + both;
                self.put(self.model.points + 2 * i + e, by, add);
                self.put(self.model.points + 2 * a + e, -by, add);
            }
        }
    }

    fn gather(&self, values: &[f64], row: usize, add: &mut impl FnMut(usize, f64)) {
        let value = self.map.equation(row);
        let points = self.model.points;
        match value.checked_sub(points) {
            None => self.density_row(values, row, value, add),
            Some(place) => self.force_row(values, place / 2, place % 2, add),
        }
    }
}

impl Nonlinear for Step<'_> {
    fn residual(&self, q: &[f64], r: &mut [f64]) {
        let values = self.expand(q);
        let states = self.model.states(&values);
        for (row, r) in r.iter_mut().enumerate() {
            *r = self.equation(&states, &values, self.map.equation(row));
        }
    }

    fn tangent(&self, q: &[f64], k: &mut Sparse) {
        let values = self.expand(q);
        k.fill_rows(|row, dense| {
            self.gather(&values, row, &mut |column, by| dense[column] += by);
        });
    }

    /// `max(|R_ρ| / ρ*, δ |R_x| / E)`.
    fn error(&self, r: &[f64]) -> f64 {
        let (density, force) = r.split_at(self.local());
        let largest = |r: &[f64]| r.iter().fold(0.0, |m: f64, v| m.max(nan_is_huge(v.abs())));
        let horizon = self.model.family.stencil.horizon;
        (largest(density) / self.model.weight.reference)
            .max(horizon * largest(force) / self.model.young)
    }

    /// No density may lose more than 70 % at once.
    fn share(&self, q: &[f64], dq: &[f64]) -> f64 {
        positive_share(self.local(), q, dq)
    }
}

impl Staggered for Step<'_> {
    fn local(&self) -> usize {
        self.densities()
    }

    fn local_diagonal(&self, q: &[f64], diagonal: &mut [f64]) {
        let values = self.expand(q);
        let states = self.model.states(&values);
        for (row, out) in diagonal.iter_mut().enumerate() {
            let a = self.map.equation(row);
            *out = self.model.growth.as_ref().map_or(0.0, |growth| {
                let b = growth.balance(values[a], self.old[a], states[a].energy, self.dt);
                b.by_density + b.by_energy * states[a].by_density
            });
        }
    }

    fn stiffness(&self, q: &[f64], k: &mut Sparse) {
        let values = self.expand(q);
        let first = self.local();
        k.fill_rows(|row, dense| {
            self.gather(&values, row + first, &mut |column, by| {
                if column >= first {
                    dense[column - first] -= by;
                }
            });
        });
    }
}

fn nan_is_huge(v: f64) -> f64 {
    if v.is_nan() { f64::INFINITY } else { v }
}
