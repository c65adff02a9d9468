//! Owns the equations of one time step of the local twin: residual, tangent, and what may change at once.

use super::{Continuum, N, Old, Point, Row};
use crate::operator::nonlinear::{Nonlinear, Staggered, positive_share};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::{Rows, Sparse};
use rayon::prelude::*;

/// An update is not cut below this share of itself.
const LEAST_SHARE: f64 = 1e-6;

/// One time step's equations.
pub struct Step<'a> {
    pub model: &'a Continuum,
    pub map: &'a Reduction,
    pub given: &'a [f64],
    pub old: Old<'a>,
    pub dt: f64,
    /// Force on each value (placements only); empty: none.
    pub load: &'a [f64],
}

impl Step<'_> {
    fn expand(&self, q: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.map.values()];
        self.map.expand(q, self.given, &mut values);
        values
    }

    fn gauss(&self, e: usize, g: usize) -> Option<(f64, f64)> {
        match self.old {
            Old::Gauss(old) => Some((old[e][g], self.dt)),
            Old::Nodes(_) => None,
        }
    }

    fn old_at(&self, e: usize, n: &[f64; 4]) -> f64 {
        match self.old {
            Old::Nodes(old) => (0..4)
                .map(|a| n[a] * old[self.model.elements[e][a] as usize])
                .sum(),
            Old::Gauss(_) => 0.0,
        }
    }

    /// Residual of an element: densities' balance tested with the shape functions, and minus the internal forces.
    fn element_residual(&self, values: &[f64], e: usize) -> Row {
        let local = self.model.slots(e).map(|v| values[v]);
        let dv = 0.25 * self.model.spacing * self.model.spacing;
        let mut r = [0.0; N];
        for g in 0..4 {
            let p = self.model.point(&local, g, self.gauss(e, g));
            if let (Some(growth), Old::Nodes(_)) = (&self.model.growth, self.old) {
                let old = self.old_at(e, &p.n);
                let balance = growth.balance(p.density, old, p.weight * p.energy, self.dt);
                (0..4).for_each(|a| r[a] += dv * p.n[a] * balance.residual);
            }
            for a in 0..4 {
                for i in 0..2 {
                    let force: f64 = (0..2).map(|j| p.stress[i][j] * p.b[a][j]).sum();
                    r[4 + 2 * a + i] -= dv * p.weight * force;
                }
            }
        }
        r
    }

    fn element_tangent(&self, values: &[f64], e: usize) -> [Row; N] {
        let local = self.model.slots(e).map(|v| values[v]);
        let dv = 0.25 * self.model.spacing * self.model.spacing;
        let mut k = [[0.0; N]; N];
        for g in 0..4 {
            let p = self.model.point(&local, g, self.gauss(e, g));
            // Internal force per unit weight on each placement.
            let mut force = [0.0; 8];
            for (q, f) in force.iter_mut().enumerate() {
                *f = (0..2).map(|j| p.stress[q % 2][j] * p.b[q / 2][j]).sum();
            }
            self.stiffness_of(&p, dv, &force, self.eliminated(&p, e, g), &mut k);
            if let (Some(growth), Old::Nodes(_)) = (&self.model.growth, self.old) {
                let old = self.old_at(e, &p.n);
                let b = growth.balance(p.density, old, p.weight * p.energy, self.dt);
                let by = b.by_density + b.by_energy * p.by_density * p.energy;
                let by_place = b.by_energy * p.weight;
                for (row, n) in k.iter_mut().zip(p.n) {
                    (0..4).for_each(|c| row[c] += dv * n * by * p.n[c]);
                    (0..8).for_each(|q| row[4 + q] += dv * n * by_place * force[q]);
                }
                for (row, force) in k[4..].iter_mut().zip(force) {
                    (0..4).for_each(|a| row[a] -= dv * p.by_density * force * p.n[a]);
                }
            }
        }
        k
    }

    /// `∂w/∂W` of a Gauss point whose density has been eliminated.
    fn eliminated(&self, p: &Point, e: usize, g: usize) -> f64 {
        let (Some(growth), Some((old, dt))) = (&self.model.growth, self.gauss(e, g)) else {
            return 0.0;
        };
        let b = growth.balance(p.density, old, p.weight * p.energy, dt);
        let slope = b.by_density + b.by_energy * p.by_density * p.energy;
        -p.by_density * b.by_energy * p.weight / slope
    }

    fn stiffness_of(&self, p: &Point, dv: f64, force: &[f64; 8], by_energy: f64, k: &mut [Row; N]) {
        for q in 0..8 {
            let (a, i) = (q / 2, q % 2);
            for s in 0..8 {
                let (c, m) = (s / 2, s % 2);
                let mut along = 0.0;
                for j in 0..2 {
                    for l in 0..2 {
                        along += p.b[a][j] * p.tangent[i][j][m][l] * p.b[c][l];
                    }
                }
                k[4 + q][4 + s] -= dv * (p.weight * along + by_energy * force[q] * force[s]);
            }
        }
    }

    /// Rows of the element that belong to value `value` of `node`.
    fn slot_in(&self, value: usize, corner: u8) -> usize {
        match value.checked_sub(self.model.nodes) {
            None => corner as usize,
            Some(place) => 4 + 2 * corner as usize + place % 2,
        }
    }

    /// Tangent among the unknowns from `first` on, times `sign`.
    fn fill(&self, q: &[f64], k: &mut Sparse, first: usize, sign: f64) {
        let values = self.expand(q);
        let elements: Vec<[Row; N]> = (0..self.model.elements.len())
            .into_par_iter()
            .map(|e| self.element_tangent(&values, e))
            .collect();
        k.fill(|rows: &mut Rows| {
            for row in rows.range() {
                let value = self.map.equation(row + first);
                let node = self.model.node_of(value);
                let scale = sign * self.scale(value);
                for &(e, corner) in self.model.around(node) {
                    let entries = &elements[e as usize][self.slot_in(value, corner)];
                    for (slot, by) in self.model.slots(e as usize).into_iter().zip(entries) {
                        if let Some(column) = self.map.unknown(slot).filter(|&c| c >= first) {
                            rows.add(row, column - first, scale * by);
                        }
                    }
                }
            }
        });
    }

    /// Balances of density are per unit of area; forces are not scaled.
    fn scale(&self, value: usize) -> f64 {
        if value < self.model.nodes {
            1.0 / self.model.area(value)
        } else {
            1.0
        }
    }
}

impl Nonlinear for Step<'_> {
    fn residual(&self, q: &[f64], r: &mut [f64]) {
        let values = self.expand(q);
        let elements: Vec<Row> = (0..self.model.elements.len())
            .into_par_iter()
            .map(|e| self.element_residual(&values, e))
            .collect();
        for (row, r) in r.iter_mut().enumerate() {
            let value = self.map.equation(row);
            let around = self.model.around(self.model.node_of(value));
            let inner: f64 = around
                .iter()
                .map(|&(e, corner)| elements[e as usize][self.slot_in(value, corner)])
                .sum();
            *r = self.scale(value) * inner + self.load.get(value).copied().unwrap_or(0.0);
        }
    }

    fn tangent(&self, q: &[f64], k: &mut Sparse) {
        self.fill(q, k, 0, 1.0);
    }

    /// `max(|R_ρ|/ρ*, |R_x|/(E Δ))`.
    fn error(&self, r: &[f64]) -> f64 {
        let (density, force) = r.split_at(self.local());
        let largest = |r: &[f64]| {
            r.iter().fold(0.0, |m: f64, v| {
                if v.is_nan() {
                    f64::INFINITY
                } else {
                    m.max(v.abs())
                }
            })
        };
        (largest(density) / self.model.weight.reference)
            .max(largest(force) / (self.model.young * self.model.spacing))
    }

    /// No density may lose more than 70 % at once, and no element turn inside out: beyond that St. Venant-Kirchhoff has
    /// further equilibria, which an update that shoots too far finds.
    fn share(&self, q: &[f64], dq: &[f64]) -> f64 {
        let mut share = positive_share(self.local(), q, dq);
        let upright = |share: f64| {
            let moved: Vec<f64> = q.iter().zip(dq).map(|(q, d)| q + share * d).collect();
            self.model.is_upright(&self.expand(&moved))
        };
        if !upright(share) && upright(0.0) {
            share *= 0.5;
            while !upright(share) && share > LEAST_SHARE {
                share *= 0.5;
            }
        }
        share
    }
}

impl Staggered for Step<'_> {
    fn local(&self) -> usize {
        self.map.unknowns_before(self.model.nodes)
    }

    /// Of the lumped balance: the sum of each row among densities, which the consistent one tends to.
    fn local_diagonal(&self, q: &[f64], diagonal: &mut [f64]) {
        if diagonal.is_empty() {
            return;
        }
        let values = self.expand(q);
        let rows: Vec<[f64; 4]> = (0..self.model.elements.len())
            .into_par_iter()
            .map(|e| {
                let k = self.element_tangent(&values, e);
                std::array::from_fn(|a| k[a][..4].iter().sum())
            })
            .collect();
        for (row, out) in diagonal.iter_mut().enumerate() {
            let node = self.map.equation(row);
            let around = self.model.around(node);
            let sum: f64 = around
                .iter()
                .map(|&(e, c)| rows[e as usize][c as usize])
                .sum();
            *out = sum * self.scale(node);
        }
    }

    fn stiffness(&self, q: &[f64], k: &mut Sparse) {
        self.fill(q, k, self.local(), -1.0);
    }
}
