//! Owns piezoresistive bonds: micro-conductivity that follows a bond's stretch, k_e(s) = k_e0 (1 + Π s), as Diana (2023)
//! proposes after eq. 175.

/// The law of a bond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piezoresistance {
    /// Π, the change of the conductivity relative to itself per unit of stretch. Below 0 a stretched bond resists more.
    pub slope: f64,
}

impl Piezoresistance {
    /// 1 + Π s, by which a bond of stretch `stretch` conducts more than at rest. None where nothing of it would be left.
    pub fn factor(self, stretch: f64) -> Option<f64> {
        let factor = 1.0 + self.slope * stretch;
        (factor > 0.0).then_some(factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::continuum_molecular::conductivity::Conductivity;

    /// Over a whole horizon, K = (δ²h/4)∫ k n nᵀ dψ of an isotropic body becomes K (1 + Π (3 ε11 + ε22)/4) along the first
    /// axis and K Π ε12/2 across: ∫ n1⁴ = 3π/4, ∫ n1² n2² = π/4.
    #[test]
    fn a_strained_horizon_conducts_as_its_tensor() {
        let (k, slope, [e11, e22, e12]) = (2.0, -7.0, [0.01, -0.004, 0.003]);
        let law = Piezoresistance { slope };
        let micro = Conductivity::principal(k, k, 0.0)
            .and_then(|c| c.microconductivity(1.0, 2))
            .expect("an isotropic tensor");
        let n = 64;
        let mut sum = [0.0; 3];
        for i in 0..n {
            let psi = std::f64::consts::TAU * i as f64 / n as f64;
            let (y, x) = psi.sin_cos();
            let s = e11 * x * x + e22 * y * y + 2.0 * e12 * x * y;
            let weight =
                0.25 * micro.at(psi) * law.factor(s).unwrap() * std::f64::consts::TAU / n as f64;
            for (sum, nn) in sum.iter_mut().zip([x * x, y * y, x * y]) {
                *sum += weight * nn;
            }
        }
        let exact = [
            k * (1.0 + 0.25 * slope * (3.0 * e11 + e22)),
            k * (1.0 + 0.25 * slope * (e11 + 3.0 * e22)),
            0.5 * k * slope * e12,
        ];
        for (found, exact) in sum.iter().zip(exact) {
            assert!((found - exact).abs() < 1e-13, "{found} {exact}");
        }
    }

    #[test]
    fn a_bond_that_would_conduct_backwards_has_no_factor() {
        let law = Piezoresistance { slope: -50.0 };
        assert_eq!(law.factor(0.01), Some(0.5));
        assert_eq!(law.factor(0.02), None);
        assert_eq!(law.factor(f64::NAN), None);
    }
}
