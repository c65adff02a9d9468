//! Owns von Mises plasticity: `√(3/2 s:s) = σ_y + H α` (Simo & Taylor 1985, consistent tangent).

use super::{Elastic, Flow, Softening, Trial};
use serde::{Deserialize, Serialize};

/// Perfect, or hardening with the equivalent plastic strain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VonMises {
    /// Yield stress in tension and compression.
    pub yield_mpa: f64,
    /// Slope of uniaxial stress over plastic strain; 0 is perfect.
    #[serde(default)]
    pub hardening_mpa: f64,
}

impl VonMises {
    pub(super) fn wrong(&self) -> Option<&'static str> {
        let fine = self.yield_mpa > 0.0 && self.yield_mpa.is_finite();
        let hardens = self.hardening_mpa >= 0.0 && self.hardening_mpa.is_finite();
        match (fine, hardens) {
            (false, _) => Some("a yield stress is above 0 MPa"),
            (_, false) => Some("a hardening modulus is 0 MPa (perfect) or above"),
            _ => None,
        }
    }

    pub(super) fn excess(&self, trial: &Trial, hardening: f64) -> f64 {
        trial.equivalent - self.yield_mpa - self.hardening_mpa * hardening
    }

    pub(super) fn flow(&self, elastic: &Elastic, trial: &Trial, hardening: f64) -> Option<Flow> {
        let excess = self.excess(trial, hardening);
        if excess <= 0.0 {
            return None;
        }
        let shear = elastic.shear_mpa;
        let resists = 3.0 * shear + self.hardening_mpa;
        let multiplier = excess / resists;
        let shed = 3.0 * shear * multiplier / trial.equivalent;
        Some(Flow {
            deviator: 1.0 - shed,
            pressure: trial.pressure,
            multiplier,
            softening: Softening {
                deviatoric: 2.0 * shear * shed,
                n: trial.direction(),
                nn: 2.0 * shear * shed - 6.0 * shear * shear / resists,
                ni: 0.0,
                ii: 0.0,
            },
        })
    }
}
