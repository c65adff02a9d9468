//! Owns the calibration of grey values: from stored values to HU and bone mineral density.
//!
//! A stored value is the linear attenuation times `mu_scaling`: `μ = v / mu_scaling` in 1/cm. Then
//! `HU = 1000 (μ − μ_water) / μ_water` and `ρ = slope · μ + intercept` in mg HA/cm³.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What the grey values of a Scanco scan shall mean. Other formats are read in the unit that they were saved in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GreyUnit {
    /// As stored.
    Native,
    /// Hounsfield units.
    Hu,
    /// HU where the file holds a calibration to it, else as stored: for recipes that take scans of several formats.
    HuWhereKnown,
    /// Bone mineral density, mg HA/cm³.
    Mgha,
}

/// Constants from an AIM's processing log or an ISQ's header; None where it does not hold them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Calibration {
    /// Stored units per 1/cm.
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

/// The name that this program uses: `HU`, `mg HA/cm3`, or the file's own word. None where the word says that there is none.
pub fn unit_named(text: &str) -> Option<String> {
    let text = text.trim().trim_matches(['"', '\'']).trim();
    let short: String = text
        .to_lowercase()
        .replace('³', "3")
        .chars()
        .filter(|c| c.is_alphanumeric() || *c == '/')
        .collect();
    Some(match short.as_str() {
        "hu" | "hounsfield" | "hounsfieldunit" | "hounsfieldunits" => "HU".into(),
        "mgha/ccm" | "mgha/cm3" | "mgha/cm" | "mgha/cc" | "mg/ccmha" | "mg/cm3ha" | "mghaccm" => {
            "mg HA/cm3".into()
        }
        // US is DICOM's word for unspecified.
        "" | "us" | "unspecified" | "unknown" | "none" | "arbitrary" => return None,
        _ => text.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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

    #[test]
    fn spellings_of_one_unit_are_one() {
        for word in ["HU", "hu ", "\"Hounsfield Units\""] {
            assert_eq!(unit_named(word).as_deref(), Some("HU"), "{word}");
        }
        for word in ["mgHA/ccm", "mg HA/ccm", "mg HA/cm^3", "mg HA/cm³"] {
            assert_eq!(unit_named(word).as_deref(), Some("mg HA/cm3"), "{word}");
        }
        assert_eq!(unit_named("US"), None);
        assert_eq!(unit_named("1/cm").as_deref(), Some("1/cm"));
    }
}
