//! Owns the attenuation function Λ(‖ξ‖): how the bonds of a point weaken with their length (eqs. 4, 51, 56, 112).

use serde::{Deserialize, Serialize};

/// Λ over the bond's length in horizons. Micromoduli and micro-conductivities are scaled so that the body stores and conducts as much
/// as with Λ = 1; critical bond energies do not depend on the length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Attenuation {
    /// Λ = 1, as in all of the paper's examples.
    #[default]
    Constant,
    /// Λ = 1 - ξ/δ.
    Conical,
    /// Λ = 1 - (ξ/δ)².
    Parabolic,
}

impl Attenuation {
    /// Λ at a length of `ratio` horizons; 0 beyond one horizon, where partial volumes keep some bonds. Λ = 1 has no end.
    pub fn at(self, ratio: f64) -> f64 {
        match self {
            Attenuation::Constant => 1.0,
            Attenuation::Conical => (1.0 - ratio).max(0.0),
            Attenuation::Parabolic => (1.0 - ratio * ratio).max(0.0),
        }
    }

    /// (3/δ³) ∫ Λ ξ² dξ, the share of the elastic and bending energy of Λ = 1 at equal micromoduli (N of eq. 56).
    pub fn elastic_share(self) -> f64 {
        match self {
            Attenuation::Constant => 1.0,
            Attenuation::Conical => 0.25,
            Attenuation::Parabolic => 0.4,
        }
    }

    /// (2/δ²) ∫ Λ ξ dξ, the same of what is conducted.
    pub fn conducted_share(self) -> f64 {
        match self {
            Attenuation::Constant => 1.0,
            Attenuation::Conical => 1.0 / 3.0,
            Attenuation::Parabolic => 0.5,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_the_integrals_over_the_length() {
        let steps = 10_000;
        let h = 1.0 / f64::from(steps);
        let integral = |of: &dyn Fn(f64) -> f64| -> f64 {
            (0..steps).map(|i| h * of(h * (f64::from(i) + 0.5))).sum()
        };
        for law in [
            Attenuation::Constant,
            Attenuation::Conical,
            Attenuation::Parabolic,
        ] {
            let elastic = 3.0 * integral(&|x| law.at(x) * x * x);
            let conducted = 2.0 * integral(&|x| law.at(x) * x);
            assert!((elastic - law.elastic_share()).abs() < 1e-7, "{law:?}");
            assert!((conducted - law.conducted_share()).abs() < 1e-7, "{law:?}");
        }
        assert_eq!(Attenuation::Conical.at(1.1), 0.0);
    }
}
