//! Owns what is measured of a growing crack: how far it has come, in which direction, whether it is where it stops.

use crate::discretisation::plane::Points;

/// A crack as the broken bonds between nearest neighbours: longer bonds break up to a horizon ahead of its faces.
pub struct Crack {
    tip: [f64; 2],
    stop: Vec<bool>,
    /// Broken bonds of any length.
    pub broken: usize,
    /// From the tip to the farthest centre of a broken bond between nearest neighbours.
    pub length: f64,
    pub end: [f64; 2],
    /// Sum of those centres, from the tip.
    lean: [f64; 2],
    pub stopped: bool,
}

impl Crack {
    /// A crack from `tip` that stops at the points marked in `stop`.
    pub fn new(tip: [f64; 2], stop: Vec<bool>) -> Self {
        Crack {
            tip,
            stop,
            broken: 0,
            length: 0.0,
            end: tip,
            lean: [0.0; 2],
            stopped: false,
        }
    }

    /// Takes note of the broken bond between `ends`.
    pub fn grow(&mut self, points: &Points, ends: [usize; 2]) {
        self.broken += 1;
        let [a, b] = ends.map(|p| points.position(p));
        if (a[0] - b[0]).hypot(a[1] - b[1]) > 1.1 * points.spacing {
            return;
        }
        self.stopped |= ends.iter().any(|&p| self.stop[p]);
        let centre = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let from = [centre[0] - self.tip[0], centre[1] - self.tip[1]];
        self.lean = [self.lean[0] + from[0], self.lean[1] + from[1]];
        if from[0].hypot(from[1]) > self.length {
            self.length = from[0].hypot(from[1]);
            self.end = centre;
        }
    }

    /// From the tip to the mean of the crack's points.
    pub fn mean_direction_deg(&self) -> f64 {
        self.lean[1].atan2(self.lean[0]).to_degrees()
    }

    /// From the tip to the crack's end.
    pub fn end_direction_deg(&self) -> f64 {
        let [x, y] = [0, 1].map(|i| self.end[i] - self.tip[i]);
        y.atan2(x).to_degrees()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A long bond neither lengthens the crack nor stops it; a short one does both.
    #[test]
    fn only_bonds_between_nearest_neighbours_are_the_crack() {
        let points = Points::from_box([0.0; 2], 1.0, [6, 2], |_| true);
        let at = |i: i32, j: i32| points.at([i, j]).unwrap();
        let mut stop = vec![false; points.len()];
        stop[at(3, 0)] = true;
        let mut crack = Crack::new([0.0, 1.0], stop);
        crack.grow(&points, [at(3, 0), at(5, 1)]);
        assert!(!crack.stopped && crack.length == 0.0 && crack.broken == 1);
        crack.grow(&points, [at(2, 0), at(2, 1)]);
        assert!(!crack.stopped && (crack.length - 2.5).abs() < 1e-12);
        assert!(crack.end_direction_deg().abs() < 1e-12);
        crack.grow(&points, [at(3, 1), at(3, 0)]);
        assert!(crack.stopped && crack.mean_direction_deg().abs() < 1e-12);
    }
}
