//! Owns the plane elasticity tensor: from engineering constants or a 6 x 6 stiffness, rotated, inverted, checked.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which out-of-plane component vanishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "snake_case")]
pub enum Plane {
    #[default]
    Stress,
    Strain,
}

/// Plane stiffness in MPa, σ = C ε with σ = (σ11, σ22, σ12) and ε = (ε11, ε22, 2 ε12) (eq. 41). Symmetric and
/// positive definite by construction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneTensor {
    c: [[f64; 3]; 3],
}

impl PlaneTensor {
    /// # Errors
    /// If the tensor is not finite, not symmetric (to 1e-6 of its largest entry) or not positive definite.
    pub fn new(c: [[f64; 3]; 3]) -> Result<Self> {
        let largest = c.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
        let symmetric = (0..3).all(|i| (0..i).all(|j| (c[i][j] - c[j][i]).abs() <= 1e-6 * largest));
        if !symmetric || !c.iter().flatten().all(|v| v.is_finite()) {
            return Err(Error::specimen(
                format!("the plane stiffness {c:?} is not a finite symmetric 3 x 3 matrix"),
                "give C11, C12, C16; C12, C22, C26; C16, C26, C66 in MPa",
            ));
        }
        let minors = [
            c[0][0],
            c[0][0] * c[1][1] - c[0][1] * c[0][1],
            determinant(&c),
        ];
        if minors.iter().any(|&m| m <= 0.0) {
            return Err(Error::specimen(
                format!(
                    "the plane stiffness {c:?} MPa is not positive definite (leading minors {minors:?})"
                ),
                "check signs and the order C11, C12, C16; C12, C22, C26; C16, C26, C66; shear strains count double",
            ));
        }
        Ok(PlaneTensor {
            c: std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (c[i][j] + c[j][i]))),
        })
    }

    /// From `C1111, C2222, C1122, C1212, C1112, C2212` in MPa, the order of the paper's eqs. 65-70.
    pub fn from_moduli([c11, c22, c12, c66, c16, c26]: [f64; 6]) -> Result<Self> {
        PlaneTensor::new([[c11, c12, c16], [c12, c22, c26], [c16, c26, c66]])
    }

    /// Isotropic, from Young's modulus (MPa) and Poisson's ratio.
    pub fn isotropic(young_mpa: f64, poisson: f64, plane: Plane) -> Result<Self> {
        let (e, nu) = match plane {
            Plane::Stress => (young_mpa, poisson),
            Plane::Strain => (
                young_mpa / (1.0 - poisson * poisson),
                poisson / (1.0 - poisson),
            ),
        };
        let c11 = e / (1.0 - nu * nu);
        PlaneTensor::from_moduli([c11, c11, nu * c11, 0.5 * e / (1.0 + nu), 0.0, 0.0])
    }

    /// The cut of a three-dimensional stiffness (MPa; Voigt order 11, 22, 33, 23, 13, 12, engineering shears) to the
    /// plane of its axes `a` and `b` (0, 1, 2), which become e1 and e2. Plane stress condenses the other three
    /// stresses to zero (all of them: also the shears a non-orthotropic tensor couples), plane strain the strains.
    pub fn cut(c6: &[[f64; 6]; 6], [a, b]: [usize; 2], plane: Plane) -> Result<Self> {
        if a == b || a > 2 || b > 2 {
            return Err(Error::setting(
                "axes",
                format!("the plane of axes {a} and {b}"),
                "name two different axes of x, y, z",
            ));
        }
        let keep = [a, b, 6 - a - b];
        match plane {
            Plane::Strain => PlaneTensor::new(keep.map(|i| keep.map(|j| c6[i][j]))),
            Plane::Stress => PlaneTensor::new(condensed(c6, keep)?),
        }
    }

    /// `C[i][j]` in MPa, indices 0 (11), 1 (22), 2 (12).
    pub fn c(&self) -> &[[f64; 3]; 3] {
        &self.c
    }

    /// S = C⁻¹ in 1/MPa, in the same notation.
    pub fn compliance(&self) -> [[f64; 3]; 3] {
        let c = &self.c;
        let det = determinant(c);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let (r, s) = ((j + 1) % 3, (j + 2) % 3);
                let (t, u) = ((i + 1) % 3, (i + 2) % 3);
                (c[r][t] * c[s][u] - c[r][u] * c[s][t]) / det
            })
        })
    }

    /// The same tensor seen from axes turned by `psi`: Ĉ = Q_σ C Q_σᵀ (eqs. 43, 45).
    pub fn seen_from(&self, psi: f64) -> Self {
        let (s, c) = psi.sin_cos();
        let q = [
            [c * c, s * s, 2.0 * s * c],
            [s * s, c * c, -2.0 * s * c],
            [-s * c, s * c, c * c - s * s],
        ];
        let qc = product(&q, &self.c);
        let turned: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| qc[i][k] * q[j][k]).sum())
        });
        PlaneTensor {
            c: std::array::from_fn(|i| {
                std::array::from_fn(|j| 0.5 * (turned[i][j] + turned[j][i]))
            }),
        }
    }

    /// The tensor of the material turned by `zeta` in the fixed axes.
    pub fn turned(&self, zeta: f64) -> Self {
        self.seen_from(-zeta)
    }

    /// φ = ½ ε·C ε in N/mm² (eq. 50), ε = (ε11, ε22, 2 ε12).
    pub fn energy_density(&self, strain: [f64; 3]) -> f64 {
        0.5 * (0..3)
            .map(|i| {
                (0..3)
                    .map(|j| strain[i] * self.c[i][j] * strain[j])
                    .sum::<f64>()
            })
            .sum::<f64>()
    }
}

fn determinant(c: &[[f64; 3]; 3]) -> f64 {
    c[0][0] * (c[1][1] * c[2][2] - c[1][2] * c[2][1])
        - c[0][1] * (c[1][0] * c[2][2] - c[1][2] * c[2][0])
        + c[0][2] * (c[1][0] * c[2][1] - c[1][1] * c[2][0])
}

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

/// Schur complement of `c6` on the rows `keep`: Gaussian elimination of the other three.
fn condensed(c6: &[[f64; 6]; 6], keep: [usize; 3]) -> Result<[[f64; 3]; 3]> {
    let mut c = *c6;
    for k in (0..6).filter(|k| !keep.contains(k)) {
        if c[k][k].is_nan() || c[k][k] <= 0.0 {
            return Err(Error::specimen(
                "the 6 x 6 stiffness is not positive definite",
                "give the stiffness in MPa, Voigt order 11, 22, 33, 23, 13, 12",
            ));
        }
        let row = c[k];
        for i in (0..6).filter(|&i| i != k) {
            let factor = c[i][k] / row[k];
            for j in 0..6 {
                c[i][j] -= factor * row[j];
            }
        }
    }
    let cut = keep.map(|i| keep.map(|j| c[i][j]));
    Ok(std::array::from_fn(|i| {
        std::array::from_fn(|j| 0.5 * (cut[i][j] + cut[j][i]))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn six_isotropic(e: f64, nu: f64) -> [[f64; 6]; 6] {
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = 0.5 * e / (1.0 + nu);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| match (i < 3 && j < 3, i == j) {
                (true, true) => lambda + 2.0 * mu,
                (true, false) => lambda,
                (false, true) => mu,
                _ => 0.0,
            })
        })
    }

    /// Both cuts of an isotropic solid are the textbook plane tensors.
    #[test]
    fn cutting_an_isotropic_solid_gives_the_plane_tensors() {
        let six = six_isotropic(1000.0, 0.3);
        for plane in [Plane::Stress, Plane::Strain] {
            let expected = PlaneTensor::isotropic(1000.0, 0.3, plane).unwrap();
            for axes in [[0, 1], [1, 2], [2, 0]] {
                let cut = PlaneTensor::cut(&six, axes, plane).unwrap();
                for (a, b) in cut.c.iter().flatten().zip(expected.c.iter().flatten()) {
                    assert!(
                        (a - b).abs() < 1e-10 * 1000.0,
                        "{plane:?} {axes:?}: {a} {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn turning_there_and_back_is_the_identity_and_keeps_the_energy() {
        let c = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
        let back = c.turned(0.7).turned(-0.7);
        for (a, b) in c.c.iter().flatten().zip(back.c.iter().flatten()) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
        // The tensor seen from turned axes stores the same energy in the strain seen from them.
        let (e, psi) = ([0.3, -0.2, 0.5], 0.4_f64);
        let (s, k) = psi.sin_cos();
        let seen = [
            e[0] * k * k + e[1] * s * s + e[2] * s * k,
            e[0] * s * s + e[1] * k * k - e[2] * s * k,
            2.0 * (e[1] - e[0]) * s * k + e[2] * (k * k - s * s),
        ];
        assert!((c.energy_density(e) - c.seen_from(psi).energy_density(seen)).abs() < 1e-15);
    }

    #[test]
    fn the_compliance_is_the_inverse() {
        let c = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
        let one = product(&c.c, &c.compliance());
        for (i, row) in one.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                assert!((v - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn an_indefinite_tensor_is_refused() {
        assert!(PlaneTensor::from_moduli([1.0, 1.0, 1.2, 0.3, 0.0, 0.0]).is_err());
        assert!(PlaneTensor::from_moduli([f64::NAN, 1.0, 0.2, 0.3, 0.0, 0.0]).is_err());
    }
}
