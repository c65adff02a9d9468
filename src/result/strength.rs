//! Owns what a stress–strain curve says: its points, the yield by the 0.2 % offset, the largest stress.

use serde::{Deserialize, Serialize};

/// One line of `curve.csv`: the end of a load step. Strain, stress and force carry the sign of the strain; energies are sums since
/// the start, but for what is stored now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct CurvePoint {
    /// Number of the load step, from 1.
    pub step: u64,
    /// Nominal.
    pub strain: f64,
    /// Apparent: force over the whole end area.
    pub stress_mpa: f64,
    /// Along the displacement of the ends.
    pub force_n: f64,
    /// Share of the bone's volume that has ever flowed.
    pub plastic_volume_fraction: f64,
    /// Stored elastically now.
    pub energy_mj: f64,
    /// By plastic flow.
    pub dissipated_mj: f64,
    /// Of the ends: mean force of a step times its displacement.
    pub work_mj: f64,
    /// Of conjugate gradients, in this step.
    pub iterations: u64,
}

/// What has flowed of one tissue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct YieldedShare {
    /// Of a labelled scan; `all` for all bone.
    pub label: String,
    /// Elements of this tissue.
    pub elements: u64,
    /// Share of the volume.
    pub yielded_share: f64,
    /// Largest and mean equivalent plastic strain of its elements.
    pub maximum_plastic_strain: f64,
    /// Mean equivalent plastic strain over all its elements.
    pub mean_plastic_strain: f64,
}

/// A loaded body that yields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Yielding {
    /// One point a load step.
    pub curve: Vec<CurvePoint>,
    /// One line a tissue.
    pub shares: Vec<YieldedShare>,
    /// True where steps ended before the whole load.
    pub stopped: bool,
    /// What a reader must know, in words.
    pub said: Vec<String>,
}

/// Of a curve; magnitudes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
pub struct Strength {
    /// None where the curve ends before.
    pub yield_stress_mpa: Option<f64>,
    /// Nominal strain at yield, by the 0.2 % offset.
    pub yield_strain: Option<f64>,
    /// Largest apparent stress of the curve.
    pub max_stress_mpa: Option<f64>,
    /// What finer load steps and elements would change and the solver left; None where it was not asked for.
    pub yield_stress_error_mpa: Option<f64>,
    /// The same of `max_stress_mpa`.
    pub max_stress_error_mpa: Option<f64>,
}

impl Strength {
    /// The larger of the relative errors; None where the error of one of the stresses is not stated.
    pub fn error(&self) -> Option<f64> {
        let largest = self.max_stress_error_mpa? / self.max_stress_mpa?;
        let all = match self.yield_stress_mpa {
            None => largest,
            Some(stress) => largest.max(self.yield_stress_error_mpa? / stress),
        };
        Some(all).filter(|e| e.is_finite())
    }
}

/// Strain by which the line of the elastic modulus is shifted.
pub const OFFSET: f64 = 0.002;

/// The step of a curve that the offset line crosses.
struct Crossing {
    /// Strain and stress of its start and end.
    start: [f64; 2],
    end: [f64; 2],
    /// Of the chords before and after: of the first step the modulus is before, of the last nothing after.
    before: Chord,
    after: Option<Chord>,
    /// Stress where the chord between both meets the offset line.
    chord_mpa: f64,
}

/// A straight line over a step.
#[derive(Clone, Copy)]
struct Chord {
    length: f64,
    slope: f64,
}

impl Chord {
    fn of(start: [f64; 2], end: [f64; 2]) -> Chord {
        let length = end[0] - start[0];
        Chord {
            length,
            slope: (end[1] - start[1]) / length,
        }
    }

    /// Slope of a curve between two chords: their weighted harmonic mean, 0 where the curve turns. With it a piecewise cubic is monotone
    /// where its points are (Fritsch & Butland 1984).
    fn slope_between(self, after: Chord) -> f64 {
        if self.slope * after.slope <= 0.0 {
            return 0.0;
        }
        let weights = [
            2.0 * after.length + self.length,
            after.length + 2.0 * self.length,
        ];
        (weights[0] + weights[1]) / (weights[0] / self.slope + weights[1] / after.slope)
    }
}

fn crossing(curve: &[CurvePoint], modulus_mpa: f64) -> Option<Crossing> {
    let excess = |p: [f64; 2]| p[1] - modulus_mpa * (p[0] - OFFSET);
    let ends = curve.iter().map(|p| [p.strain.abs(), p.stress_mpa.abs()]);
    let points: Vec<[f64; 2]> = std::iter::once([0.0, 0.0]).chain(ends).collect();
    let crosses = |w: &[[f64; 2]]| excess(w[0]) > 0.0 && excess(w[1]) <= 0.0;
    let at = points.windows(2).position(crosses)?;
    let (start, end) = (points[at], points[at + 1]);
    let (above, below) = (excess(start), excess(end));
    let first = Chord {
        length: 0.0,
        slope: modulus_mpa,
    };
    Some(Crossing {
        before: match at {
            0 => first,
            _ => Chord::of(points[at - 1], start),
        },
        after: points.get(at + 2).map(|next| Chord::of(end, *next)),
        chord_mpa: start[1] + above / (above - below) * (end[1] - start[1]),
        start,
        end,
    })
}

impl Crossing {
    /// Slopes of the curve at both ends of the step: between chords, and at the curve's own ends as a parabola has them.
    fn slopes(&self) -> [f64; 2] {
        let own = Chord::of(self.start, self.end);
        let start = match self.before.length > 0.0 {
            true => self.before.slope_between(own),
            false => self.before.slope,
        };
        let end = match self.after {
            Some(after) => own.slope_between(after),
            None => 2.0 * own.slope - start,
        };
        // A cubic with steeper ends is not monotone.
        let most = 3.0 * own.slope;
        [start, end].map(|slope| slope.clamp(most.min(0.0), most.max(0.0)))
    }

    /// Strain where the cubic with these slopes meets the line of slope `modulus_mpa` from [`OFFSET`] on.
    fn strain(&self, modulus_mpa: f64) -> f64 {
        let ([from, stress], length) = (self.start, self.end[0] - self.start[0]);
        let [first, last] = self.slopes().map(|slope| slope * length);
        let rise = self.end[1] - stress;
        let excess = |x: f64| {
            let cubic = x
                * (first + x * (3.0 * rise - 2.0 * first - last + x * (first + last - 2.0 * rise)));
            stress + cubic - modulus_mpa * (from + x * length - OFFSET)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match excess(middle) > 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        from + high * length
    }
}

/// Yield is where the curve, a cubic over each step, meets the line of slope `modulus_mpa` from [`OFFSET`] on.
pub fn strength(curve: &[CurvePoint], modulus_mpa: f64) -> Strength {
    let strain = crossing(curve, modulus_mpa).map(|c| c.strain(modulus_mpa));
    Strength {
        yield_strain: strain,
        yield_stress_mpa: strain.map(|strain| modulus_mpa * (strain - OFFSET)),
        max_stress_mpa: curve.iter().map(|p| p.stress_mpa.abs()).reduce(f64::max),
        ..Strength::default()
    }
}

/// Part of the yield stress that the length of load steps may leave open before it is worth a word.
const LEFT_OPEN: f64 = 0.05;

/// What a reader must know of a yield stress whose load step is long. A curve that bends down lies above the chord of the step, below the
/// line on which the step before would have gone on and, where it rises, below its end.
pub fn long_steps_in_words(curve: &[CurvePoint], modulus_mpa: f64) -> Option<String> {
    let Crossing {
        start: [strain, stress],
        end,
        before: Chord {
            slope: slope_before,
            ..
        },
        chord_mpa: least,
        ..
    } = crossing(curve, modulus_mpa)?;
    // Where the line from the start with the slope before meets the offset line; nowhere where that is as steep.
    let bent = modulus_mpa - slope_before;
    let met = match bent > 0.0 {
        true => stress + slope_before * (stress - modulus_mpa * (strain - OFFSET)) / bent,
        false => f64::INFINITY,
    };
    let most = match end[1] >= stress {
        true => met.min(end[1]),
        false => met,
    };
    (most > (1.0 + LEFT_OPEN) * least).then(|| {
        let upper = match most.is_finite() {
            true => format!("between {least:.4} and {most:.4} MPa"),
            false => format!("at {least:.4} MPa or above"),
        };
        format!("load steps are long where the curve meets the offset line: the yield stress lies {upper} (more --steps)")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[[f64; 2]]) -> Vec<CurvePoint> {
        let point = |&[strain, stress_mpa]: &[f64; 2]| CurvePoint {
            strain,
            stress_mpa,
            ..CurvePoint::default()
        };
        points.iter().map(point).collect()
    }

    #[test]
    fn the_offset_line_meets_the_curve_between_its_points() {
        // Perfect plasticity: modulus 1000, yield 5 MPa at a strain of 0.5 %.
        let perfect = curve(&[[-0.004, -4.0], [-0.005, -5.0], [-0.01, -5.0]]);
        let found = strength(&perfect, 1000.0);
        assert!((found.yield_stress_mpa.unwrap() - 5.0).abs() < 1e-12);
        assert!((found.yield_strain.unwrap() - 0.007).abs() < 1e-12);
        assert_eq!(found.max_stress_mpa, Some(5.0));
        // Softening, and a curve that ends before it yields.
        let peak = curve(&[[0.01, 6.0], [0.02, 4.0]]);
        assert_eq!(strength(&peak, 1000.0).max_stress_mpa, Some(6.0));
        assert_eq!(strength(&perfect[..2], 1000.0).yield_stress_mpa, None);
        assert_eq!(strength(&[], 1000.0), Strength::default());
    }

    /// Between the ends of ten steps a smooth curve is met to 0.1 %; chords alone would be 0.5 % low.
    #[test]
    fn a_smooth_curve_is_met_between_its_points() {
        let stress = |strain: f64| 5.0 * (200.0 * strain).tanh();
        let steps = |n: usize| -> Vec<[f64; 2]> {
            let ends = (1..=n).map(|k| 0.02 * k as f64 / n as f64);
            ends.map(|e| [e, stress(e)]).collect()
        };
        let fine = strength(&curve(&steps(4000)), 1000.0);
        let met = strength(&curve(&steps(10)), 1000.0);
        let off = |s: Strength| s.yield_stress_mpa.unwrap() / fine.yield_stress_mpa.unwrap() - 1.0;
        assert!(off(met).abs() < 1e-3, "{:e}", off(met));
        let chord = crossing(&curve(&steps(10)), 1000.0).unwrap().chord_mpa;
        assert!(chord < 0.995 * fine.yield_stress_mpa.unwrap(), "{chord}");
        // One that ends in the step of its crossing lies above its chord still.
        let ended = strength(&curve(&steps(10)[..4]), 1000.0);
        assert!(ended.yield_stress_mpa.unwrap() > chord, "{ended:?}");
    }

    #[test]
    fn steps_too_long_for_the_offset_are_said() {
        // Perfect plasticity: modulus 1000, yield 5 MPa.
        let perfect = |ends: &[f64]| -> Vec<[f64; 2]> {
            ends.iter().map(|e| [*e, (1000.0 * e).min(5.0)]).collect()
        };
        let words = |ends: &[f64]| long_steps_in_words(&curve(&perfect(ends)), 1000.0);
        // The chord of one step to 10 % meets the offset line at 0.105 MPa.
        let long = words(&[0.1]).unwrap();
        assert!(long.contains("between 0.1053 and 5.0000 MPa"), "{long}");
        assert_eq!(words(&[0.004, 0.006, 0.01]), None);
        assert_eq!(words(&[0.004]), None);
        // One that falls after a step as steep as the modulus has no upper bound.
        let falls = curve(&[[0.004, 4.0], [0.02, 3.0]]);
        let falls = long_steps_in_words(&falls, 1000.0).unwrap();
        assert!(falls.contains("or above"), "{falls}");
    }
}
