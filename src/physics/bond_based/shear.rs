//! Owns peridynamic bonds that resist stretch and shear under growth, in one or several load cases.
//!
//! A bond's energy is `ψ = L (C_n s² + C_t γ²)/2`, with the stretch `s = l/L − 1` of Schaller et al. (2022, eq 13) and the shear `γ` of
//! Diana (2023, eq 2): the bond's rotation less the mean rotation of its ends, here of finite size. Points turn, which gives each an
//! equation of moments. In plane stress `C_n` and `C_t` are those of any Poisson's ratio up to 1/3, where `C_t` is 0.
//!
//! Load cases share densities. Each has placements of its own, and the stimulus of growth is the weighted mean of their energies: the
//! daily stimulus of Carter, Fyhrie and Whalen (J. Biomech. 20 (1987) 785-794, eq 5) and Beaupré, Orr and Carter (1990), with the
//! cycles of each case as its weight and 2 as exponent of the stress (they take 4 in examples; only 2 is a mean of energies).
//!
//! Values: densities (point `p`), then for each case its placements (`2p + axis`) and, where points turn, rotations (`p`).

use crate::discretisation::plane::family::{Bond, Family, Stencil};
use crate::operator::nonlinear::{Nonlinear, Staggered};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::growth::{Balance, Growth, Weight};
use rayon::prelude::*;

/// `C_n` and `C_t`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Micromoduli {
    pub axial: f64,
    pub shear: f64,
}

impl Micromoduli {
    /// `8 (λ + μ)/Σ L V` and `8 (μ − λ)/Σ L V`, plane stress: the stencil's energy of small biaxial strain, and of small pure shear in the
    /// mean over its direction.
    pub fn discrete(young: f64, poisson: f64, stencil: &Stencil) -> Self {
        Self::over(young, poisson, 8.0 / stencil.integrate(|b| b.length))
    }

    /// `12 (λ + μ)/(π δ³)` and `12 (μ − λ)/(π δ³)`: the same of the integral over the horizon.
    pub fn continuous(young: f64, poisson: f64, stencil: &Stencil) -> Self {
        Self::over(
            young,
            poisson,
            12.0 / (std::f64::consts::PI * stencil.horizon.powi(3)),
        )
    }

    fn over(young: f64, poisson: f64, scale: f64) -> Self {
        let lambda = young * poisson / ((1.0 + poisson) * (1.0 - poisson));
        let mu = 0.5 * young / (1.0 + poisson);
        Micromoduli {
            axial: scale * (lambda + mu),
            shear: scale * (mu - lambda),
        }
    }
}

/// Bonds, their density law and their load cases. Unit thickness.
#[derive(Debug, Clone)]
pub struct ShearBonds {
    /// Families of the material points.
    pub family: Family,
    pub micromoduli: Micromoduli,
    /// Young's modulus at the reference density; scales the residual of equilibrium.
    pub young: f64,
    pub weight: Weight,
    pub growth: Option<Growth>,
    /// Share of each point's cell that belongs to the body, where not all are whole.
    pub shares: Option<Vec<f64>>,
    /// Points in all, fictitious ones included.
    pub points: usize,
    /// Weight of each load case; their sum is 1.
    pub cases: Vec<f64>,
    /// Whether points turn.
    pub turns: bool,
}

/// One time step's equations, as [`super::Step`].
pub struct ShearStep<'a> {
    pub model: &'a ShearBonds,
    pub map: &'a Reduction,
    pub given: &'a [f64],
    pub old: &'a [f64],
    pub dt: f64,
    /// Force on each value; empty: none.
    pub load: &'a [f64],
}

/// What the bonds of a point sum to in one case: its energy density, that by its own density, and its force and moment densities.
#[derive(Debug, Clone, Copy, Default)]
struct State {
    energy: f64,
    by_density: f64,
    force: [f64; 3],
}

/// A bond seen from one end, its other end's values after the own ones: x, y, rotation.
struct Pair {
    /// `w V` and `∂w/∂ρ V`, the latter by the density of either end.
    weight: f64,
    by_density: f64,
    energy: f64,
    /// `∂ψ/∂ξ`, and `−∂ψ/∂θ` of either end.
    pull: [f64; 2],
    moment: f64,
    /// `t/l`: the change of the bond's angle with its vector.
    turn: [f64; 2],
    /// Unit vector along the deformed bond, its length, `s` and `γ`.
    along: [f64; 2],
    length: f64,
    stretch: f64,
    shear: f64,
}

/// What a value is: of which point and case, and its component (0, 1: placement; 2: rotation).
#[derive(Clone, Copy)]
enum Place {
    Density(usize),
    Motion(usize, usize, usize),
}

impl ShearBonds {
    /// Values of a point in one case.
    fn components(&self) -> usize {
        if self.turns { 3 } else { 2 }
    }

    fn value(&self, case: usize, p: usize, d: usize) -> usize {
        let first = self.points * (1 + case * self.components());
        first
            + if d == 2 {
                2 * self.points + p
            } else {
                2 * p + d
            }
    }

    fn place(&self, value: usize) -> Place {
        let Some(rest) = value.checked_sub(self.points) else {
            return Place::Density(value);
        };
        let stride = self.points * self.components();
        let (case, rest) = (rest / stride, rest % stride);
        match rest.checked_sub(2 * self.points) {
            None => Place::Motion(case, rest / 2, rest % 2),
            Some(p) => Place::Motion(case, p, 2),
        }
    }

    fn pair(&self, values: &[f64], case: usize, a: usize, i: usize, bond: &Bond) -> Pair {
        let xi = [0, 1].map(|d| values[self.value(case, i, d)] - values[self.value(case, a, d)]);
        let length = (xi[0] * xi[0] + xi[1] * xi[1]).sqrt();
        let (w, dw) = self.weight.at(0.5 * (values[a] + values[i]));
        let share = self.shares.as_ref().map_or(1.0, |s| s[i]);
        let volume = share * bond.share * self.family.stencil.spacing.powi(2);
        let stretch = length / bond.length - 1.0;
        let shear = match self.turns {
            false => 0.0,
            true => {
                let cross = bond.xi[0] * xi[1] - bond.xi[1] * xi[0];
                let dot = bond.xi[0] * xi[0] + bond.xi[1] * xi[1];
                let mean = values[self.value(case, a, 2)] + values[self.value(case, i, 2)];
                cross.atan2(dot) - 0.5 * mean
            }
        };
        let Micromoduli {
            axial,
            shear: lateral,
        } = self.micromoduli;
        let along = xi.map(|x| x / length);
        let turn = [-along[1] / length, along[0] / length];
        let twist = lateral * bond.length * shear;
        Pair {
            weight: w * volume,
            by_density: 0.5 * dw * volume,
            energy: 0.5 * bond.length * (axial * stretch * stretch + lateral * shear * shear),
            pull: [0, 1].map(|d| axial * stretch * along[d] + twist * turn[d]),
            moment: 0.5 * twist,
            turn,
            along,
            length,
            stretch,
            shear,
        }
    }

    fn state(&self, values: &[f64], case: usize, a: usize) -> State {
        let mut state = State::default();
        for (i, bond) in self.family.of(a) {
            let p = self.pair(values, case, a, i, bond);
            state.energy += 0.5 * p.weight * p.energy;
            state.by_density += 0.5 * p.by_density * p.energy;
            state.force[0] += p.weight * p.pull[0];
            state.force[1] += p.weight * p.pull[1];
            state.force[2] += p.weight * p.moment;
        }
        state
    }

    /// States of all material points, case by case.
    fn states(&self, values: &[f64]) -> Vec<Vec<State>> {
        let of = |case| {
            let points = (0..self.family.rows()).into_par_iter().with_min_len(64);
            points.map(|a| self.state(values, case, a)).collect()
        };
        (0..self.cases.len()).map(of).collect()
    }

    /// Entries of `∂R/∂q` among the unknowns from `first` on, numbered from there: those of each unknown's own point and of its family.
    pub fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        Sparse::from_pattern(map.unknowns() - first, |row, list| {
            let (a, cases) = match self.place(map.equation(row + first)) {
                Place::Density(a) => (a, 0..self.cases.len()),
                Place::Motion(case, a, _) => (a, case..case + 1),
            };
            for i in self.family.of(a).map(|(i, _)| i).chain([a]) {
                let moved = cases
                    .clone()
                    .flat_map(|case| (0..self.components()).map(move |d| self.value(case, i, d)));
                let columns = moved.chain([i]).filter_map(|v| map.unknown(v));
                list.extend(columns.filter(|&q| q >= first).map(|q| (q - first) as u32));
            }
        })
    }
}

impl ShearStep<'_> {
    fn expand(&self, q: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.map.values()];
        self.map.expand(q, self.given, &mut values);
        values
    }

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

    fn load_at(&self, value: usize, a: usize) -> f64 {
        let share = self.model.shares.as_ref().map_or(1.0, |s| s[a]);
        let cell = share * self.model.family.stencil.spacing.powi(2);
        self.load.get(value).map_or(0.0, |f| f / cell)
    }

    fn put(&self, value: usize, by: f64, add: &mut impl FnMut(usize, f64)) {
        if let Some(column) = self.map.unknown(value) {
            add(column, by);
        }
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

impl Pair {
    /// Derivatives of component `d` of `(∂ψ/∂ξ, −∂ψ/∂θ)` by ξ and by the rotation of either end.
    fn slopes(&self, c: &Micromoduli, rest: f64, d: usize) -> [f64; 3] {
        let lateral = c.shear * rest;
        if d == 2 {
            return [
                0.5 * lateral * self.turn[0],
                0.5 * lateral * self.turn[1],
                -0.25 * lateral,
            ];
        }
        let (u, t) = (self.along, self.turn);
        let across = c.axial * self.stretch / self.length;
        let by = |e: usize| {
            let unit = f64::from(d == e);
            let bent = (t[d] * u[e] + u[d] * t[e]) / self.length;
            c.axial * u[d] * u[e] / rest
                + across * (unit - u[d] * u[e])
                + lateral * (t[d] * t[e] - self.shear * bent)
        };
        [by(0), by(1), -0.5 * lateral * t[d]]
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
        let worst = (0..self.local()).map(|k| -dq[k] / q[k]).fold(0.0, f64::max);
        (0.7 / worst.max(1e-300)).min(1.0)
    }
}

impl Staggered for ShearStep<'_> {
    fn local(&self) -> usize {
        self.map.unknowns_before(self.model.points)
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
