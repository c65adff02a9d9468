//! Owns what bone tissue is made of: moduli by label, or from grey value or density by a law of the field.
//!
//! Densities are what a law was fitted to: the scan's own values, or `slope · value + intercept` of them.

use crate::error::{Error, Result};
use crate::physics::lattice::check_solid;
use serde::{Deserialize, Serialize};

/// An isotropic solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// Young's modulus.
    pub young_mpa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

/// One tissue of a labelled scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Label {
    /// The voxels' value, as 100 (trabecular) or 127 (cortical) in Scanco's masks.
    pub value: i32,
    /// Young's modulus.
    pub young_mpa: f64,
    /// None: as for all tissue.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
}

/// From a voxel's value to Young's modulus in MPa.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum Law {
    /// A modulus for each value of a labelled scan.
    Labels(Vec<Label>),
    /// `E = coefficient · ρ^exponent` (Carter and Hayes 1977, Morgan et al. 2003).
    Power {
        /// In MPa where ρ is 1.
        coefficient: f64,
        /// Power of ρ.
        exponent: f64,
    },
    /// `E = slope · ρ + intercept` (as Mulder et al. 2007: 25 ρ − 5830, ρ in mg HA/cm³).
    Linear {
        /// In MPa per unit of ρ.
        slope: f64,
        /// In MPa.
        intercept: f64,
    },
    /// `E = E_full · (ρ / full)^exponent` with the tissue's E for E_full (Homminga et al. 2001, exponent 1.7).
    Homminga {
        /// Density whose modulus is E_full.
        full: f64,
        /// 1.7 where it is left out.
        #[serde(default = "homminga_exponent")]
        exponent: f64,
    },
}

fn homminga_exponent() -> f64 {
    1.7
}

fn as_stored() -> [f64; 2] {
    [1.0, 0.0]
}

/// A law with what it is applied to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// From density to modulus.
    pub law: Law,
    /// Slope and intercept from the scan's values to the law's density.
    #[serde(default = "as_stored")]
    pub density: [f64; 2],
    /// Smaller moduli are raised to this. None: a modulus that is not above 0 is an error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub least_mpa: Option<f64>,
}

impl Material {
    /// The law applied to the scan's values as they are.
    pub fn new(law: Law) -> Self {
        Material {
            law,
            density: as_stored(),
            least_mpa: None,
        }
    }

    /// Refuses laws that are none. `poisson` is that of labels without their own.
    pub fn check(&self, poisson: f64) -> Result<()> {
        let wrong = |found: String, advice: &str| {
            Err(Error::setting("solve.material", found, advice.to_owned()))
        };
        let numbers = match &self.law {
            Law::Labels(labels) => {
                if labels.is_empty() || labels.len() > 255 {
                    return wrong(
                        format!("{} labels", labels.len()),
                        "give 1 to 255 labels, as labels:100=6829/0.3,127=10000/0.3",
                    );
                }
                for (i, label) in labels.iter().enumerate() {
                    check_solid(label.young_mpa, label.poisson.unwrap_or(poisson))?;
                    if labels[..i].iter().any(|other| other.value == label.value) {
                        return wrong(
                            format!("label {} stands there twice", label.value),
                            "give each label once",
                        );
                    }
                }
                vec![]
            }
            Law::Power {
                coefficient,
                exponent,
            } => vec![*coefficient, *exponent],
            Law::Linear { slope, intercept } => vec![*slope, *intercept],
            Law::Homminga { full, exponent } => vec![*full, *exponent],
        };
        let density = self.density;
        if numbers.iter().chain(&density).any(|v| !v.is_finite()) || density[0] == 0.0 {
            return wrong(
                format!("the law {:?} of density {density:?} is no law", self.law),
                "give finite numbers, and a slope of density other than 0",
            );
        }
        if let Law::Homminga { full, .. } = self.law
            && full <= 0.0
        {
            return wrong(
                format!("full mineralisation at {full}"),
                "give the density above 0 that has the whole modulus",
            );
        }
        match self.least_mpa {
            Some(least) if !(least > 0.0 && least.is_finite()) => wrong(
                format!("a least modulus of {least} MPa"),
                "give one above 0, or leave it out",
            ),
            _ => Ok(()),
        }
    }

    /// Young's modulus in MPa of a voxel by its value; None for a value that is no label. `full_mpa` is the tissue's.
    pub fn young_mpa(&self, value: f32, full_mpa: f64) -> Option<f64> {
        let rho = self.density[0] * f64::from(value) + self.density[1];
        let e = match &self.law {
            Law::Labels(labels) => labels[self.label(value)?].young_mpa,
            Law::Power {
                coefficient,
                exponent,
            } => coefficient * rho.max(0.0).powf(*exponent),
            Law::Linear { slope, intercept } => slope * rho + intercept,
            Law::Homminga { full, exponent } => full_mpa * (rho.max(0.0) / full).powf(*exponent),
        };
        Some(self.least_mpa.map_or(e, |least| e.max(least)))
    }

    /// Place in the table of labels; 0 for laws.
    pub fn label(&self, value: f32) -> Option<usize> {
        match &self.law {
            Law::Labels(labels) => labels.iter().position(|l| l.value as f32 == value),
            _ => Some(0),
        }
    }

    /// For the results table.
    pub fn words(&self) -> String {
        let law = match &self.law {
            Law::Labels(labels) => {
                let one = |l: &Label| match l.poisson {
                    Some(nu) => format!("{}={}/{nu}", l.value, l.young_mpa),
                    None => format!("{}={}", l.value, l.young_mpa),
                };
                let all: Vec<String> = labels.iter().map(one).collect();
                format!("labels:{}", all.join(";"))
            }
            Law::Power {
                coefficient,
                exponent,
            } => format!("power:{coefficient};{exponent}"),
            Law::Linear { slope, intercept } => format!("linear:{slope};{intercept}"),
            Law::Homminga { full, exponent } => format!("homminga:{full};{exponent}"),
        };
        match self.density == as_stored() {
            true => law,
            false => format!("{law} of {};{}", self.density[0], self.density[1]),
        }
    }
}

/// The law that [`Material::words`] said, as a reader of a paper reads it: `E = 6850 ρ^1.49`. The words themselves where there is no formula.
pub fn formula(words: &str) -> String {
    let (law, density) = match words.split_once(" of ") {
        Some((law, density)) => (law, density.split_once(';')),
        None => (words, None),
    };
    let formula = match law
        .split_once(':')
        .map(|(n, rest)| (n, rest.split_once(';')))
    {
        Some(("power", Some((c, n)))) => format!("E = {c} ρ^{n}"),
        Some(("linear", Some((a, b)))) => match b.strip_prefix('-') {
            Some(b) => format!("E = {a} ρ − {b}"),
            None => format!("E = {a} ρ + {b}"),
        },
        Some(("homminga", Some((full, n)))) => format!("E = E_full (ρ / {full})^{n}"),
        _ => return words.to_owned(),
    };
    match density {
        Some((slope, intercept)) => {
            format!("{formula}, where ρ is {slope} times the voxel's value plus {intercept}")
        }
        None => format!("{formula}, where ρ is the voxel's value"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_the_fields() {
        let e = |law, value| Material::new(law).young_mpa(value, 8748.0).unwrap();
        let power = Law::Power {
            coefficient: 6850.0,
            exponent: 1.49,
        };
        assert!((e(power.clone(), 0.5) / (6850.0 * 0.5f64.powf(1.49)) - 1.0).abs() < 1e-14);
        let mulder = Law::Linear {
            slope: 25.0,
            intercept: -5830.0,
        };
        assert_eq!(e(mulder.clone(), 800.0), 14170.0);
        let homminga = Law::Homminga {
            full: 1200.0,
            exponent: 1.7,
        };
        assert_eq!(e(homminga, 1200.0), 8748.0);
        // From HU-like values by a calibration, and raised to a least modulus.
        let material = Material {
            law: mulder,
            density: [2.0, 100.0],
            least_mpa: Some(10.0),
        };
        assert_eq!(material.young_mpa(350.0, 1.0), Some(14170.0));
        assert_eq!(material.young_mpa(0.0, 1.0), Some(10.0));
        // Negative densities have no modulus by a power, rather than NaN.
        assert_eq!(e(power, -0.5), 0.0);
    }

    #[test]
    fn a_paper_reads_formulas() {
        let mut material = Material::new(Law::Linear {
            slope: 25.0,
            intercept: -5830.0,
        });
        material.density = [0.5, 10.0];
        assert_eq!(
            formula(&material.words()),
            "E = 25 ρ − 5830, where ρ is 0.5 times the voxel's value plus 10"
        );
        let homminga = Law::Homminga {
            full: 1200.0,
            exponent: 1.7,
        };
        assert_eq!(
            formula(&Material::new(homminga).words()),
            "E = E_full (ρ / 1200)^1.7, where ρ is the voxel's value"
        );
        assert_eq!(
            formula("labels:100=5000;127=9000"),
            "labels:100=5000;127=9000"
        );
    }

    #[test]
    fn labels_are_looked_up_and_others_are_none() {
        let label = |value, young_mpa| Label {
            value,
            young_mpa,
            poisson: None,
        };
        let table = Material::new(Law::Labels(vec![label(100, 1.0), label(127, 2.0)]));
        assert_eq!(table.young_mpa(127.0, 9.0), Some(2.0));
        assert_eq!(table.young_mpa(1.0, 9.0), None);
        assert!(table.check(0.3).is_ok() && table.check(0.5).is_err());
        let twice = Material::new(Law::Labels(vec![label(100, 1.0), label(100, 2.0)]));
        assert!(twice.check(0.3).is_err());
    }
}
