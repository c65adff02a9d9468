//! Owns peridynamic bonds that resist stretch and shear under growth, in one or several load cases.
//!
//! A bond's energy is `ψ = L (C_n s² + C_t γ²)/2`, with the stretch `s = l/L − 1` of Schaller et al. (2022, eq 13) and the shear `γ` of
//! Diana (2023, eq 2): the bond's rotation less the mean rotation of its ends, here of finite size. Points turn, which gives each an
//! equation of moments. In plane stress `C_n` and `C_t` are those of any Poisson's ratio up to 1/3, where `C_t` is 0.
//!
//! Load cases share densities. Each has placements of its own, and the stimulus of growth is the weighted mean of their energies: the
//! daily stimulus of Carter, Fyhrie and Whalen (J. Biomech. 20 (1987) 785-794) and Beaupré, Orr and Carter (1990), with the
//! cycles of each case as its weight and 2 as exponent of the stress (they take 4 in examples; only 2 is a mean of energies).
//!
//! Values: densities (point `p`), then for each case its placements (`2p + axis`) and, where points turn, rotations (`p`).

mod step;

pub use step::ShearStep;

use super::Bonds;
use crate::discretisation::plane::family::{Bond, Family, Stencil};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::growth::{Growth, Weight};
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

impl Bonds for ShearBonds {
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
