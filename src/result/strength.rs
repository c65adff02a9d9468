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

/// Yield is where the curve meets the line of slope `modulus_mpa` from [`OFFSET`] on.
pub fn strength(curve: &[CurvePoint], modulus_mpa: f64) -> Strength {
    let excess = |p: &[f64; 2]| p[1] - modulus_mpa * (p[0] - OFFSET);
    let origin = [0.0, 0.0];
    let points: Vec<[f64; 2]> = [origin]
        .into_iter()
        .chain(curve.iter().map(|p| [p.strain.abs(), p.stress_mpa.abs()]))
        .collect();
    let crossing = points
        .windows(2)
        .find(|w| excess(&w[0]) > 0.0 && excess(&w[1]) <= 0.0);
    let at = crossing.map(|w| {
        let share = excess(&w[0]) / (excess(&w[0]) - excess(&w[1]));
        [0, 1].map(|i| w[0][i] + share * (w[1][i] - w[0][i]))
    });
    Strength {
        yield_strain: at.map(|p| p[0]),
        yield_stress_mpa: at.map(|p| p[1]),
        max_stress_mpa: points[1..].iter().map(|p| p[1]).reduce(f64::max),
        ..Strength::default()
    }
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
}
