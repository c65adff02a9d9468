//! Owns plasticity with unlike yield in tension and compression: the cone of Drucker & Prager (1952), `√(3/2 s:s) + a tr σ = k`,
//! through both uniaxial yield stresses; return to the cone or to its apex (de Souza Neto, Perić & Owen 2008, §8.3).
//!
//! `a = (σ_c − σ_t) / (σ_c + σ_t)`, `k = 2 σ_c σ_t / (σ_c + σ_t)`. Both yield stresses grow by the same factor.

use super::{Elastic, Flow, Softening, Trial};
use serde::{Deserialize, Serialize};

/// Perfect, or hardening with the plastic multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DruckerPrager {
    /// Yield stress in tension.
    pub tension_mpa: f64,
    /// A magnitude, not below `tension_mpa`.
    pub compression_mpa: f64,
    /// Slope of uniaxial compressive stress over plastic strain; 0 is perfect.
    #[serde(default)]
    pub hardening_mpa: f64,
}

impl DruckerPrager {
    pub(super) fn wrong(&self) -> Option<&'static str> {
        let positive = |v: f64| v > 0.0 && v.is_finite();
        if !positive(self.tension_mpa) || !positive(self.compression_mpa) {
            return Some("yield stresses in tension and compression are magnitudes above 0 MPa");
        }
        if self.tension_mpa > self.compression_mpa {
            return Some(
                "tissue stronger in tension than in compression has no such yield surface: give tension first",
            );
        }
        let hardens = self.hardening_mpa >= 0.0 && self.hardening_mpa.is_finite();
        (!hardens).then_some("a hardening modulus is 0 MPa (perfect) or above")
    }

    fn slope(&self) -> f64 {
        (self.compression_mpa - self.tension_mpa) / (self.compression_mpa + self.tension_mpa)
    }

    /// Growth of `k` with the multiplier: in uniaxial compression the plastic strain is `1 − a` of it, the stress `k / (1 − a)`.
    fn growth(&self) -> f64 {
        self.hardening_mpa * (1.0 - self.slope()).powi(2)
    }

    fn cohesion(&self, hardening: f64) -> f64 {
        let [t, c] = [self.tension_mpa, self.compression_mpa];
        2.0 * c * t / (c + t) + self.growth() * hardening
    }

    pub(super) fn excess(&self, trial: &Trial, hardening: f64) -> f64 {
        trial.equivalent + 3.0 * self.slope() * trial.pressure - self.cohesion(hardening)
    }

    pub(super) fn flow(&self, elastic: &Elastic, trial: &Trial, hardening: f64) -> Option<Flow> {
        let excess = self.excess(trial, hardening);
        if excess <= 0.0 {
            return None;
        }
        let (a, shear, bulk) = (self.slope(), elastic.shear_mpa, elastic.bulk_mpa);
        let volumetric = 9.0 * bulk * a * a;
        let resists = 3.0 * shear + volumetric + self.growth();
        let multiplier = excess / resists;
        if 3.0 * shear * multiplier > trial.equivalent {
            return Some(self.at_apex(elastic, trial, hardening));
        }
        let shed = 3.0 * shear * multiplier / trial.equivalent;
        Some(Flow {
            deviator: 1.0 - shed,
            pressure: trial.pressure - 3.0 * bulk * a * multiplier,
            multiplier,
            softening: Softening {
                deviatoric: 2.0 * shear * shed,
                n: trial.direction(),
                nn: 2.0 * shear * shed - 6.0 * shear * shear / resists,
                ni: -6f64.sqrt() * shear * 3.0 * a * bulk / resists,
                ii: -volumetric * bulk / resists,
            },
        })
    }

    /// Of a trial stress beyond the tip of the cone, where no shear is left.
    fn at_apex(&self, elastic: &Elastic, trial: &Trial, hardening: f64) -> Flow {
        let (a, bulk) = (self.slope(), elastic.bulk_mpa);
        let volumetric = 9.0 * bulk * a * a;
        let resists = volumetric + self.growth();
        let multiplier = (3.0 * a * trial.pressure - self.cohesion(hardening)) / resists;
        Flow {
            deviator: 0.0,
            pressure: trial.pressure - 3.0 * bulk * a * multiplier,
            multiplier,
            softening: Softening {
                deviatoric: 2.0 * elastic.shear_mpa,
                ii: -volumetric * bulk / resists,
                ..Softening::default()
            },
        }
    }
}
