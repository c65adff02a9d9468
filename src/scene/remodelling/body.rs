//! Owns the set-up that all displacement models of a scene share: which values are unknown, which follow, which are
//! given at a time, and the guess a step starts from.

mod given;

use crate::discretisation::plane::Points;
use crate::discretisation::plane::layers::{Edge, Fictitious, add_layers};
use crate::error::{Error, Result};
use crate::operator::reduction::{Reduction, Value};
use crate::scene::conditions::{Hold, Lateral, LayerDensity, Layers};

/// Points with their conditions. Values are densities first (point `p`), then placements (`points + 2p + axis`); where points turn,
/// their rotations follow, and where there are several load cases, the placements and rotations of each.
pub struct Body {
    /// Material points, then fictitious ones.
    pub points: Points,
    pub material: usize,
    pub map: Reduction,
    fictitious: Vec<Fictitious>,
    layers: Option<Layers>,
    /// Held placements: value, undeformed coordinate, index of the hold.
    held: Vec<(usize, f64, usize)>,
    /// Material points on a loaded edge itself: they move with it.
    on_edge: Vec<(usize, Edge)>,
    /// Centre and size of the material along each axis.
    extents: [(f64, f64); 2],
    holds: Vec<Hold>,
    motion: Motion,
    /// Initial density of every point.
    density: Vec<f64>,
}

/// Values of a body other than its densities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Motion {
    pub cases: usize,
    /// Whether points have rotations.
    pub turns: bool,
}

impl Motion {
    pub const PLAIN: Motion = Motion {
        cases: 1,
        turns: false,
    };

    /// Values of one case.
    fn stride(self, points: usize) -> usize {
        points * if self.turns { 3 } else { 2 }
    }
}

/// What a body is made from.
pub struct Conditions<'a> {
    pub layers: Option<&'a Layers>,
    /// Rows of fictitious points where the scene does not say.
    pub reach: usize,
    pub holds: &'a [Hold],
    /// Of the material points.
    pub density: Vec<f64>,
    pub reference_density: f64,
    /// Whether densities are unknowns.
    pub grows: bool,
    pub motion: Motion,
}

impl Body {
    pub fn new(material: Points, conditions: Conditions) -> Result<Self> {
        let count = material.len();
        let (points, fictitious) = match conditions.layers {
            Some(layers) => {
                check_layers(layers)?;
                let depth = layers.depth.unwrap_or(conditions.reach);
                add_layers(&material, &layers.edges, depth)?
            }
            None => (material.clone(), Vec::new()),
        };
        let mut density = conditions.density;
        for f in &fictitious {
            let fixed = conditions.layers.map(|l| l.density) == Some(LayerDensity::Fixed);
            density.push(if fixed {
                conditions.reference_density
            } else {
                density[f.mirrored]
            });
        }
        let mut body = Body {
            material: count,
            map: Reduction::new(&[]),
            fictitious,
            layers: conditions.layers.cloned(),
            held: Vec::new(),
            on_edge: Vec::new(),
            extents: [(0.0, 0.0); 2],
            holds: conditions.holds.to_vec(),
            motion: conditions.motion,
            density,
            points,
        };
        body.held = body.find_held(&material)?;
        body.on_edge = body.edge_rows(material.on_edges);
        body.extents = [body.extent(0), body.extent(1)];
        body.map = Reduction::new(&body.roles(conditions.grows));
        body.require_support()?;
        Ok(body)
    }

    /// Regions are of the material: fictitious points, which come after it, are no part of its edges.
    fn find_held(&self, material: &Points) -> Result<Vec<(usize, f64, usize)>> {
        let mut held = Vec::new();
        for (k, hold) in self.holds.iter().enumerate() {
            let key = format!("hold[{k}].region");
            hold.value.check(&format!("hold[{k}].value"))?;
            let axis = axis_of(&hold.component, &format!("hold[{k}].component"))?;
            for p in hold.region.select(material, material.len(), &key)? {
                for case in self.cases() {
                    let value = self.placement_in(case, p, axis);
                    held.push((value, self.points.position(p)[axis], k));
                }
            }
        }
        Ok(held)
    }

    fn edge_rows(&self, on_edges: bool) -> Vec<(usize, Edge)> {
        let Some(layers) = self.layers.as_ref().filter(|_| on_edges) else {
            return Vec::new();
        };
        let mut rows = Vec::new();
        for &edge in &layers.edges {
            let (axis, sign) = edge.normal();
            let outermost = (0..self.material)
                .map(|p| sign * self.points.cell(p)[axis])
                .max();
            let on = |p: &usize| Some(sign * self.points.cell(*p)[axis]) == outermost;
            rows.extend((0..self.material).filter(on).map(|p| (p, edge)));
        }
        rows
    }

    fn roles(&self, grows: bool) -> Vec<Value> {
        let density = if grows { Value::Free } else { Value::Held };
        let mut roles = vec![density; self.material];
        roles.resize(self.points.len(), Value::Held);
        for case in self.cases() {
            let first = self.placement_in(case, 0, 0);
            roles.resize(first + 2 * self.material, Value::Free);
            roles.resize(first + 2 * self.points.len(), Value::Held);
            if self.motion.turns {
                roles.resize(roles.len() + self.material, Value::Free);
                roles.resize(first + 3 * self.points.len(), Value::Held);
            }
        }
        self.held
            .iter()
            .for_each(|&(value, _, _)| roles[value] = Value::Held);
        let Some(layers) = &self.layers else {
            return roles;
        };
        for &(p, edge) in &self.on_edge {
            for case in self.cases() {
                roles[self.placement_in(case, p, edge.normal().0)] = Value::Held;
            }
        }
        for (k, f) in self.fictitious.iter().enumerate() {
            let p = self.material + k;
            let (axis, _) = f.edge.normal();
            if grows && layers.density == LayerDensity::Mirrored {
                roles[p] = Value::Follows(f.mirrored);
            }
            for case in self.cases() {
                let leader = self.placement_in(case, f.mirrored, 1 - axis);
                // A held leader's own coordinate is the follower's too: both are given.
                if layers.lateral == Lateral::Mirrored && roles[leader] == Value::Free {
                    roles[self.placement_in(case, p, 1 - axis)] = Value::Follows(leader);
                }
            }
        }
        roles
    }

    /// Place of a point's coordinate among the values, in the first case.
    pub fn placement(&self, point: usize, axis: usize) -> usize {
        self.placement_in(0, point, axis)
    }

    /// Place of a point's coordinate among the values of a case.
    pub fn placement_in(&self, case: usize, point: usize, axis: usize) -> usize {
        let n = self.points.len();
        n + case * self.motion.stride(n) + 2 * point + axis
    }

    pub fn cases(&self) -> std::ops::Range<usize> {
        0..self.motion.cases
    }

    /// The point of a value that is no density, and its axis; no axis: a rotation.
    fn moved(&self, value: usize) -> Option<(usize, Option<usize>)> {
        let n = self.points.len();
        let place = value.checked_sub(n)? % self.motion.stride(n);
        Some(match place.checked_sub(2 * n) {
            None => (place / 2, Some(place % 2)),
            Some(point) => (point, None),
        })
    }

    /// Centre and size of the material along an axis.
    fn extent(&self, axis: usize) -> (f64, f64) {
        let cells = (0..self.material).map(|p| self.points.cell(p)[axis]);
        let (low, high) = cells.fold((i32::MAX, i32::MIN), |(l, h), c| (l.min(c), h.max(c)));
        let rim = if self.on_edge.is_empty() { 1 } else { 0 };
        let size = (high - low + rim) as f64 * self.points.spacing;
        let low = low as f64 + 0.5 * (1 - rim) as f64;
        (
            self.points.origin[axis] + low * self.points.spacing + 0.5 * size,
            size,
        )
    }

    /// Share of each point's cell inside the body: points on a free edge have half a cell (a quarter at corners). None
    /// where all cells are whole.
    pub fn shares(&self) -> Option<Vec<f64>> {
        if !self.points.on_edges {
            return None;
        }
        let layered = self.layers.as_ref().map(|l| l.edges[0].normal().0);
        let cells = || (0..self.material).map(|p| self.points.cell(p));
        let mut share = vec![1.0; self.material];
        for axis in [0, 1].into_iter().filter(|a| Some(*a) != layered) {
            let low = cells().map(|c| c[axis]).min();
            let high = cells().map(|c| c[axis]).max();
            for (share, cell) in share.iter_mut().zip(cells()) {
                if Some(cell[axis]) == low || Some(cell[axis]) == high {
                    *share *= 0.5;
                }
            }
        }
        share.extend(
            self.fictitious
                .iter()
                .map(|f| share[f.mirrored])
                .collect::<Vec<_>>(),
        );
        Some(share)
    }

    /// Where each unknown from `first` on, a placement or rotation, sits at rest.
    pub fn unknown_positions(&self, first: usize) -> Vec<[f64; 2]> {
        (first..self.map.unknowns())
            .filter_map(|q| self.moved(self.map.equation(q)))
            .map(|(p, _)| self.points.position(p))
            .collect()
    }

    /// Displacement of a point in the first case.
    pub fn displacement(&self, values: &[f64], point: usize) -> [f64; 2] {
        let rest = self.points.position(point);
        [0, 1].map(|d| values[self.placement(point, d)] - rest[d])
    }

    /// Refuses a body that could move or turn as a whole.
    fn require_support(&self) -> Result<()> {
        let first = self.points.len();
        let held = |axis: usize| {
            (0..self.points.len()).any(|p| self.map.unknown(first + 2 * p + axis).is_none())
        };
        let missing = [0, 1].iter().find(|&&axis| !held(axis));
        // Along x a turn moves points by their y, and the other way round.
        let turns = |axis: usize| {
            let held = (0..first).filter(|p| self.map.unknown(first + 2 * p + axis).is_none());
            let mut across = held.map(|p| self.points.position(p)[1 - axis]);
            let one = across.next();
            across.all(|at| Some(at) == one)
        };
        let found = match missing {
            Some(axis) => format!("nothing holds the body along {}", ["x", "y"][*axis]),
            None if turns(0) && turns(1) => {
                "the body can turn: points held along x all have one y, and points held along y one x".to_owned()
            }
            None => return Ok(()),
        };
        Err(Error::specimen(
            found,
            "add a [[hold]] with a region and a component, for instance region = { point = [0, 0] }, component = \"x\"",
        ))
    }
}

fn check_layers(layers: &Layers) -> Result<()> {
    layers.displacement.check("layers.displacement")?;
    let axes: Vec<usize> = layers.edges.iter().map(|e| e.normal().0).collect();
    let twice = layers.edges.len() > 1 && layers.edges[1..].contains(&layers.edges[0]);
    if axes.is_empty() || axes.iter().any(|&a| a != axes[0]) || axes.len() > 2 || twice {
        return Err(Error::setting(
            "layers.edges",
            "expected one edge or two opposite edges",
            "give [\"bottom\", \"top\"] or [\"left\", \"right\"]",
        ));
    }
    Ok(())
}

/// Share of a change of given values by which the response to it is measured.
pub const NUDGE: f64 = 1e-3;

/// Given values a small share on the way between two states.
pub fn nudge(from: &[f64], to: &[f64]) -> Vec<f64> {
    from.iter()
        .zip(to)
        .map(|(a, b)| a + NUDGE * (b - a))
        .collect()
}

/// How unknowns moved, per unit of time.
pub fn rate_of(before: &[f64], now: &[f64], dt: f64) -> Vec<f64> {
    now.iter().zip(before).map(|(b, a)| (b - a) / dt).collect()
}

/// 0 for "x", 1 for "y".
pub fn axis_of(component: &str, key: &str) -> Result<usize> {
    ["x", "y"]
        .iter()
        .position(|c| *c == component)
        .ok_or_else(|| Error::setting(key, format!("found \"{component}\""), "give \"x\" or \"y\""))
}
