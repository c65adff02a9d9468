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

/// The step of a curve that the offset line crosses, strain and stress of its start and end, and the slope of the step before: of the
/// first step the modulus.
struct Crossing {
    start: [f64; 2],
    end: [f64; 2],
    slope_before: f64,
    /// Where the chord between both meets the offset line.
    at: [f64; 2],
}

fn crossing(curve: &[CurvePoint], modulus_mpa: f64) -> Option<Crossing> {
    let excess = |p: [f64; 2]| p[1] - modulus_mpa * (p[0] - OFFSET);
    let mut start = [0.0, 0.0];
    let mut slope_before = modulus_mpa;
    for p in curve {
        let end = [p.strain.abs(), p.stress_mpa.abs()];
        let (above, below) = (excess(start), excess(end));
        if above > 0.0 && below <= 0.0 {
            let share = above / (above - below);
            return Some(Crossing {
                at: [0, 1].map(|i| start[i] + share * (end[i] - start[i])),
                start,
                end,
                slope_before,
            });
        }
        slope_before = (end[1] - start[1]) / (end[0] - start[0]);
        start = end;
    }
    None
}

/// Yield is where the curve meets the line of slope `modulus_mpa` from [`OFFSET`] on.
pub fn strength(curve: &[CurvePoint], modulus_mpa: f64) -> Strength {
    let at = crossing(curve, modulus_mpa).map(|c| c.at);
    Strength {
        yield_strain: at.map(|p| p[0]),
        yield_stress_mpa: at.map(|p| p[1]),
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
        slope_before,
        at: [_, least],
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
