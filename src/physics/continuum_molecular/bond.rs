//! Owns the pair as physics sees it: its geometry, its moduli, its deformation, and what it adds to a stiffness.

use crate::discretisation::plane::family::Stencil;

/// One bond of a point's family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Unit vector from the point to its neighbour.
    pub n: [f64; 2],
    pub length_mm: f64,
    /// α Δv: the part of the neighbour's cell (mm² per unit thickness) within the horizon.
    pub volume_mm2: f64,
}

impl Bond {
    pub fn psi(&self) -> f64 {
        self.n[1].atan2(self.n[0])
    }

    /// c₀ + c₁ cos 2ψ + c₂ sin 2ψ.
    pub fn second_harmonic(&self, c: [f64; 3]) -> f64 {
        let [x, y] = self.n;
        c[0] + c[1] * (x * x - y * y) + c[2] * 2.0 * x * y
    }
}

/// The bonds of a full family, in the stencil's order.
pub fn bonds(stencil: &Stencil) -> Vec<Bond> {
    let cell = stencil.spacing * stencil.spacing;
    let bond = |b: &crate::discretisation::plane::family::Bond| Bond {
        n: b.xi.map(|x| x / b.length),
        length_mm: b.length,
        volume_mm2: b.share * cell,
    };
    stencil.bonds.iter().map(bond).collect()
}

/// Elastic law of the bonds of one direction and length: N/mm⁶ per mm of thickness.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moduli {
    pub axial: f64,
    pub shear: f64,
    pub bending: f64,
}

/// The pairwise deformations of eqs. 1-3.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deformation {
    pub stretch: f64,
    /// Rotation of the bond less the mean rotation of its ends.
    pub shear: f64,
    /// Curvature in 1/mm.
    pub curvature: f64,
}

impl Bond {
    /// Deformation under the values at its ends: displacements, and the rotation if there is a third value.
    pub fn deformation<const D: usize>(&self, here: &[f64; D], there: &[f64; D]) -> Deformation {
        let [x, y] = self.n;
        let (e1, e2) = (there[0] - here[0], there[1] - here[1]);
        let [a, b] = [here, there].map(|u| u.get(2).copied().unwrap_or(0.0));
        Deformation {
            stretch: (e1 * x + e2 * y) / self.length_mm,
            shear: (e2 * x - e1 * y) / self.length_mm - 0.5 * (a + b),
            curvature: (b - a) / self.length_mm,
        }
    }

    /// Micropotential w = (L/2)(k_n s² + k_t γ² + k_b χ²) in N/mm⁵ per mm of thickness (eq. 4).
    pub fn energy(&self, k: &Moduli, d: &Deformation) -> f64 {
        0.5 * self.length_mm
            * (k.axial * d.stretch * d.stretch
                + k.shear * d.shear * d.shear
                + k.bending * d.curvature * d.curvature)
    }
}

/// What a bond from p to q adds to the rows of p: `own` to the block (p, p), `cross` to (p, q).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blocks<const D: usize> {
    pub own: [[f64; D]; D],
    pub cross: [[f64; D]; D],
}

impl<const D: usize> Blocks<D> {
    /// Force on the near end under the values at both.
    pub fn apply(&self, here: &[f64; D], there: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|i| {
            (0..D)
                .map(|j| self.own[i][j] * here[j] + self.cross[i][j] * there[j])
                .sum()
        })
    }
}

impl Bond {
    /// Elastic blocks (eq. 37 with both bonds of a pair joined), N/mm per mm of thickness, for displacements (D = 2,
    /// central forces only) or displacements and rotation (D = 3). `cell_mm2` is the volume of p.
    pub fn stiffness<const D: usize>(&self, k: &Moduli, cell_mm2: f64) -> Blocks<D> {
        let [x, y] = self.n;
        let l = self.length_mm;
        // Rows of B at p and at q: stretch, shear, curvature.
        let fit = |row: [f64; 3]| -> [f64; D] { std::array::from_fn(|d| row[d]) };
        let here = [
            [-x / l, -y / l, 0.0],
            [y / l, -x / l, -0.5],
            [0.0, 0.0, -1.0 / l],
        ]
        .map(fit);
        let there = [
            [x / l, y / l, 0.0],
            [-y / l, x / l, -0.5],
            [0.0, 0.0, 1.0 / l],
        ]
        .map(fit);
        let moduli = match D {
            2 => [k.axial, 0.0, 0.0],
            _ => [k.axial, k.shear, k.bending],
        };
        let weight = l * self.volume_mm2 * cell_mm2;
        let block = |a: &[[f64; D]; 3], b: &[[f64; D]; 3]| -> [[f64; D]; D] {
            let entry =
                |i: usize, j: usize| (0..3).map(|m| moduli[m] * a[m][i] * b[m][j]).sum::<f64>();
            std::array::from_fn(|i| std::array::from_fn(|j| weight * entry(i, j)))
        };
        Blocks {
            own: block(&here, &here),
            cross: block(&here, &there),
        }
    }

    /// Conductance blocks: k α Δv Δv/L² (eq. 132).
    pub fn conductance(&self, k: f64, cell_mm2: f64) -> Blocks<1> {
        let g = k * self.volume_mm2 * cell_mm2 / (self.length_mm * self.length_mm);
        Blocks {
            own: [[g]],
            cross: [[-g]],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::continuum_molecular::micromoduli::Micromoduli;
    use crate::physics::continuum_molecular::tensor::PlaneTensor;
    use crate::physics::continuum_molecular::toughness::critical_energy;

    fn full_family(m: f64) -> Vec<Bond> {
        bonds(&Stencil::new(1.0, m, true).unwrap())
    }

    /// Stored energy of a homogeneous strain (ε11, ε22, 2 ε12) on a full family, C_disc by polarisation.
    fn stored(tensor: &PlaneTensor, m: f64, e: [f64; 3]) -> f64 {
        let k = Micromoduli::new(tensor, m);
        full_family(m)
            .iter()
            .map(|b| {
                let [c, s] = b.n;
                let stretch = e[0] * c * c + e[1] * s * s + e[2] * s * c;
                let shear = 0.5 * e[2] * (c * c - s * s) + (e[1] - e[0]) * s * c;
                let w = k.axial(b.psi()) * stretch * stretch + k.shear(b.psi()) * shear * shear;
                0.25 * b.length_mm * w * b.volume_mm2
            })
            .sum()
    }

    /// Energy against material angle (Figure 4): the bias of the discrete family, independent prototype.
    #[test]
    fn energy_bias_over_the_material_angle() {
        let square = [1.0, 1.0, 0.2, 1.0 / 3.0, 0.0, 0.0];
        let skew = [1.0, 1.0, 0.2, 1.0 / 3.0, 0.1, 0.2];
        let table = [
            (
                square,
                3.0,
                [0.02119, 0.03671, -0.02207, 0.01139],
                [1.036711, 0.974012, 0.953112],
            ),
            (
                square,
                5.0,
                [0.01584, 0.01844, 0.01026, 0.01634],
                [1.018441, 0.965696, 0.948114],
            ),
            (
                skew,
                3.0,
                [-0.00435, 0.04434, -0.03960, 0.02188],
                [1.036711, 0.753493, 0.635779],
            ),
            (
                skew,
                5.0,
                [0.01229, 0.01950, 0.00709, 0.01824],
                [1.018441, 0.746293, 0.642023],
            ),
        ];
        for (moduli, m, bias, at) in table {
            let tensor = PlaneTensor::from_moduli(moduli).unwrap();
            let mut found = [f64::MAX, f64::MIN, f64::MAX, f64::MIN];
            for degrees in 0..=180 {
                let turned = tensor.turned(f64::from(degrees).to_radians());
                for (i, strain) in [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]].into_iter().enumerate() {
                    let ratio = stored(&turned, m, strain) / turned.energy_density(strain) - 1.0;
                    found[2 * i] = found[2 * i].min(ratio);
                    found[2 * i + 1] = found[2 * i + 1].max(ratio);
                }
            }
            for (f, e) in found.iter().zip(bias) {
                assert!((f - e).abs() < 2e-5, "m = {m}: {found:?} {bias:?}");
            }
            for (degrees, expected) in [0.0_f64, 30.0, 45.0].into_iter().zip(at) {
                let turned = tensor.turned(degrees.to_radians());
                let twice = 2.0 * stored(&turned, m, [1.0, 0.0, 0.0]);
                assert!(
                    (twice - expected).abs() < 2e-6,
                    "m = {m}, {degrees}: {twice} {expected}"
                );
            }
        }
    }

    /// C_disc of the crack-tip material, m = 5 (independent prototype).
    #[test]
    fn discrete_stiffness_of_the_crack_tip_material() {
        let tensor = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
        let w = |e| stored(&tensor, 5.0, e);
        let unit = |i: usize| std::array::from_fn(|j| f64::from(u8::from(i == j)));
        let both =
            |i: usize, k: usize| std::array::from_fn(|j| f64::from(u8::from(i == j || k == j)));
        let mixed = |i, k| w(both(i, k)) - w(unit(i)) - w(unit(k));
        for (found, expected) in [
            (2.0 * w(unit(0)), 1.017781),
            (mixed(0, 1), 0.202197),
            (mixed(0, 2), 0.102088),
            (2.0 * w(unit(1)), 0.813721),
            (mixed(1, 2), 0.167801),
            (2.0 * w(unit(2)), 0.337620),
        ] {
            assert!((found - expected).abs() < 2e-6, "{found} {expected}");
        }
    }

    /// Energy of the bonds through one lattice plane against the prescribed fracture energy (independent prototype).
    #[test]
    fn discrete_fracture_energy_of_a_lattice_plane() {
        let through = |m: f64, g0: f64, g90: f64, zeta_deg: f64| {
            let law = critical_energy(g0, g90, m, 8, 1, zeta_deg.to_radians()).unwrap();
            full_family(m)
                .iter()
                .filter(|b| b.n[0] > 0.0)
                .map(|b| (b.n[0] * b.length_mm).round() * law.at(b.psi()) * b.volume_mm2)
                .sum::<f64>()
        };
        for (m, expected) in [(3.0, 0.9938), (5.0, 1.0070), (10.0, 1.0016)] {
            assert!(
                (through(m, 1.0, 1.0, 0.0) - expected).abs() < 1e-4,
                "m = {m}"
            );
        }
        let ratio = 2.1289;
        for (m, expected) in [
            (5.0, [1.0175, 1.0110, 0.9734]),
            (3.0, [1.0432, 0.9936, 0.9033]),
        ] {
            for (zeta, expected) in [0.0, 45.0, 90.0].into_iter().zip(expected) {
                let exact = law_energy(ratio, zeta);
                let found = through(m, ratio, 1.0, zeta) / exact;
                assert!(
                    (found - expected).abs() < 1e-4,
                    "m = {m}, {zeta}: {found} {expected}"
                );
            }
        }
    }

    /// G(ζ) = (δ³/3) ∫ w_c cos ψ dψ by the midpoint rule, δ = 1 cancels.
    fn law_energy(ratio: f64, zeta_deg: f64) -> f64 {
        let law = critical_energy(ratio, 1.0, 1.0, 8, 1, zeta_deg.to_radians()).unwrap();
        let steps = 20_000;
        let h = std::f64::consts::PI / f64::from(steps);
        (0..steps)
            .map(|i| (f64::from(i) + 0.5) * h - 0.5 * std::f64::consts::PI)
            .map(|psi| law.at(psi) * psi.cos() * h / 3.0)
            .sum()
    }
}
