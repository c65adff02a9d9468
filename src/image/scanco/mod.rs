//! Owns Scanco's number formats and calibration, shared by AIM and ISQ.
//!
//! A stored value is the linear attenuation times `mu_scaling`: `μ = v / mu_scaling` in 1/cm. Then
//! `HU = 1000 (μ − μ_water) / μ_water` and `ρ = slope · μ + intercept` in mg HA/cm³.

pub mod aim;
pub mod isq;

use crate::error::{Error, Result};
use crate::pipeline::segment::GreyUnit;
use serde::Serialize;
use std::path::Path;

/// Constants from an AIM's processing log or an ISQ's header; None where it does not hold them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Calibration {
    pub mu_scaling: Option<f64>,
    /// 1/cm.
    #[serde(rename = "mu_water_per_cm")]
    pub mu_water: Option<f64>,
    /// mg HA/cm³ per 1/cm, and mg HA/cm³.
    #[serde(rename = "density_mgha_slope_intercept")]
    pub density: Option<[f64; 2]>,
}

impl Calibration {
    /// Slope and intercept from stored values to `unit`, and the unit's name.
    pub fn line(&self, unit: GreyUnit, path: &Path) -> Result<([f64; 2], &'static str)> {
        let missing = |what: &str| {
            Error::file(
                path,
                format!("does not hold {what}, which {unit:?} needs"),
                "use --units native with a threshold in stored values, or a file that kept its calibration",
            )
        };
        let scaling = || {
            self.mu_scaling
                .filter(|v| *v > 0.0)
                .ok_or_else(|| missing("Mu_Scaling"))
        };
        match unit {
            GreyUnit::Native => Ok(([1.0, 0.0], "native")),
            GreyUnit::Hu | GreyUnit::HuWhereKnown => {
                let water = self
                    .mu_water
                    .filter(|v| *v > 0.0)
                    .ok_or_else(|| missing("the attenuation of water"))?;
                Ok(([1000.0 / (scaling()? * water), -1000.0], "HU"))
            }
            GreyUnit::Mgha => {
                let [slope, intercept] = self
                    .density
                    .ok_or_else(|| missing("the density calibration"))?;
                Ok(([slope / scaling()?, intercept], "mg HA/cm3"))
            }
        }
    }

    /// Facts for `info`.
    pub fn details(&self) -> Vec<(String, String)> {
        let density = self
            .density
            .map(|[a, b]| format!("{a} · μ + {b} mg HA/cm³"));
        [
            ("mu scaling", self.mu_scaling.map(|v| v.to_string())),
            ("mu water", self.mu_water.map(|v| format!("{v} 1/cm"))),
            ("density", density),
        ]
        .into_iter()
        .filter_map(|(key, value)| Some((key.to_string(), value?)))
        .collect()
    }
}

/// A little-endian integer at `at`, or None past the end.
pub fn i32_at(bytes: &[u8], at: usize) -> Option<i32> {
    Some(i32::from_le_bytes(
        bytes.get(at..at.checked_add(4)?)?.try_into().ok()?,
    ))
}

pub fn i64_at(bytes: &[u8], at: usize) -> Option<i64> {
    Some(i64::from_le_bytes(
        bytes.get(at..at.checked_add(8)?)?.try_into().ok()?,
    ))
}

/// A VAX F float: 16-bit words swapped, exponent two above IEEE's (bias 128 and a fraction from ½).
pub fn vax_f32(b: [u8; 4]) -> f32 {
    let bits = u32::from_le_bytes([b[2], b[3], b[0], b[1]]);
    // An exponent of 0 is zero whatever the rest.
    if bits & 0x7F80_0000 == 0 {
        0.0
    } else {
        f32::from_bits(bits) / 4.0
    }
}

/// A VAX G float: the same with 11 bits of exponent.
pub fn vax_f64(b: [u8; 8]) -> f64 {
    let bits = u64::from_le_bytes([b[6], b[7], b[4], b[5], b[2], b[3], b[0], b[1]]);
    if bits & 0x7FF0_0000_0000_0000 == 0 {
        0.0
    } else {
        f64::from_bits(bits) / 4.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of 1, −12.5 and 0.082 in VAX order, worked out from the format: sign, exponent + 128, fraction from ½.
    #[test]
    fn vax_floats_are_decoded() {
        assert_eq!(vax_f32([0x80, 0x40, 0, 0]), 1.0);
        assert_eq!(vax_f32([0x48, 0xC2, 0, 0]), -12.5);
        assert_eq!(vax_f32([0, 0, 1, 1]), 0.0);
        assert_eq!(vax_f64([0x10, 0x40, 0, 0, 0, 0, 0, 0]), 1.0);
        assert_eq!(vax_f64([0x49, 0xC0, 0, 0, 0, 0, 0, 0]), -12.5);
    }

    #[test]
    fn lines_follow_the_formulas() {
        let c = Calibration {
            mu_scaling: Some(8192.0),
            mu_water: Some(0.25),
            density: Some([1600.0, -390.0]),
        };
        let at = |unit, v: f64| {
            c.line(unit, Path::new("x"))
                .map(|([a, b], _)| a * v + b)
                .unwrap()
        };
        assert_eq!(at(GreyUnit::Native, 8192.0), 8192.0);
        // μ = 1 / cm: four times water.
        assert_eq!(at(GreyUnit::Hu, 8192.0), 3000.0);
        assert_eq!(at(GreyUnit::Mgha, 8192.0), 1210.0);
        let e = Calibration::default()
            .line(GreyUnit::Hu, Path::new("x.aim"))
            .unwrap_err();
        assert!(e.to_string().contains("x.aim"));
    }
}
