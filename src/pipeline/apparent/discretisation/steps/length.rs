//! Owns the lengths of load steps: even ones, and adaptive ones, which follow the bend of the curve.
//!
//! All is in units of the whole load: a force is divided by the elastic stiffness, so that an elastic curve has the slope 1. What a curve
//! lags behind that line, load less force, is its plastic part.

use super::Step;
use crate::physics::hex8::plastic::Onset;

/// How the lengths of steps are chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lengths {
    /// So many of one length.
    Even(u32),
    /// They follow the curve.
    Adaptive(Adaptive),
}

/// Lengths that follow the curve: the first step goes to where flow begins to matter, one ends near the offset by which yield is
/// determined, the others are as long as their chord stays near the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Plastic part of the load at which yield is determined, as a share of the whole load.
    pub offset: f64,
    /// What lengths are divided by.
    pub divided: u32,
}

/// Plastic part, over the offset, that elastic points would leave at the end of the first step and of the second.
const FIRST: f64 = 0.01;
const SECOND: f64 = 0.15;

/// What the chord of a step may lie below the curve, over the force.
const BELOW: f64 = 0.02;

/// A step is at most so many times as long as the one before.
const GROWTH: f64 = 2.0;

/// A step is stretched by so much at most to end at the offset.
const STRETCH: f64 = 1.5;

/// From this part of the offset on a step has ended near enough to it.
const NEAR: f64 = 0.8;

/// The least length.
const LEAST: f64 = 1e-3;

impl Lengths {
    /// Length of the step after these, as a share of the load; `onset` of an elastic body under the whole load.
    pub fn next(&self, steps: &[Step], onset: Option<&Onset>) -> f64 {
        match (self, onset) {
            (Lengths::Even(n), _) => 1.0 / f64::from(*n),
            (Lengths::Adaptive(how), None) => 0.1 / f64::from(how.divided),
            (Lengths::Adaptive(how), Some(onset)) => how.next(&Curve::of(steps, onset), onset),
        }
    }
}

/// Load and force at the ends of steps, the origin first.
struct Curve(Vec<[f64; 2]>);

impl Curve {
    fn of(steps: &[Step], onset: &Onset) -> Curve {
        let end = |s: &Step| [s.load, s.conjugate_nmm / onset.stiffness_nmm];
        let ends = steps.iter().map(end);
        Curve(std::iter::once([0.0, 0.0]).chain(ends).collect())
    }

    /// Load and force at the end.
    fn end(&self) -> [f64; 2] {
        self.0[self.0.len() - 1]
    }

    /// Length and slope of the step that ends at a point.
    fn chord(&self, to: usize) -> [f64; 2] {
        let ([from, below], [to, above]) = (self.0[to - 1], self.0[to]);
        [to - from, (above - below) / (to - from)]
    }

    /// Slope at the end and how fast it falls there, per unit of the load, as if it fell by the same factor over equal lengths.
    fn bend(&self) -> [f64; 2] {
        let n = self.0.len() - 1;
        let [length, slope] = self.chord(n);
        // The first step is elastic to its end.
        let [length_before, before] = match n {
            2 => [0.0, 1.0],
            _ => self.chord(n - 1),
        };
        let slope = slope.clamp(1e-6, 1.0);
        let between = 0.5 * (length + length_before);
        let rate = (before.clamp(slope, 1.0) / slope).ln() / between;
        let at_end = slope * (-0.5 * rate * length).exp();
        [at_end, at_end * rate]
    }
}

impl Adaptive {
    fn next(&self, curve: &Curve, onset: &Onset) -> f64 {
        let [load, _] = curve.end();
        let length = match curve.0.len() {
            1 => onset.load_that_sheds(FIRST * self.offset),
            2 => {
                let length = onset.load_that_sheds(SECOND * self.offset) - load;
                length.max(LEAST) / f64::from(self.divided)
            }
            _ => return self.follow(curve),
        };
        fitted(length, 1.0 - load, 1.0)
    }

    /// Length of a step after two or more.
    fn follow(&self, curve: &Curve) -> f64 {
        let [load, force] = curve.end();
        let [length, _] = curve.chord(curve.0.len() - 1);
        let [slope, bend] = curve.bend();
        let near = (8.0 * BELOW * force / bend).sqrt() / f64::from(self.divided);
        let length = near.min(GROWTH * length).max(LEAST);
        let length = match self.up_to_offset(load - force, slope, bend) {
            Some(wanted) => fitted(length, wanted, STRETCH),
            None => length,
        };
        fitted(length, 1.0 - load, 1.0)
    }

    /// Length at which the plastic part reaches the offset; None where it has, or nearly.
    fn up_to_offset(self, plastic: f64, slope: f64, bend: f64) -> Option<f64> {
        if plastic > NEAR * self.offset {
            return None;
        }
        let (rest, grows) = (self.offset - plastic, 1.0 - slope);
        Some(2.0 * rest / (grows + (grows * grows + 2.0 * bend * rest).sqrt()))
    }
}

/// The whole of `wanted` where a step so `stretched` reaches it, half of it where two steps do, else the length.
fn fitted(length: f64, wanted: f64, stretched: f64) -> f64 {
    if wanted <= stretched * length {
        wanted
    } else if wanted <= 2.0 * length {
        0.5 * wanted
    } else {
        length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOW: Adaptive = Adaptive {
        offset: 0.1,
        divided: 1,
    };

    /// Loads at the ends of steps along `force` of the load, the first two of which are given.
    fn ends(force: impl Fn(f64) -> f64, how: Adaptive, first: [f64; 2]) -> Vec<f64> {
        let at = |load: f64| [load, force(load)];
        let mut curve = Curve(vec![[0.0, 0.0], at(first[0]), at(first[1])]);
        while curve.end()[0] < 1.0 - 1e-12 {
            let length = how.follow(&curve);
            assert!(length > 0.0 && curve.0.len() < 100);
            curve.0.push(at(curve.end()[0] + length));
        }
        curve.0[1..].iter().map(|p| p[0]).collect()
    }

    /// Elastic up to 0.2, then bent to a plateau.
    fn bent(load: f64) -> f64 {
        match load <= 0.2 {
            true => load,
            false => 0.2 + 0.15 * (1.0 - (-(load - 0.2) / 0.15).exp()),
        }
    }

    #[test]
    fn a_step_ends_near_the_offset_and_few_are_left_beyond() {
        let ends = ends(bent, HOW, [0.2, 0.3]);
        assert_eq!(*ends.last().unwrap(), 1.0);
        assert!(ends.len() <= 7, "{ends:?}");
        let nearest = |best: f64, end: &f64| {
            let share = (end - bent(*end)) / HOW.offset;
            if (share - 1.0).abs() < (best - 1.0).abs() {
                share
            } else {
                best
            }
        };
        let nearest = ends.iter().fold(0.0, nearest);
        assert!((nearest - 1.0).abs() < 0.3, "{nearest}: {ends:?}");
        // No step is left shorter than those before it because the load ends.
        let lengths: Vec<f64> = ends.windows(2).map(|w| w[1] - w[0]).collect();
        let last = lengths[lengths.len() - 1];
        assert!(last > 0.7 * lengths[lengths.len() - 2], "{ends:?}");
    }

    #[test]
    fn a_divided_length_takes_more_steps_and_a_straight_curve_few() {
        let halved = Adaptive { divided: 2, ..HOW };
        let [whole, parts] = [HOW, halved].map(|how| ends(bent, how, [0.2, 0.25]).len());
        assert!(parts > whole, "{whole} {parts}");
        // A hardening plateau: lengths double.
        let straight = |load: f64| load.min(0.2) + 0.1 * (load - 0.2).max(0.0);
        let ends = ends(straight, HOW, [0.2, 0.25]);
        assert!(ends.len() <= 6, "{ends:?}");
    }

    #[test]
    fn even_steps_are_even() {
        assert_eq!(Lengths::Even(8).next(&[], None), 0.125);
    }
}
