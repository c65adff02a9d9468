//! Owns micro-conductivities: from a plane conductivity tensor, for any even exponent, and their calibration to a
//! stencil so that a linear field conducts exactly.

use super::bond::Bond;
use super::cosine::CosineLaw;
use super::small::solve_dense;
use crate::error::{Error, Result};

/// A symmetric positive definite conductivity `[[K11, K12], [K12, K22]]` (W/(m K), S/m, or any one unit).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conductivity {
    k: [[f64; 2]; 2],
}

impl Conductivity {
    /// # Errors
    /// If not positive definite.
    pub fn new(k11: f64, k22: f64, k12: f64) -> Result<Self> {
        if !(k11 > 0.0 && k11 * k22 > k12 * k12 && (k11 + k22).is_finite()) {
            return Err(Error::specimen(
                format!(
                    "the conductivity [[{k11}, {k12}], [{k12}, {k22}]] is not positive definite"
                ),
                "give K11, K22 > 0 and K12 with K12^2 < K11 K22",
            ));
        }
        Ok(Conductivity {
            k: [[k11, k12], [k12, k22]],
        })
    }

    /// From the conductivities along the material's axes, the first of them at `zeta`.
    pub fn principal(first: f64, second: f64, zeta: f64) -> Result<Self> {
        let (s, c) = zeta.sin_cos();
        Conductivity::new(
            first * c * c + second * s * s,
            first * s * s + second * c * c,
            (first - second) * s * c,
        )
    }

    pub fn k(&self) -> &[[f64; 2]; 2] {
        &self.k
    }

    /// Larger and smaller eigenvalue and the direction of the larger (eqs. 160-162).
    pub fn axes(&self) -> (f64, f64, f64) {
        let [[a, b], [_, d]] = self.k;
        let (mean, half) = (0.5 * (a + d), 0.5 * (a - d).hypot(2.0 * b));
        (mean + half, mean - half, 0.5 * (2.0 * b).atan2(a - d))
    }

    /// Micro-conductivity k(ψ) = k₂ + (k₁ - k₂) cosⁿ(ψ - ζ) with K = (δ²/4) ∫ k n nᵀ dψ (eqs. 144, 163), for any even
    /// exponent; the paper's eqs. 158-159, 164-165 and (with the lost slashes) 166-167 are n = 2, 4 and 12.
    /// Positive in every direction for K₁/K₂ <= n + 1.
    pub fn microconductivity(&self, horizon_mm: f64, exponent: u32) -> Result<CosineLaw> {
        let (major, minor, zeta) = self.axes();
        let scale = 4.0 / horizon_mm.powi(2);
        CosineLaw::of_second_moment(scale * major, scale * minor, exponent, zeta)
    }
}

/// D_eff = ½ Σ k(ψ) n nᵀ α Δv over a full family: what the stencil really conducts. `k` holds one value per bond.
pub fn effective(bonds: &[Bond], k: &[f64]) -> [[f64; 2]; 2] {
    let mut d = [[0.0; 2]; 2];
    for (bond, k) in bonds.iter().zip(k) {
        for (i, row) in d.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry += 0.5 * k * bond.n[i] * bond.n[j] * bond.volume_mm2;
            }
        }
    }
    d
}

/// The factors c₀ + c₁ cos 2ψ + c₂ sin 2ψ by which `k` must be multiplied for `effective` to be `wanted` exactly.
///
/// # Errors
/// If the stencil cannot carry it: fewer than three independent directions.
pub fn calibration(bonds: &[Bond], k: &[f64], wanted: &[[f64; 2]; 2]) -> Result<[f64; 3]> {
    let mut a = [[0.0; 3]; 3];
    for (bond, k) in bonds.iter().zip(k) {
        let [c, s] = bond.n;
        let basis = [1.0, c * c - s * s, 2.0 * s * c];
        for (row, moment) in a.iter_mut().zip([c * c, s * s, s * c]) {
            for (entry, b) in row.iter_mut().zip(basis) {
                *entry += 0.5 * k * moment * b * bond.volume_mm2;
            }
        }
    }
    let [[k11, k12], [_, k22]] = *wanted;
    solve_dense(a, [k11, k22, k12]).ok_or_else(|| {
        Error::specimen(
            "the stencil cannot be calibrated: its bonds do not span the plane's symmetric tensors",
            "use a horizon of at least 1.5 grid spacings",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::plane::family::Stencil;
    use crate::physics::continuum_molecular::bond::bonds;
    use std::f64::consts::PI;

    fn paper_disc() -> Conductivity {
        Conductivity::new(5.0, 1.0, 2.0).unwrap()
    }

    /// Eqs. 153-155 (n = 2), 164-165 (n = 4), 166-167 with their slashes (n = 12), and n = 34 (exact integers from a
    /// computer algebra system), δ = 1, h = 1.
    #[test]
    fn closed_forms_of_the_micro_conductivities() {
        let (a, b) = (5.0, 1.0);
        let k = |n| {
            Conductivity::new(a, b, 0.0)
                .unwrap()
                .microconductivity(1.0, n)
                .unwrap()
        };
        let check = |law: CosineLaw, k11: f64, k22: f64| {
            assert!(
                (law.first / (k11 / PI) - 1.0).abs() < 1e-12,
                "n = {}",
                law.exponent
            );
            assert!(
                (law.second / (k22 / PI) - 1.0).abs() < 1e-12,
                "n = {}",
                law.exponent
            );
        };
        check(k(2), 2.0 * (3.0 * a - b), 2.0 * (3.0 * b - a));
        let (c, d) = (5.0, 1.5);
        let four = Conductivity::new(c, d, 0.0)
            .unwrap()
            .microconductivity(1.0, 4)
            .unwrap();
        check(four, 7.0 * c - 3.0 * d, 5.0 * d - c);
        check(k(12), (991.0 * a - 595.0 * b) / 99.0, (13.0 * b - a) / 3.0);
        let k34 = 2.0 * (8_525_112_197.0 * a - 6_321_150_767.0 * b) / 1_101_980_715.0;
        check(k(34), k34, 2.0 * (35.0 * b - a) / 17.0);
    }

    #[test]
    fn principal_axes_of_the_disc() {
        let (major, minor, zeta) = paper_disc().axes();
        assert!((zeta - PI / 8.0).abs() < 1e-15);
        // Ratio 33.96 (text before eq. 169).
        assert!((major / minor - 33.97).abs() < 0.02, "{}", major / minor);
    }

    fn stencil_conductivity(m: f64, exponent: u32) -> ([[f64; 2]; 2], [f64; 3]) {
        let bonds = bonds(&Stencil::new(1.0, m, true).unwrap());
        let law = paper_disc().microconductivity(m, exponent).unwrap();
        let k: Vec<f64> = bonds.iter().map(|b| law.at(b.psi())).collect();
        (
            effective(&bonds, &k),
            calibration(&bonds, &k, paper_disc().k()).unwrap(),
        )
    }

    /// What the stencil conducts, n = 34, Hu's partial volumes (independent prototype).
    #[test]
    fn effective_conductivity_of_the_stencil() {
        for (m, k11, k12, k22) in [
            (5.0, 4.633080, 1.883008, 0.959209),
            (3.0, 3.870778, 1.611999, 0.851152),
            (8.0, 4.835878, 1.942476, 0.976822),
            (10.0, 4.910930, 1.970949, 0.989444),
            (20.0, 4.974174, 1.990843, 0.996247),
        ] {
            let (d, _) = stencil_conductivity(m, 34);
            for (found, expected) in [(d[0][0], k11), (d[0][1], k12), (d[1][1], k22)] {
                assert!(
                    (found - expected).abs() < 2e-6,
                    "m = {m}: {found} {expected}"
                );
            }
        }
    }

    /// Calibration factors (independent prototype), and that they restore the tensor exactly.
    #[test]
    fn calibration_restores_the_tensor() {
        for (m, expected) in [
            (5.0, [0.840628, 0.263793, 0.087578]),
            (3.0, [0.429456, 0.949630, 0.342621]),
        ] {
            let (_, c) = stencil_conductivity(m, 34);
            for (found, expected) in c.iter().zip(expected) {
                assert!((found - expected).abs() < 2e-6, "m = {m}: {c:?}");
            }
            let bonds = bonds(&Stencil::new(1.0, m, true).unwrap());
            let law = paper_disc().microconductivity(m, 34).unwrap();
            let k: Vec<f64> = bonds
                .iter()
                .map(|b| law.at(b.psi()) * b.second_harmonic(c))
                .collect();
            let d = effective(&bonds, &k);
            for (i, row) in d.iter().enumerate() {
                for (j, found) in row.iter().enumerate() {
                    assert!((found - paper_disc().k[i][j]).abs() < 1e-13);
                }
            }
        }
    }

    #[test]
    fn four_bonds_cannot_be_calibrated() {
        let bonds = bonds(&Stencil::new(1.0, 1.0, false).unwrap());
        let k = vec![1.0; bonds.len()];
        assert!(calibration(&bonds, &k, paper_disc().k()).is_err());
    }
}
