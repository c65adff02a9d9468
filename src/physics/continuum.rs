//! Owns the local twin of the peridynamic body: bilinear quadrilaterals on the grid's points, 2 × 2 Gauss points, energy
//! weighted by `(ρ/ρ*)^n`, density at the nodes or at the Gauss points. Schaller et al. (2022), table 1 and eq 23.
//!
//! Values are numbered densities first (node `p`), then placements (`nodes + 2p + axis`), as in the peridynamic body.
//! Densities at Gauss points are no unknowns: each follows from its own energy, and is eliminated with its derivative.

mod step;

pub use step::Step;

use crate::discretisation::plane::Points;
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::growth::{Growth, Weight};
use crate::physics::hyperelastic::{Energy, Plane};
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Old<'a> {
    Nodes(&'a [f64]),
    /// Four an element.
    Gauss(&'a [[f64; 4]]),
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

    /// Whether no element is turned inside out: the placements' Jacobian is positive at all corners, and so inside.
    pub fn is_upright(&self, values: &[f64]) -> bool {
        (0..self.elements.len()).into_par_iter().all(|e| {
            let slots = self.slots(e);
            let at = |c: usize| [0, 1].map(|i| values[slots[4 + 2 * (c % 4) + i]]);
            (0..4).all(|c| {
                let [here, next, before] = [at(c), at(c + 1), at(c + 3)];
                let [a, b] = [next, before].map(|p| [p[0] - here[0], p[1] - here[1]]);
                a[0] * b[1] - a[1] * b[0] > 0.0
            })
        })
    }

    /// Area of a node: a quarter of each element around it.
    pub fn area(&self, node: usize) -> f64 {
        0.25 * self.around(node).len() as f64 * self.spacing * self.spacing
    }
}
