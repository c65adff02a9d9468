//! Owns how a trabecular stiffness compares with published ones: the law of Zysset and Curnier on volume fraction and fabric.
//!
//! Sources: Zysset & Curnier 1995, Mech. Mater. 21:243 (the law); the numbers are a fit to the 720 trabecular regions that Simon et al.
//! published (artorg-unibe-ch/FABCORT, `99_Trabecular/Data.csv`; E 10 GPa, ν 0.3; heterogeneous regions left out, CV < 0.263):
//! `C_ii = 12 441 MPa ρ^2.00 m_i^1.74`, R² 0.953, scatter 21 % (one standard deviation).

use crate::measure::stiffness::{Orthotropic, Six, seen_from};
use serde::{Deserialize, Serialize};

/// Of the law: `C_ii` at full density and isotropic fabric, MPa.
const C0_MPA: f64 = 12_441.0;
/// Exponent of the volume fraction.
const K: f64 = 2.0;
/// Exponent of the fabric eigenvalue, whose three sum to 3.
const TWO_L: f64 = 1.74;
/// One standard deviation, as a factor.
const SCATTER: f64 = 1.21;
/// Tissue modulus of the published regions.
const TISSUE_MPA: f64 = 10_000.0;

/// Where a stiffness lies in the band of published ones.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plausible {
    /// Geometric mean of `C11`, `C22`, `C33` of the tensor in its own frame, scaled to a tissue modulus of 10 GPa.
    pub at_10_gpa_mpa: f64,
    /// The same of the law at this volume fraction and fabric.
    pub published_mpa: f64,
    /// By how many standard deviations of the published regions it lies above (below: negative).
    pub standard_deviations: f64,
    /// Whether the fabric was measured; an isotropic one was taken otherwise, for which the law is highest.
    pub fabric_measured: bool,
    /// In a sentence.
    pub in_words: String,
}

/// The place of a stiffness (MPa) of tissue with Young's modulus `young_mpa` at volume fraction `bv_tv`; `mil_mm` are the mean intercept
/// lengths of its fabric. `conditions` are named in the sentence. None where the tensor has no own frame, or there is no bone.
pub fn plausible(
    stiffness: &Six,
    orthotropic: Option<&Orthotropic>,
    (bv_tv, mil_mm): (f64, Option<[f64; 3]>),
    young_mpa: f64,
    conditions: &str,
) -> Option<Plausible> {
    let own = seen_from(stiffness, &orthotropic?.axes);
    let at_10_gpa_mpa = (own[0][0] * own[1][1] * own[2][2]).cbrt() * TISSUE_MPA / young_mpa;
    let fabric = mil_mm.map_or(1.0, |mil| {
        let sum: f64 = mil.iter().sum();
        mil.iter().map(|m| 3.0 * m / sum).product::<f64>().cbrt()
    });
    let published_mpa = C0_MPA * bv_tv.powf(K) * fabric.powf(TWO_L);
    let ratio = at_10_gpa_mpa / published_mpa;
    if !(ratio > 0.0 && ratio.is_finite()) {
        return None;
    }
    let standard_deviations = ratio.ln() / SCATTER.ln();
    let place = match standard_deviations.abs() {
        d if d <= 1.0 => "inside one standard deviation",
        d if d <= 2.0 => "inside two standard deviations",
        d if d <= 3.0 => "outside two standard deviations",
        _ => {
            "outside three standard deviations: check the threshold, the voxel size and the conditions"
        }
    };
    let fabric_in_words = match mil_mm {
        Some(_) => "the measured fabric",
        None => "an isotropic fabric (segment --morphometry measures it)",
    };
    Some(Plausible {
        at_10_gpa_mpa,
        published_mpa,
        standard_deviations,
        fabric_measured: mil_mm.is_some(),
        in_words: format!(
            "mean C_ii of the own frame at a tissue modulus of 10 GPa is {at_10_gpa_mpa:.0} MPa under {conditions}; 720 published trabecular regions (Zysset-Curnier law, conditions near to mixed) have {published_mpa:.0} MPa at this volume fraction and {fabric_in_words}, {:.0} to {:.0} within two standard deviations: this one lies {:+.0} % from it, {place} ({standard_deviations:+.1}). Kinematic conditions lie some 50 % higher",
            published_mpa / SCATTER.powi(2),
            published_mpa * SCATTER.powi(2),
            100.0 * (ratio - 1.0)
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::stiffness::orthotropic;

    /// An isotropic tensor of these moduli.
    fn isotropic(c11: f64, c12: f64) -> Six {
        std::array::from_fn(|i| {
            std::array::from_fn(|j| match (i, j) {
                (0..3, 0..3) if i == j => c11,
                (0..3, 0..3) => c12,
                _ if i == j => 0.5 * (c11 - c12),
                _ => 0.0,
            })
        })
    }

    fn place(c11: f64, young_mpa: f64, mil: Option<[f64; 3]>) -> Plausible {
        let c = isotropic(c11, 0.3 * c11);
        plausible(
            &c,
            orthotropic(&c).as_ref(),
            (0.234, mil),
            young_mpa,
            "mixed conditions",
        )
        .unwrap()
    }

    /// The LHDL core of `reports`: 768 MPa at a volume fraction of 0.234, where the law has 679 MPa and an isotropic fabric 681.
    #[test]
    fn a_tensor_is_placed_in_the_band() {
        let found = place(768.0, 10_000.0, None);
        assert!((found.published_mpa - 12_441.0 * 0.234 * 0.234).abs() < 1e-9);
        assert!((found.standard_deviations - (768.0f64 / 681.22).ln() / 1.21f64.ln()).abs() < 1e-4);
        assert!(
            found
                .in_words
                .contains("+13 % from it, inside one standard deviation"),
            "{}",
            found.in_words
        );
        // The tissue modulus scales, a fabric lowers the law's geometric mean.
        assert!((place(1382.4, 18_000.0, None).at_10_gpa_mpa - 768.0).abs() < 1e-6);
        let fabric = place(768.0, 10_000.0, Some([0.2, 0.15, 0.1]));
        let exact = (4.0f64 / 3.0 * 2.0 / 3.0).powf(1.74 / 3.0);
        assert!((fabric.published_mpa / found.published_mpa - exact).abs() < 1e-12);
        assert!(
            place(4000.0, 10_000.0, None)
                .in_words
                .contains("check the threshold")
        );
        let c = isotropic(768.0, 200.0);
        assert_eq!(plausible(&c, None, (0.2, None), 1e4, "mixed"), None);
        assert_eq!(
            plausible(&c, orthotropic(&c).as_ref(), (0.0, None), 1e4, "mixed"),
            None
        );
    }
}
