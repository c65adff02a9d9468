//! Owns the closed-form fields at the tip of a crack in an anisotropic plane body: Lekhnitskii's roots, displacements,
//! hoop-stress criterion, energy release rate (eqs. 79-82, 109; Sih, Paris and Irwin 1965).

use super::tensor::PlaneTensor;
use faer::c64;
use std::f64::consts::PI;

/// The tip of a traction-free crack along the negative first axis. Build it from the tensor in crack-aligned axes.
#[derive(Debug, Clone, Copy)]
pub struct CrackTip {
    /// Lekhnitskii's roots with positive imaginary part.
    mu: [c64; 2],
    p: [c64; 2],
    q: [c64; 2],
    s11: f64,
    s22: f64,
}

/// Equal roots (isotropy) make the formulas 0/0: they are split by this much. Fields are even in the split, so the
/// error is of its square.
const SPLIT: f64 = 1e-4;

impl CrackTip {
    pub fn new(tensor: &PlaneTensor) -> Self {
        let s = tensor.compliance();
        let mut mu = roots(&s);
        if (mu[0] - mu[1]).norm() < SPLIT {
            let mean = (mu[0] + mu[1]) * 0.5;
            mu = [mean - SPLIT, mean + SPLIT];
        }
        CrackTip {
            mu,
            p: mu.map(|m| m * m * s[0][0] + s[0][1] - m * s[0][2]),
            q: mu.map(|m| m * s[0][1] + c64::new(s[1][1], 0.0) / m - s[1][2]),
            s11: s[0][0],
            s22: s[1][1],
        }
    }

    pub fn roots(&self) -> [c64; 2] {
        self.mu
    }

    /// Displacement in mm at `x` (mm from the tip) under K_I and K_II in MPa √mm (eqs. 80, 81).
    pub fn displacement(&self, x: [f64; 2], [k1, k2]: [f64; 2]) -> [f64; 2] {
        let [m1, m2] = self.mu;
        let z = self
            .mu
            .map(|m| (m * x[1] + x[0]).sqrt() * (2.0 / PI).sqrt());
        let component = |f: [c64; 2]| {
            let one = (m1 * f[1] * z[1] - m2 * f[0] * z[0]) / (m1 - m2);
            let two = (f[1] * z[1] - f[0] * z[0]) / (m1 - m2);
            k1 * one.re + k2 * two.re
        };
        [component(self.p), component(self.q)]
    }

    /// Infinitesimal rotation ½(∂u2/∂x1 - ∂u1/∂x2) at `x`.
    pub fn rotation(&self, x: [f64; 2], [k1, k2]: [f64; 2]) -> f64 {
        let [m1, m2] = self.mu;
        // d√z/dx1 = 1/(2√z), d√z/dx2 = μ/(2√z).
        let g = self
            .mu
            .map(|m| c64::new((2.0 / PI).sqrt() * 0.5, 0.0) / (m * x[1] + x[0]).sqrt());
        let f = [self.q[0] - self.p[0] * m1, self.q[1] - self.p[1] * m2];
        let one = (m1 * f[1] * g[1] - m2 * f[0] * g[0]) / (m1 - m2);
        let two = (f[1] * g[1] - f[0] * g[0]) / (m1 - m2);
        0.5 * (k1 * one.re + k2 * two.re)
    }

    /// Stress (σ11, σ22, σ12) in MPa at `x`.
    pub fn stress(&self, x: [f64; 2], [k1, k2]: [f64; 2]) -> [f64; 3] {
        let [m1, m2] = self.mu;
        let g = self
            .mu
            .map(|m| c64::new(1.0, 0.0) / ((m * x[1] + x[0]) * 2.0 * PI).sqrt());
        let d = m1 - m2;
        let part = |a: c64, b: c64| k1 * a.re + k2 * b.re;
        [
            part(
                m1 * m2 / d * (m2 * g[1] - m1 * g[0]),
                (m2 * m2 * g[1] - m1 * m1 * g[0]) / d,
            ),
            part((m1 * g[1] - m2 * g[0]) / d, (g[1] - g[0]) / d),
            part(m1 * m2 / d * (g[0] - g[1]), (m1 * g[0] - m2 * g[1]) / d),
        ]
    }

    /// Hoop stress intensity K_ωω = √(2πr) σ_ωω in MPa √mm on the ray at angle `omega`.
    pub fn hoop(&self, omega: f64, k: [f64; 2]) -> f64 {
        let (s, c) = omega.sin_cos();
        let [s11, s22, s12] = self.stress([c, s], k);
        (2.0 * PI).sqrt() * (s11 * s * s + s22 * c * c - 2.0 * s12 * s * c)
    }

    /// Kink angle of the maximum hoop stress criterion for uniform toughness: the ray of largest K_ωω.
    pub fn kink(&self, k: [f64; 2]) -> f64 {
        let at = |i: i32| f64::from(i) * PI / 1800.0;
        let best = (-1750..=1750)
            .max_by(|&a, &b| self.hoop(at(a), k).total_cmp(&self.hoop(at(b), k)))
            .expect("some angles");
        let (l, m, r) = (
            self.hoop(at(best - 1), k),
            self.hoop(at(best), k),
            self.hoop(at(best + 1), k),
        );
        at(best) + 0.5 * (PI / 1800.0) * (l - r) / (l - 2.0 * m + r)
    }

    /// Energy release rate in N/mm of straight extension under K_I and K_II (MPa √mm). The paper's eq. 109 holds only
    /// with the roots of the crack-aligned frame, which are used here.
    pub fn energy_release_rate(&self, [k1, k2]: [f64; 2]) -> f64 {
        let [m1, m2] = self.mu;
        let opening = -0.5 * self.s22 * k1 * ((m1 + m2) * k1 + k2) / (m1 * m2);
        let sliding = ((m1 + m2) * k2 + m1 * m2 * k1) * (0.5 * self.s11 * k2);
        opening.im + sliding.im
    }
}

/// Roots with positive imaginary part of S11 μ⁴ - 2 S16 μ³ + (2 S12 + S66) μ² - 2 S26 μ + S22 = 0 (eq. 79, whose print
/// has lost two powers of μ), by Weierstrass' simultaneous iteration.
fn roots(s: &[[f64; 3]; 3]) -> [c64; 2] {
    let a = [
        s[1][1],
        -2.0 * s[1][2],
        2.0 * s[0][1] + s[2][2],
        -2.0 * s[0][2],
    ]
    .map(|v| v / s[0][0]);
    let value = |z: c64| (((z + a[3]) * z + a[2]) * z + a[1]) * z + a[0];
    let mut z: [c64; 4] =
        std::array::from_fn(|i| c64::from_polar(a[0].powf(0.25), 0.4 + 1.5 * i as f64));
    for _ in 0..500 {
        for i in 0..4 {
            let others = (0..4)
                .filter(|&j| j != i)
                .fold(c64::new(1.0, 0.0), |p, j| p * (z[i] - z[j]));
            if others.norm() > 0.0 {
                z[i] -= value(z[i]) / others;
            }
        }
    }
    z.sort_by(|x, y| y.im.total_cmp(&x.im));
    let mut upper = [z[0], z[1]];
    upper.sort_by(|x, y| x.re.total_cmp(&y.re));
    upper
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paper() -> CrackTip {
        CrackTip::new(
            &PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap(),
        )
    }

    /// Roots and displacements of the crack-tip material, K = 1, a = 1 (independent prototype).
    #[test]
    fn roots_and_displacements() {
        let tip = paper();
        let [m1, m2] = tip.roots();
        for (found, expected) in [
            (m1.re, -0.293985),
            (m1.im, 0.710918),
            (m2.re, 0.098636),
            (m2.im, 1.509046),
        ] {
            assert!((found - expected).abs() < 2e-6, "{found} {expected}");
        }
        for (x, k, expected) in [
            ([0.5, 0.5], [1.0, 0.0], [0.54736624, 0.34042454]),
            ([-0.5, 0.01], [1.0, 0.0], [-0.20986447, 1.51363866]),
            ([0.5, 0.5], [0.0, 1.0], [1.01475821, -0.60162802]),
        ] {
            let u = tip.displacement(x, k);
            assert!(
                (u[0] - expected[0]).abs() < 2e-8 && (u[1] - expected[1]).abs() < 2e-8,
                "{u:?}"
            );
        }
    }

    #[test]
    fn faces_are_free_and_the_ligament_carries_k() {
        let tip = paper();
        for k in [[1.0, 0.0], [0.0, 1.0]] {
            for side in [1e-15, -1e-15] {
                let [_, s22, s12] = tip.stress([-0.3, side], k);
                assert!(s22.abs() < 1e-12 && s12.abs() < 1e-12, "{s22} {s12}");
            }
            let [_, s22, s12] = tip.stress([0.3, 0.0], k);
            let ahead = 1.0 / (2.0 * PI * 0.3).sqrt();
            assert!((s22 - k[0] * ahead).abs() < 1e-14 && (s12 - k[1] * ahead).abs() < 1e-14);
        }
    }

    #[test]
    fn the_rotation_is_the_curl_of_the_displacement() {
        let (tip, k, h) = (paper(), [0.7, 0.4], 1e-5);
        for x in [[0.4, 0.3], [-0.6, 0.2], [-0.2, -0.7]] {
            let d1 = [
                tip.displacement([x[0] + h, x[1]], k),
                tip.displacement([x[0] - h, x[1]], k),
            ];
            let d2 = [
                tip.displacement([x[0], x[1] + h], k),
                tip.displacement([x[0], x[1] - h], k),
            ];
            let curl = 0.5 * ((d1[0][1] - d1[1][1]) - (d2[0][0] - d2[1][0])) / (2.0 * h);
            assert!((curl - tip.rotation(x, k)).abs() < 1e-8);
        }
    }

    /// Isotropy: G = K²/E in plane stress, and the mode II kink of 70.53 degrees away from the shear.
    #[test]
    fn isotropic_limits() {
        use crate::physics::continuum_molecular::tensor::Plane;
        let tip = CrackTip::new(&PlaneTensor::isotropic(2.0, 0.3, Plane::Stress).unwrap());
        assert!((tip.energy_release_rate([3.0, 0.0]) - 4.5).abs() < 1e-6);
        assert!((tip.energy_release_rate([3.0, 1.0]) - 5.0).abs() < 1e-6);
        assert!((tip.kink([0.0, 1.0]).to_degrees() + 70.5288).abs() < 1e-2);
        assert!(tip.kink([1.0, 0.0]).abs() < 1e-6);
    }

    /// Bovine cortical bone (eq. 108): roots, and the two fracture energies of K_cl = 6.5, K_cr = 4.0 MPa √m, each with
    /// the roots of its crack-aligned frame: 2105.62 and 989.05 J/m² (checked by crack opening elsewhere).
    #[test]
    fn fracture_energies_of_bone() {
        let bone =
            PlaneTensor::from_moduli([25_000.0, 16_250.0, 5_890.0, 6_650.0, 0.0, 0.0]).unwrap();
        let along = CrackTip::new(&bone);
        let mut im = along.roots().map(|m| m.im);
        im.sort_by(f64::total_cmp);
        assert!(
            (im[0] - 0.898315).abs() < 2e-6 && (im[1] - 1.380749).abs() < 2e-6,
            "{im:?}"
        );
        // 1 MPa √m = √1000 MPa √mm; 1 N/mm = 1000 J/m².
        let root = 1000.0_f64.sqrt();
        let g90 = 1000.0 * along.energy_release_rate([4.0 * root, 0.0]);
        let across = CrackTip::new(&bone.turned(PI / 2.0));
        let g0 = 1000.0 * across.energy_release_rate([6.5 * root, 0.0]);
        assert!(
            (g90 - 989.05).abs() < 0.01 && (g0 - 2105.62).abs() < 0.01,
            "{g0} {g90}"
        );
        // The critical energies of the compact tension test, in J/m⁶ = 1e-15 N/mm⁵.
        let law =
            super::super::toughness::critical_energy(2.10562, 0.98905, 1.5, 8, 1, 0.0).unwrap();
        assert!(
            (law.first - 1.93367).abs() < 2e-5 && (law.second - 0.252816).abs() < 2e-6,
            "{law:?}"
        );
    }
}
