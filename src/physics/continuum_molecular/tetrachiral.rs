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

    /// The square-symmetric stiffness in MPa of the equivalent continuum. Eq. 87 prints cos 4β for cos 2β in its
    /// denominator: with it C1111 is not that of the lattice's energy, whose other components are those of eqs. 88-90.
    pub fn tensor(&self) -> Result<PlaneTensor> {
        let length = (1.0 - self.chirality.tan()) * self.block_mm;
        let kn = length / self.interface_mm * self.young_mpa / (1.0 - self.poisson * self.poisson);
        let kt = 0.5 * length / self.interface_mm * self.young_mpa / (1.0 + self.poisson);
        let (s, c) = self.chirality.sin_cos();
        // Of a shear along and across the interfaces, and of both together.
        let across = kn * s * s + kt * c * c;
        let both = (kn - kt) * s * c;
        let c12 = -0.5 * both * both / across;
        let c11 = kn * c * c + kt * s * s + c12;
        let (c66, c16) = (0.5 * across, 0.5 * both);
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

    /// The tensor from the lattice's energy, with chirality: neighbours one period apart along e1 and e2, interfaces turned
    /// by β, all blocks turned by the angle that makes the energy least.
    #[test]
    fn with_chirality_the_tensor_is_that_of_the_lattices_energy() {
        for degrees in [5.0_f64, 15.0, 30.0, 40.0] {
            let t = Tetrachiral {
                block_mm: 20.0,
                chirality: degrees.to_radians(),
                interface_mm: 0.04,
                young_mpa: 10.0,
                poisson: 0.3,
            };
            let (s, c) = t.chirality.sin_cos();
            let joined = (1.0 - s / c) * 20.0 / 0.04;
            let (kn, kt) = (joined * 10.0 / 0.91, joined * 10.0 / 2.6);
            // Per area, of strain and block rotation; the interface between neighbours along e has the normal e turned by β.
            let energy = |[e11, e22, e12]: [f64; 3], turn: f64| {
                let jumps = [[e11, e12 - turn], [e12 + turn, e22]];
                let normals = [[c, s], [-s, c]];
                let one = |(u, n): (&[f64; 2], &[f64; 2])| {
                    let (normal, shear) = (u[0] * n[0] + u[1] * n[1], u[1] * n[0] - u[0] * n[1]);
                    0.5 * (kn * normal * normal + kt * shear * shear)
                };
                jumps.iter().zip(&normals).map(one).sum::<f64>()
            };
            // A parabola in the rotation: its least value from three.
            let least = |e: [f64; 3]| {
                let [a, b, c] = [-1.0, 0.0, 1.0].map(|turn| energy(e, turn));
                b - (c - a) * (c - a) / (8.0 * (a + c - 2.0 * b))
            };
            let pair = |a: [f64; 3], b: [f64; 3]| {
                let sum: [f64; 3] = std::array::from_fn(|i| a[i] + b[i]);
                least(sum) - least(a) - least(b)
            };
            // Voigt strains: the shear is twice e12.
            let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
            let tensor = t.tensor().unwrap();
            let d = kn * s * s + kt * c * c;
            let b = (kn - kt) * s * c;
            let c11 = kn * c * c + kt * s * s - 0.5 * b * b / d;
            let c12 = -0.5 * b * b / d;
            let closed = [
                [c11, c12, 0.5 * b],
                [c12, c11, -0.5 * b],
                [0.5 * b, -0.5 * b, 0.5 * d],
            ];
            for i in 0..3 {
                for j in 0..3 {
                    let found = tensor.c()[i][j];
                    let lattice = match i == j {
                        true => 2.0 * least(unit[i]),
                        false => pair(unit[i], unit[j]),
                    };
                    assert!(
                        (found - lattice).abs() < 1e-10 * kn,
                        "{degrees} {i}{j}: {found} {lattice}"
                    );
                    assert!(
                        (found - closed[i][j]).abs() < 1e-10 * kn,
                        "{degrees} {i}{j}"
                    );
                }
            }
        }
    }
}
