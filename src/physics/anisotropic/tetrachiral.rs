//! Owns the effective tensor of the tetrachiral block lattice (eqs. 86-90; Bacigalupo and Gambarotta).

use super::tensor::PlaneTensor;
use crate::error::Result;

/// Square rigid blocks of side `a`, turned by the chirality angle, joined by thin elastic interfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tetrachiral {
    /// Edge of a block in mm.
    pub block_mm: f64,
    /// β, 0 <= β < π/4.
    pub chirality: f64,
    /// Thickness of an interface in mm.
    pub interface_mm: f64,
    /// Young's modulus (MPa) and Poisson's ratio of the interfaces, in plane stress.
    pub young_mpa: f64,
    pub poisson: f64,
}

impl Tetrachiral {
    /// Distance between the centres of neighbouring blocks in mm.
    pub fn period_mm(&self) -> f64 {
        self.block_mm / self.chirality.cos()
    }

    /// The square-symmetric stiffness in MPa of the equivalent continuum.
    pub fn tensor(&self) -> Result<PlaneTensor> {
        let length = (1.0 - self.chirality.tan()) * self.block_mm;
        let kn = length / self.interface_mm * self.young_mpa / (1.0 - self.poisson * self.poisson);
        let kt = 0.5 * length / self.interface_mm * self.young_mpa / (1.0 + self.poisson);
        let (s, c) = self.chirality.sin_cos();
        let cos4 = (4.0 * self.chirality).cos();
        let d = kn - kt;
        let c11 =
            (d * d * cos4 - (kn * kn + 14.0 * kn * kt + kt * kt)) / (8.0 * (d * cos4 - (kn + kt)));
        let c66 = 0.5 * (kn * s * s + kt * c * c);
        let c12 = -d * d * c * c * s * s / (2.0 * (kt * c * c + kn * s * s));
        let c16 = 0.25 * d * (2.0 * self.chirality).sin();
        PlaneTensor::from_moduli([c11, c11, c12, c66, c16, -c16])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without chirality the blocks are a square lattice of springs: C1111 = K_n, C1212 = K_t/2, no coupling.
    #[test]
    fn without_chirality_the_interfaces_act_along_the_axes() {
        let t = Tetrachiral {
            block_mm: 20.0,
            chirality: 0.0,
            interface_mm: 0.04,
            young_mpa: 10.0,
            poisson: 0.3,
        };
        let c = *t.tensor().unwrap().c();
        let kn = 500.0 * 10.0 / 0.91;
        let kt = 500.0 * 10.0 / 2.6;
        assert!((c[0][0] / kn - 1.0).abs() < 1e-12);
        assert!((c[2][2] / (0.5 * kt) - 1.0).abs() < 1e-12);
        assert!(c[0][1].abs() + c[0][2].abs() < 1e-9);
    }
}
