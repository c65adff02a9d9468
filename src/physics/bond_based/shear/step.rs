//! Owns the equations of one time step of bonds that resist shear: balance of mass of all cases, equilibrium of each.

use super::{Place, ShearBonds};
use crate::operator::nonlinear::{Nonlinear, Staggered, positive_share};
use crate::operator::sparse::Sparse;
use crate::physics::bond_based::Step;
use crate::physics::growth::{Balance, Growth};

/// One time step's equations.
pub type ShearStep<'a> = Step<'a, ShearBonds>;

impl ShearStep<'_> {
    /// Balance of mass at point `a`, whose energy in each case is `energy`.
    fn balance(
        &self,
        growth: &Growth,
        values: &[f64],
        a: usize,
        energy: impl Fn(usize) -> f64,
    ) -> Balance {
        let cases = self.model.cases.iter().enumerate();
        let stimulus = cases.map(|(case, weight)| weight * energy(case)).sum();
        growth.balance(values[a], self.old[a], stimulus, self.dt)
    }

    fn density_row(&self, values: &[f64], row: usize, a: usize, add: &mut impl FnMut(usize, f64)) {
        let model = self.model;
        let Some(growth) = &model.growth else {
            return;
        };
        let balance = self.balance(growth, values, a, |case| {
            model.state(values, case, a).energy
        });
        add(row, balance.by_density);
        for (case, weight) in model.cases.iter().enumerate() {
            let half = 0.5 * balance.by_energy * weight;
            for (i, bond) in model.family.of(a) {
                let p = model.pair(values, case, a, i, bond);
                let by = half * p.by_density * p.energy;
                self.put(a, by, add);
                self.put(i, by, add);
                for d in 0..2 {
                    let by = half * p.weight * p.pull[d];
                    self.put(model.value(case, i, d), by, add);
                    self.put(model.value(case, a, d), -by, add);
                }
                if model.turns {
                    let by = -half * p.weight * p.moment;
                    self.put(model.value(case, i, 2), by, add);
                    self.put(model.value(case, a, 2), by, add);
                }
            }
        }
    }

    /// Row of equilibrium of component `d`: forces along an axis, or moments.
    fn force_row(
        &self,
        values: &[f64],
        (case, a, d): (usize, usize, usize),
        add: &mut impl FnMut(usize, f64),
    ) {
        let model = self.model;
        for (i, bond) in model.family.of(a) {
            let p = model.pair(values, case, a, i, bond);
            let pull = if d == 2 { p.moment } else { p.pull[d] };
            self.put(a, p.by_density * pull, add);
            self.put(i, p.by_density * pull, add);
            let by = p.slopes(&model.micromoduli, bond.length, d);
            for (e, by) in by.into_iter().enumerate().take(model.components()) {
                let by = p.weight * by;
                self.put(model.value(case, i, e), by, add);
                let own = if e == 2 { by } else { -by };
                self.put(model.value(case, a, e), own, add);
            }
        }
    }

    fn gather(&self, values: &[f64], row: usize, add: &mut impl FnMut(usize, f64)) {
        match self.model.place(self.map.equation(row)) {
            Place::Density(a) => self.density_row(values, row, a, add),
            Place::Motion(case, a, d) => self.force_row(values, (case, a, d), add),
        }
    }
}

impl Nonlinear for ShearStep<'_> {
    fn residual(&self, q: &[f64], r: &mut [f64]) {
        let values = self.expand(q);
        let states = self.model.states(&values);
        for (row, r) in r.iter_mut().enumerate() {
            let value = self.map.equation(row);
            *r = match (self.model.place(value), &self.model.growth) {
                (Place::Motion(case, a, d), _) => states[case][a].force[d] + self.load_at(value, a),
                (Place::Density(a), Some(growth)) => {
                    let energy = |case: usize| states[case][a].energy;
                    self.balance(growth, &values, a, energy).residual
                }
                (Place::Density(_), None) => 0.0,
            };
        }
    }

    fn tangent(&self, q: &[f64], k: &mut Sparse) {
        let values = self.expand(q);
        k.fill_rows(|row, dense| {
            self.gather(&values, row, &mut |column, by| dense[column] += by);
        });
    }

    /// `max(|R_ρ| / ρ*, δ |R_x| / E, |R_θ| / E)`.
    fn error(&self, r: &[f64]) -> f64 {
        let model = self.model;
        let scale = |row: usize| match model.place(self.map.equation(row)) {
            Place::Density(_) => model.weight.reference.recip(),
            Place::Motion(_, _, 2) => model.young.recip(),
            Place::Motion(..) => model.family.stencil.horizon / model.young,
        };
        r.iter().enumerate().fold(0.0, |worst: f64, (row, r)| {
            let size = r.abs() * scale(row);
            worst.max(if size.is_nan() { f64::INFINITY } else { size })
        })
    }

    /// No density may lose more than 70 % at once.
    fn share(&self, q: &[f64], dq: &[f64]) -> f64 {
        positive_share(self.local(), q, dq)
    }
}

impl Staggered for ShearStep<'_> {
    fn local(&self) -> usize {
        self.densities()
    }

    fn local_diagonal(&self, q: &[f64], diagonal: &mut [f64]) {
        let values = self.expand(q);
        let states = self.model.states(&values);
        let cases = &self.model.cases;
        for (row, out) in diagonal.iter_mut().enumerate() {
            let a = self.map.equation(row);
            *out = self.model.growth.as_ref().map_or(0.0, |growth| {
                let b = self.balance(growth, &values, a, |case| states[case][a].energy);
                let slopes = cases.iter().zip(&states).map(|(w, s)| w * s[a].by_density);
                b.by_density + b.by_energy * slopes.sum::<f64>()
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
