//! Owns parallel plates and the crack that may run through any body.

use super::super::waves::Numbers;
use super::frame::{Axes, Vec3, dot, minus};

/// Parallel plates across the third axis of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plates {
    /// From the middle of one plate to that of the next.
    pub period_mm: f64,
    /// Where the first lies, in periods.
    pub shift: f64,
}

impl Plates {
    /// Distance from the middle of the nearest plate, in the body's own axes.
    pub fn value(&self, p: Vec3) -> f64 {
        let periods = p[2] / self.period_mm + self.shift;
        (periods - periods.round()).abs() * self.period_mm
    }
}

/// A plane cut of constant width that ends at a straight front.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crack {
    normal: Vec3,
    /// Direction in which it grew.
    grown: Vec3,
    centre: Vec3,
    front_mm: f64,
    half_width_mm: f64,
}

/// A crack lies across the load, at most this far from it.
const TILT_DEGREES: f64 = 25.0;

impl Crack {
    /// A crack that cuts `share` of a box of this size. Its height, tilt and direction follow from the seed.
    pub fn new(size_mm: Vec3, width_mm: f64, share: f64, numbers: Numbers) -> Self {
        let tilt = TILT_DEGREES * numbers.uniform(0);
        let Axes([grown, _, normal]) = Axes::tilted(tilt, 360.0 * numbers.uniform(1));
        // Half the width of the box in the direction of growth.
        let reach = 0.5 * (size_mm[0] * grown[0].abs() + size_mm[1] * grown[1].abs());
        Crack {
            normal,
            grown,
            centre: [0.0, 0.0, 0.3 * size_mm[2] * (numbers.uniform(2) - 0.5)],
            front_mm: reach * (2.0 * share - 1.0),
            half_width_mm: 0.5 * width_mm,
        }
    }

    /// Positive in the crack, negative outside; never changes faster than the distance (mm).
    pub fn depth(&self, p: Vec3) -> f64 {
        let from = minus(p, self.centre);
        let sideways = self.half_width_mm - dot(self.normal, from).abs();
        sideways.min(self.front_mm - dot(self.grown, from))
    }
}
