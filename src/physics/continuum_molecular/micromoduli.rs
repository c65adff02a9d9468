//! Owns the axial and shear micromoduli k_n(ψ), k_t(ψ) of a plane elasticity tensor (eqs. 48, 49, 65-70).

use super::bond::Bond;
use super::small::solve_dense;
use super::tensor::PlaneTensor;
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// The six microelastic moduli in N/mm⁶ per mm of thickness: k_n and k_t have the angular form of Ĉ1111 and Ĉ1212.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Micromoduli {
    pub k1111: f64,
    pub k2222: f64,
    pub k1122: f64,
    pub k1212: f64,
    pub k1112: f64,
    pub k2212: f64,
}

/// A micromodulus that is negative somewhere: the pair potential is then not convex in that direction, and a solve
/// or a crack may become unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Negative {
    /// `k_n` or `k_t`.
    pub name: &'static str,
    /// The smallest value over all directions, in units of the largest k_n.
    pub relative_minimum: f64,
    /// The direction of that minimum in degrees, 0 to 180.
    pub direction_deg: f64,
}

impl Micromoduli {
    /// Inverse of the micro-macro correspondence W = (δ³/12) ∫ (k_n s² + k_t γ²) dψ (eqs. 51, 58-70), for an influence
    /// function of one. The shear deformation γ is the tensor shear ε_nt (eq. 53).
    pub fn new(tensor: &PlaneTensor, horizon_mm: f64) -> Self {
        let [[c11, c12, c16], [_, c22, c26], [_, _, c66]] = *tensor.c();
        let unit = 3.0 / (PI * horizon_mm.powi(3));
        Micromoduli {
            k1111: 4.0 * unit * (c11 - c66),
            k2222: 4.0 * unit * (c22 - c66),
            k1122: 4.0 * unit * (3.0 * c12 - c66),
            k1212: unit * (8.0 * c66 - c11 - c22 - 2.0 * c12),
            k1112: 2.0 * unit * (3.0 * c16 - c26),
            k2212: 2.0 * unit * (3.0 * c26 - c16),
        }
    }

    /// The micromoduli whose sums over a discrete full family, instead of the integrals over the horizon, give the
    /// tensor: a homogeneous strain then stores exactly its elastic energy.
    ///
    /// # Errors
    /// If the family has too few directions to tell the six moduli apart.
    pub fn calibrated(tensor: &PlaneTensor, bonds: &[Bond]) -> Result<Self> {
        let mut a = [[0.0; 6]; 6];
        for column in 0..6 {
            let unit =
                Micromoduli::from_array(std::array::from_fn(|i| f64::from(u8::from(i == column))));
            let c = unit.stiffness(bonds);
            let sums = [c[0][0], c[1][1], c[0][1], c[2][2], c[0][2], c[1][2]];
            a.iter_mut()
                .zip(sums)
                .for_each(|(row, sum)| row[column] = sum);
        }
        let [[c11, c12, c16], [_, c22, c26], [_, _, c66]] = *tensor.c();
        let moduli = solve_dense(a, [c11, c22, c12, c66, c16, c26]).ok_or_else(|| {
            Error::specimen(
                "the stencil cannot be calibrated: its bonds have too few directions",
                "use a horizon of at least 3 grid spacings",
            )
        })?;
        Ok(Micromoduli::from_array(moduli))
    }

    fn from_array([k1111, k2222, k1122, k1212, k1112, k2212]: [f64; 6]) -> Self {
        Micromoduli {
            k1111,
            k2222,
            k1122,
            k1212,
            k1112,
            k2212,
        }
    }

    /// C of a discrete full family: second derivatives of W = ¼ Σ L (k_n s² + k_t γ²) α Δv.
    pub fn stiffness(&self, bonds: &[Bond]) -> [[f64; 3]; 3] {
        let mut c = [[0.0; 3]; 3];
        for b in bonds {
            let [x, y] = b.n;
            let stretch = [x * x, y * y, x * y];
            let shear = [-x * y, x * y, 0.5 * (x * x - y * y)];
            let (kn, kt) = (self.axial(b.psi()), self.shear(b.psi()));
            let weight = 0.5 * b.length_mm * b.volume_mm2;
            for (i, row) in c.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry += weight * (kn * stretch[i] * stretch[j] + kt * shear[i] * shear[j]);
                }
            }
        }
        c
    }

    /// Axial micromodulus of bonds along `psi` (eq. 48).
    pub fn axial(&self, psi: f64) -> f64 {
        let (s, c) = psi.sin_cos();
        let (cc, ss, sc) = (c * c, s * s, s * c);
        self.k1111 * cc * cc
            + self.k2222 * ss * ss
            + (2.0 * self.k1122 + 4.0 * self.k1212) * sc * sc
            + 4.0 * (self.k1112 * cc + self.k2212 * ss) * sc
    }

    /// Shear micromodulus of bonds along `psi` (eq. 49).
    pub fn shear(&self, psi: f64) -> f64 {
        let (s, c) = psi.sin_cos();
        let (sc, cos2) = (s * c, c * c - s * s);
        (self.k1111 + self.k2222 - 2.0 * self.k1122) * sc * sc + self.k1212 * cos2 * cos2
            - 2.0 * (self.k1112 - self.k2212) * sc * cos2
    }

    /// All of them times `by`.
    pub fn scaled(self, by: f64) -> Self {
        Micromoduli::from_array(
            [
                self.k1111, self.k2222, self.k1122, self.k1212, self.k1112, self.k2212,
            ]
            .map(|k| by * k),
        )
    }
}

/// Whether k_t vanishes in every direction (Cauchy's relations hold): the model then has no rotations.
pub fn is_central(axial: impl Fn(f64) -> f64, shear: impl Fn(f64) -> f64) -> bool {
    let scale = largest(axial);
    directions().all(|psi| shear(psi).abs() <= 1e-12 * scale)
}

/// The micromoduli that are negative in some direction, if any.
pub fn negative(axial: impl Fn(f64) -> f64, shear: impl Fn(f64) -> f64) -> Vec<Negative> {
    let scale = largest(&axial);
    [("k_n", lowest(&axial)), ("k_t", lowest(shear))]
        .into_iter()
        .filter(|(_, (_, value))| *value < -1e-12 * scale)
        .map(|(name, (psi, value))| Negative {
            name,
            relative_minimum: value / scale,
            direction_deg: psi.to_degrees(),
        })
        .collect()
}

fn largest(f: impl Fn(f64) -> f64) -> f64 {
    -lowest(|psi| -f(psi)).1
}

/// Directions to search: both functions hold frequencies 0, 2 and 4 only, so a quarter degree brackets each minimum.
fn directions() -> impl Iterator<Item = f64> {
    (0..720).map(|i| f64::from(i) * PI / 720.0)
}

/// Direction and value of the minimum of `f` over half a turn, refined by one parabola through the best sample.
fn lowest(f: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = PI / 720.0;
    let best = directions()
        .min_by(|a, b| f(*a).total_cmp(&f(*b)))
        .expect("some directions");
    let (l, m, r) = (f(best - step), f(best), f(best + step));
    let curvature = l - 2.0 * m + r;
    let psi = if curvature > 0.0 {
        best + 0.5 * step * (l - r) / curvature
    } else {
        best
    };
    (psi, f(psi).min(m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::continuum_molecular::tensor::Plane;

    fn negatives(k: &Micromoduli) -> Vec<Negative> {
        negative(|psi| k.axial(psi), |psi| k.shear(psi))
    }

    fn central(k: &Micromoduli) -> bool {
        is_central(|psi| k.axial(psi), |psi| k.shear(psi))
    }

    /// W = (δ³/12) ∫ (k_n s² + k_t γ²) dψ equals ½ ε·C ε for any strain: the trapezoidal rule is exact for the
    /// trigonometric polynomials of the integrand.
    #[test]
    fn the_integrated_pair_energy_is_the_elastic_energy() {
        let horizon = 1.7_f64;
        for moduli in [
            [1.0, 1.0, 0.2, 1.0 / 3.0, 0.1, 0.2],
            [1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0],
        ] {
            let tensor = PlaneTensor::from_moduli(moduli).unwrap();
            let k = Micromoduli::new(&tensor, horizon);
            for e in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.3, -0.7, 0.4]] {
                let n = 64;
                let integral: f64 = (0..n)
                    .map(|i| {
                        let psi = 2.0 * PI * f64::from(i) / f64::from(n);
                        let (s, c) = psi.sin_cos();
                        let stretch = e[0] * c * c + e[1] * s * s + e[2] * s * c;
                        let shear = 0.5 * e[2] * (c * c - s * s) + (e[1] - e[0]) * s * c;
                        k.axial(psi) * stretch * stretch + k.shear(psi) * shear * shear
                    })
                    .sum::<f64>()
                    * 2.0
                    * PI
                    / f64::from(n);
                let w = horizon.powi(3) / 12.0 * integral;
                assert!(
                    (w - tensor.energy_density(e)).abs() < 1e-14,
                    "{moduli:?} {e:?}"
                );
            }
        }
    }

    /// Isotropy: direction-independent constants of eqs. 71, 72; k_t >= 0 for C1212 >= C1111/3 (the print has <=).
    #[test]
    fn isotropic_micromoduli_do_not_depend_on_direction() {
        let c = PlaneTensor::isotropic(4000.0, 0.2, Plane::Stress).unwrap();
        let (c11, c66) = (c.c()[0][0], c.c()[2][2]);
        let k = Micromoduli::new(&c, 2.0);
        for psi in [0.0, 0.3, 1.1, 2.9] {
            assert!((k.axial(psi) / (12.0 * (c11 - c66) / (PI * 8.0)) - 1.0).abs() < 1e-14);
            assert!((k.shear(psi) / (12.0 * (3.0 * c66 - c11) / (PI * 8.0)) - 1.0).abs() < 1e-13);
        }
        assert!(negatives(&k).is_empty() && !central(&k));
        let third = PlaneTensor::isotropic(1.0, 1.0 / 3.0, Plane::Stress).unwrap();
        assert!(central(&Micromoduli::new(&third, 1.0)));
        let quarter = PlaneTensor::isotropic(1.0, 0.25, Plane::Strain).unwrap();
        assert!(central(&Micromoduli::new(&quarter, 1.0)));
    }

    /// Calibrated, the discrete stiffness is the tensor; uncalibrated it is off by 1 to 3 per cent at m = 3.
    #[test]
    fn calibrated_micromoduli_give_the_tensor_exactly() {
        use crate::discretisation::plane::family::Stencil;
        use crate::physics::continuum_molecular::bond::bonds;
        let tensor = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
        for m in [2.0, 3.0, 5.0] {
            let family = bonds(&Stencil::new(0.4, 0.4 * m, true).unwrap());
            let off = |k: Micromoduli| {
                let c = k.stiffness(&family);
                let pairs = c.iter().flatten().zip(tensor.c().iter().flatten());
                pairs.fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()))
            };
            assert!(
                off(Micromoduli::calibrated(&tensor, &family).unwrap()) < 1e-14,
                "m = {m}"
            );
            assert!(off(Micromoduli::new(&tensor, 0.4 * m)) > 5e-3, "m = {m}");
        }
    }

    #[test]
    fn a_negative_shear_micromodulus_is_named_with_its_direction() {
        let c = PlaneTensor::isotropic(1.0, 0.4, Plane::Stress).unwrap();
        let found = negatives(&Micromoduli::new(&c, 1.0));
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].name, "k_t");
        // k_t/k_n = (3 C66 - C11)/(C11 - C66) with C66 = (1 - nu) C11/2: (0.9 - 1)/(1 - 0.3).
        assert!((found[0].relative_minimum - (-0.1 / 0.7)).abs() < 1e-12);
        // Silicon <100> in plane stress (eq. 106): k_t(45 deg) is proportional to K1111 - K1122, k_t(0) to K1212.
        let silicon = PlaneTensor::from_moduli([141.1, 141.1, 39.3, 79.6, 0.0, 0.0]).unwrap();
        let found = negatives(&Micromoduli::new(&silicon, 1.0));
        assert!(found.is_empty(), "{found:?}");
    }
}
