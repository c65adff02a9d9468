//! Owns the local twin of the peridynamic body: bilinear quadrilaterals on the grid's points, 2 × 2 Gauss points, energy
//! weighted by `(ρ/ρ*)^n`, density at the nodes or at the Gauss points. Schaller et al. (2022), table 1 and eq 23.
//!
//! Values are numbered densities first (node `p`), then placements (`nodes + 2p + axis`), as in the peridynamic body.
//! Densities at Gauss points are no unknowns: each follows from its own energy, and is eliminated with its derivative.

use crate::operator::nonlinear::{Nonlinear, Staggered};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::{Rows, Sparse};
use crate::physics::growth::{Growth, Weight};
use crate::physics::hyperelastic::{Energy, Plane};
use crate::topology::plane::Points;
use rayon::prelude::*;

/// Relative densities below this are none at all.
const VANISHED: f64 = 1e-12;

/// Equations of an element: four densities, then four placements.
const N: usize = 12;
type Row = [f64; N];

/// Elements, their energy and their density law. Unit thickness.
#[derive(Debug, Clone)]
pub struct Continuum {
    /// Corners, counter-clockwise.
    pub elements: Vec<[u32; 4]>,
    /// Elements of each node (with the node's corner), compressed.
    start: Vec<u32>,
    around: Vec<(u32, u8)>,
    pub nodes: usize,
    pub spacing: f64,
    pub young: f64,
    pub energy: Energy,
    pub weight: Weight,
    pub growth: Option<Growth>,
}

/// Densities before the step.
#[derive(Debug, Clone, PartialEq)]
pub enum Old {
    Nodes(Vec<f64>),
    /// Four a element.
    Gauss(Vec<[f64; 4]>),
}

/// One time step's equations.
pub struct Step<'a> {
    pub model: &'a Continuum,
    pub map: &'a Reduction,
    pub given: &'a [f64],
    pub old: &'a Old,
    pub dt: f64,
    /// Force on each value (placements only); empty: none.
    pub load: &'a [f64],
}

/// Position of the Gauss points on the unit square, and of the corners.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
const CORNER: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// Shape functions and their derivatives (per cell edge) at Gauss point `g`.
fn shapes(g: usize) -> ([f64; 4], [[f64; 2]; 4]) {
    let at = [GAUSS[g & 1], GAUSS[g >> 1]];
    let one = |c: [f64; 2], d: usize| if c[d] == 1.0 { at[d] } else { 1.0 - at[d] };
    let sign = |c: [f64; 2], d: usize| if c[d] == 1.0 { 1.0 } else { -1.0 };
    let n = CORNER.map(|c| one(c, 0) * one(c, 1));
    let dn = CORNER.map(|c| [sign(c, 0) * one(c, 1), one(c, 0) * sign(c, 1)]);
    (n, dn)
}

/// What a Gauss point contributes.
struct Point {
    n: [f64; 4],
    /// Gradients of the shape functions.
    b: [[f64; 2]; 4],
    density: f64,
    /// Energy without the density's weight.
    energy: f64,
    stress: Plane,
    tangent: [[Plane; 2]; 2],
    weight: f64,
    by_density: f64,
}

impl Continuum {
    /// One element per square of four neighbouring points.
    pub fn new(
        points: &Points,
        young: f64,
        energy: Energy,
        weight: Weight,
        growth: Option<Growth>,
    ) -> Self {
        let corner =
            |c: [i32; 2], d: [i32; 2]| points.at([c[0] + d[0], c[1] + d[1]]).map(|p| p as u32);
        let element = |p: usize| {
            let c = points.cell(p);
            Some([
                p as u32,
                corner(c, [1, 0])?,
                corner(c, [1, 1])?,
                corner(c, [0, 1])?,
            ])
        };
        let elements: Vec<[u32; 4]> = (0..points.len()).filter_map(element).collect();
        let mut around = vec![Vec::new(); points.len()];
        for (e, corners) in elements.iter().enumerate() {
            corners
                .iter()
                .enumerate()
                .for_each(|(c, &p)| around[p as usize].push((e as u32, c as u8)));
        }
        let mut start = vec![0];
        for list in &around {
            start.push(start[start.len() - 1] + list.len() as u32);
        }
        Continuum {
            elements,
            start,
            around: around.concat(),
            nodes: points.len(),
            spacing: points.spacing,
            young,
            energy,
            weight,
            growth,
        }
    }

    /// Elements around a node, with the node's corner in each.
    pub fn around(&self, node: usize) -> &[(u32, u8)] {
        &self.around[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// Entries of `∂R/∂q` among the unknowns from `first` on, numbered from there.
    pub fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        Sparse::from_pattern(map.unknowns() - first, |row, list| {
            for &(e, _) in self.around(self.node_of(map.equation(row + first))) {
                let columns = self
                    .slots(e as usize)
                    .into_iter()
                    .filter_map(|v| map.unknown(v));
                list.extend(columns.filter(|&q| q >= first).map(|q| (q - first) as u32));
            }
        })
    }

    fn node_of(&self, value: usize) -> usize {
        if value < self.nodes {
            value
        } else {
            (value - self.nodes) / 2
        }
    }

    /// The values of an element: densities, then placements.
    fn slots(&self, e: usize) -> [usize; N] {
        let corners = self.elements[e].map(|p| p as usize);
        std::array::from_fn(|k| match k.checked_sub(4) {
            None => corners[k],
            Some(k) => self.nodes + 2 * corners[k / 2] + k % 2,
        })
    }

    fn point(&self, values: &[f64; N], g: usize, gauss: Option<(f64, f64)>) -> Point {
        let (n, dn) = shapes(g);
        let b = dn.map(|d| d.map(|v| v / self.spacing));
        let f =
            [0, 1].map(|i| [0, 1].map(|j| (0..4).map(|a| values[4 + 2 * a + i] * b[a][j]).sum()));
        let r = self.energy.response(&f);
        let density = match gauss {
            Some((old, dt)) => self.settle(old, r.energy, dt),
            None => (0..4).map(|a| n[a] * values[a]).sum(),
        };
        let (weight, by_density) = self.weight.at(density);
        Point {
            n,
            b,
            density,
            energy: r.energy,
            stress: r.stress,
            tangent: r.tangent,
            weight,
            by_density,
        }
    }

    /// The density at a Gauss point after a step at the given (unweighted) energy. The balance falls with density where
    /// n < m, so its root is unique: Newton kept inside a shrinking bracket. No number where none is left: without
    /// energy, the root would be negative.
    fn settle(&self, old: f64, energy: f64, dt: f64) -> f64 {
        let Some(growth) = &self.growth else {
            return old;
        };
        let balance = |rho: f64| {
            let (w, dw) = self.weight.at(rho);
            let b = growth.balance(rho, old, w * energy, dt);
            (b.residual, b.by_density + b.by_energy * dw * energy)
        };
        let (mut low, mut high, mut rho) = (0.0, f64::INFINITY, old);
        for _ in 0..200 {
            let (r, slope) = balance(rho);
            if r > 0.0 {
                low = rho
            } else {
                high = rho
            }
            let newton = rho - r / slope;
            // Newton is quadratic: after a change this small the next is rounding, which must not reach the bracket.
            if (newton - rho).abs() <= 1e-10 * rho {
                return newton;
            }
            let inside = low < newton && newton < high;
            if high < VANISHED * self.weight.reference {
                break;
            }
            rho = if inside {
                newton
            } else if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * rho
            };
        }
        f64::NAN
    }

    /// Densities at the Gauss points after a step.
    pub fn gauss_densities(&self, values: &[f64], old: &[[f64; 4]], dt: f64) -> Vec<[f64; 4]> {
        let element = |e: usize| {
            let local = self.slots(e).map(|v| values[v]);
            std::array::from_fn(|g| self.point(&local, g, Some((old[e][g], dt))).density)
        };
        (0..self.elements.len())
            .into_par_iter()
            .map(element)
            .collect()
    }

    /// Area of a node: a quarter of each element around it.
    pub fn area(&self, node: usize) -> f64 {
        0.25 * self.around(node).len() as f64 * self.spacing * self.spacing
    }
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

    /// No density may lose more than 70 % at once.
    fn share(&self, q: &[f64], dq: &[f64]) -> f64 {
        let loss = |k: usize| -dq[k] / q[k];
        let worst = (0..self.local()).map(loss).fold(0.0, f64::max);
        (0.7 / worst.max(1e-300)).min(1.0)
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
