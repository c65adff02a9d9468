//! Owns what a body is given over time: held placements, layers, and the guess of a step that they make.

use super::Body;
use crate::scene::conditions::Normal;

impl Body {
    /// `g` at time `t`: held placements and densities; zero elsewhere.
    pub fn given(&self, t: f64) -> Vec<f64> {
        self.given_with(self.edge_displacement(t), |k| self.holds[k].value.at(t))
    }

    /// `g` before anything was moved: what is held at time 0 may be elsewhere already.
    pub fn at_rest(&self) -> Vec<f64> {
        self.given_with(0.0, |_| 0.0)
    }

    fn edge_displacement(&self, t: f64) -> f64 {
        self.layers.as_ref().map_or(0.0, |l| l.displacement.at(t))
    }

    /// `u` moves the layers; `by` is the displacement of each hold.
    fn given_with(&self, u: f64, by: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut given = vec![0.0; self.map.values()];
        for (p, (given, density)) in given.iter_mut().zip(&self.density).enumerate() {
            if self.map.unknown(p).is_none() {
                *given = *density;
            }
        }
        for &(value, at_rest, k) in &self.held {
            given[value] = at_rest + by(k);
        }
        let Some(layers) = &self.layers else {
            return given;
        };
        for &(p, edge) in &self.on_edge {
            let (axis, sign) = edge.normal();
            for case in self.cases() {
                given[self.placement_in(case, p, axis)] =
                    self.points.position(p)[axis] + sign as f64 * u;
            }
        }
        for (k, f) in self.fictitious.iter().enumerate() {
            let p = self.material + k;
            let (axis, sign) = f.edge.normal();
            let rest = self.points.position(p);
            let moved = match layers.normal {
                Normal::Affine => {
                    let (centre, size) = self.extents[axis];
                    centre + (rest[axis] - centre) * (1.0 + 2.0 * u / size)
                }
                Normal::Rigid => rest[axis] + sign as f64 * u,
            };
            for case in self.cases() {
                given[self.placement_in(case, p, axis)] = moved;
                let lateral = self.placement_in(case, p, 1 - axis);
                if self.map.unknown(lateral).is_none() {
                    given[lateral] = rest[1 - axis];
                }
            }
        }
        given
    }

    /// Times at which what is given jumps or bends.
    pub fn corners(&self) -> Vec<f64> {
        let layers = self.layers.iter().flat_map(|l| l.displacement.corners());
        let holds = self.holds.iter().flat_map(|h| h.value.corners());
        layers.chain(holds).copied().collect()
    }

    /// Unknowns of the undeformed body.
    pub fn start(&self) -> Vec<f64> {
        let at_rest = |value: usize| match self.moved(value) {
            None => self.density[value],
            Some((p, Some(axis))) => self.points.position(p)[axis],
            Some((_, None)) => 0.0,
        };
        (0..self.map.unknowns())
            .map(|q| at_rest(self.map.equation(q)))
            .collect()
    }

    /// Carries placements over a change of the layers between two times (None: from rest): the affine stretch they
    /// impose, with lateral contraction by ν = 1/3. False where there are no layers.
    pub fn stretch(&self, q: &mut [f64], before: Option<f64>, now: f64) -> bool {
        let Some(layers) = &self.layers else {
            return false;
        };
        let axis = layers.edges[0].normal().0;
        let u0 = before.map_or(0.0, |t| self.edge_displacement(t));
        let u1 = self.edge_displacement(now);
        let size = self.extents[axis].1;
        let along = (1.0 + 2.0 * u1 / size) / (1.0 + 2.0 * u0 / size);
        let across = 1.0 - 2.0 / 3.0 * (u1 - u0) / size;
        for (k, q) in q.iter_mut().enumerate() {
            if let Some((_, Some(own))) = self.moved(self.map.equation(k)) {
                let centre = self.extents[own].0;
                let factor = if own == axis { along } else { across };
                *q = centre + (*q - centre) * factor;
            }
        }
        true
    }
}
