//! Owns the pair as physics sees it: direction, length and partial volume of the far point.

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

/// The full family of a point of a square grid, horizon `m` spacings, lower half first: offsets at distances up to
/// δ + Δ/2 with Hu's partial volumes α = clip((δ + Δ/2 - L)/Δ, 0, 1), or those within δ in full.
pub fn full_family(m: f64, spacing_mm: f64, partial: bool) -> Vec<Bond> {
    let reach = (m + 0.5).ceil() as i32;
    let mut bonds = Vec::new();
    for b in -reach..=reach {
        for a in -reach..=reach {
            let length = f64::from(a * a + b * b).sqrt();
            let alpha = if partial {
                (m + 0.5 - length).clamp(0.0, 1.0)
            } else {
                f64::from(u8::from(length <= m + 1e-9))
            };
            if (a, b) != (0, 0) && alpha > 1e-9 {
                bonds.push(Bond {
                    n: [f64::from(a) / length, f64::from(b) / length],
                    length_mm: length * spacing_mm,
                    volume_mm2: alpha * spacing_mm * spacing_mm,
                });
            }
        }
    }
    bonds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::anisotropic::micromoduli::Micromoduli;
    use crate::physics::anisotropic::tensor::PlaneTensor;
    use crate::physics::anisotropic::toughness::critical_energy;

    /// 96 and 36 bonds, Σα 78.126525 and 27.388070 (independent prototype; 25π = 78.5398).
    #[test]
    fn families_of_three_and_five_spacings() {
        for (m, count, sum) in [(5.0, 96, 78.126525), (3.0, 36, 27.388070)] {
            let family = full_family(m, 1.0, true);
            assert_eq!(family.len(), count);
            assert!((family.iter().map(|b| b.volume_mm2).sum::<f64>() - sum).abs() < 2e-6);
        }
    }

    /// Stored energy of a homogeneous strain (ε11, ε22, 2 ε12) on a full family, C_disc by polarisation.
    fn stored(tensor: &PlaneTensor, m: f64, e: [f64; 3]) -> f64 {
        let k = Micromoduli::new(tensor, m);
        full_family(m, 1.0, true)
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
            full_family(m, 1.0, true)
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
