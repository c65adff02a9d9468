//! Owns the share of each bond direction in the fracture energy of straight lines across the grid.

use crate::topology::family::Stencil;
use std::collections::BTreeMap;

/// Factors, one per bond of the stencil, for the critical bond energies w_c(ψ).
///
/// A line at angle θ breaks Σ w_c α Δ² |ξ × t| per unit length (t along the line, each bond once): a sum over the
/// few directions of the stencil that stands for G(θ) = (δ³/3) ∫ w_c(ψ) |sin(ψ - θ)| dψ over half a turn. It has a kink
/// at every bond direction, the deepest at (1, 0) and (1, 1), which carry all multiples of their shortest bond. The
/// factors give each direction the weight of its sector, halfway to its neighbours, so that the sum is a quadrature
/// of that integral (the Cauchy-Crofton weights of Boykov and Kolmogorov, ICCV 2003).
pub fn sector_factors(stencil: &Stencil) -> Vec<f64> {
    let primitive = |offset: [i32; 2]| {
        let [x, y] = offset.map(|k| k / divisor(offset[0], offset[1]));
        if y < 0 || (y == 0 && x < 0) {
            [-x, -y]
        } else {
            [x, y]
        }
    };
    // What the bonds of one direction add to ∫ dL L² = δ³/3, in cubes of the spacing; both ends of a line counted.
    let mut weights: BTreeMap<[i32; 2], f64> = BTreeMap::new();
    for b in &stencil.bonds {
        let length = f64::from(b.offset[0]).hypot(f64::from(b.offset[1]));
        *weights.entry(primitive(b.offset)).or_default() += 0.5 * length * b.share;
    }
    let angle = |d: &[i32; 2]| f64::from(d[1]).atan2(f64::from(d[0]));
    let mut directions: Vec<([i32; 2], f64)> = weights.keys().map(|d| (*d, angle(d))).collect();
    directions.sort_by(|a, b| a.1.total_cmp(&b.1));
    let n = directions.len();
    let whole = (stencil.horizon / stencil.spacing).powi(3) / 3.0;
    let factors: BTreeMap<[i32; 2], f64> = (0..n)
        .map(|k| {
            let half_turns = |wraps: bool| if wraps { std::f64::consts::PI } else { 0.0 };
            let after = directions[(k + 1) % n].1 + half_turns(k + 1 == n);
            let before = directions[(k + n - 1) % n].1 - half_turns(k == 0);
            let (d, _) = directions[k];
            (d, whole * 0.5 * (after - before) / weights[&d])
        })
        .collect();
    let of = |b: &crate::topology::family::Bond| factors[&primitive(b.offset)];
    stencil.bonds.iter().map(of).collect()
}

/// Greatest common divisor; at least 1.
fn divisor(a: i32, b: i32) -> i32 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a.max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::anisotropic::bond::bonds;
    use crate::physics::anisotropic::cosine::CosineLaw;
    use crate::physics::anisotropic::toughness::critical_energy;

    /// Σ w_c α Δv |ξ × t| over bonds counted once, per unit length of a line at `theta`, Δ = 1.
    fn along_a_line(m: f64, law: &CosineLaw, calibrated: bool, theta: f64) -> f64 {
        let stencil = Stencil::new(1.0, m, true).unwrap();
        let factors = sector_factors(&stencil);
        let (s, c) = theta.sin_cos();
        let bond = |(b, f): (crate::physics::anisotropic::bond::Bond, f64)| {
            let across = b.length_mm * (b.n[0] * s - b.n[1] * c).abs();
            0.5 * across * law.at(b.psi()) * b.volume_mm2 * if calibrated { f } else { 1.0 }
        };
        bonds(&stencil).into_iter().zip(factors).map(bond).sum()
    }

    /// Every direction has the weight of its sector, so that the mean over all lines is the prescribed G in closed form: the
    /// mean of |sin| is 2/π and the sectors add up to π.
    #[test]
    fn the_mean_over_all_lines_is_the_prescribed_energy() {
        for m in [3.0, 5.0, 8.0] {
            let law = critical_energy(1.3, 1.3, m, 2, 1, 0.0).unwrap();
            let stencil = Stencil::new(1.0, m, true).unwrap();
            let total: f64 = bonds(&stencil)
                .iter()
                .zip(sector_factors(&stencil))
                .map(|(b, f)| 0.5 * b.length_mm * law.at(b.psi()) * b.volume_mm2 * f)
                .sum();
            let mean = total * 2.0 / std::f64::consts::PI;
            assert!((mean / 1.3 - 1.0).abs() < 1e-13, "m = {m}: {mean}");
        }
    }

    /// Smallest and largest energy of a line at any angle, uncalibrated and calibrated (independent prototype).
    #[test]
    fn calibrated_lines_cost_nearly_the_same_at_every_angle() {
        for (m, expected) in [
            (3.0, [0.9938, 1.0277, 0.9926, 1.0056]),
            (5.0, [1.0070, 1.0181, 0.9985, 1.0034]),
            (8.0, [0.9950, 1.0002, 0.9996, 1.0015]),
        ] {
            let law = critical_energy(1.0, 1.0, m, 2, 1, 0.0).unwrap();
            let range = |calibrated: bool| {
                let at = |k: i32| f64::from(k) * std::f64::consts::FRAC_PI_2 / 1800.0;
                let all = (0..=1800).map(|k| along_a_line(m, &law, calibrated, at(k)));
                all.fold([f64::MAX, f64::MIN], |[low, high], g| {
                    [low.min(g), high.max(g)]
                })
            };
            let found = [range(false), range(true)].concat();
            for (f, e) in found.iter().zip(expected) {
                assert!((f - e).abs() < 6e-5, "m = {m}: {found:?} {expected:?}");
            }
        }
    }
}
