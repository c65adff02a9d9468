//! Owns the critical bond energy w_c(ψ, ζ): from two fracture energies, for any even exponent.

use super::cosine::{CosineLaw, even, half_cosine};
use crate::error::{Error, Result};
use std::f64::consts::PI;

/// Lobes a half turn at most: far more than bonds of any stencil have directions for.
const MOST_FREQUENT: u32 = 100;

/// Half-plane integrals of the law's cosine term for a crack normal to the first axis and to the second (at 90 degrees over the
/// frequency). G = (δ³/3) ∫ w_c cos ψ dψ over -π/2 .. π/2 (eq. 92 with the inner integrals done).
fn crossing(exponent: u32, frequency: u32) -> [f64; 2] {
    match frequency {
        // cosⁿ⁺¹, and sinⁿ cos: sums of positive terms.
        1 => [half_cosine(exponent), 2.0 / f64::from(exponent + 1)],
        _ => {
            let quarter = 0.5 * PI / f64::from(frequency);
            [0.0, quarter].map(|turn| half_plane(exponent, frequency, turn))
        }
    }
}

/// ∫ cosⁿ(A(ψ + turn)) cos ψ dψ over -π/2 .. π/2, n even: the power as a sum of cosines of even multiples `m = (n - 2k) A`, each with
/// ∫ cos(mψ) cos ψ dψ = 2 cos(mπ/2)/(1 - m²).
fn half_plane(exponent: u32, frequency: u32, turn: f64) -> f64 {
    let n = exponent as i32;
    // C(n, n/2)/2ⁿ, then outwards: C(n, k-1) = C(n, k) k/(n - k + 1).
    let mut share: f64 = (1..=n / 2)
        .map(|i| f64::from(2 * i - 1) / f64::from(2 * i))
        .product();
    let mut sum = 0.0;
    for k in (0..=n / 2).rev() {
        let m = (n - 2 * k) * frequency as i32;
        let both = if m == 0 { 1.0 } else { 2.0 };
        let sign = if m % 4 == 0 { 1.0 } else { -1.0 };
        let m = f64::from(m);
        sum += both * share * (m * turn).cos() * 2.0 * sign / (1.0 - m * m);
        share *= f64::from(k) / f64::from(n - k + 1);
    }
    sum
}

/// Fracture energy (N/mm) of a straight crack whose normal is at `normal` (radians), of bonds that break at `law` (eq. 92): what
/// Figures 16 to 18 show the reciprocal of.
pub fn fracture_energy(law: &CosineLaw, horizon_mm: f64, normal: f64) -> f64 {
    let raised = half_plane(law.exponent, law.frequency, normal - law.zeta);
    horizon_mm.powi(3) / 3.0 * (2.0 * law.second + (law.first - law.second) * raised)
}

/// The critical energy density of bonds in N/mm⁵ per mm of thickness, from the fracture energies (N/mm) of a crack
/// whose plane is normal to the material's first axis (`across_first`) and to its second (`across_second`; in general, to the
/// direction at 90 degrees over `frequency`), eqs. 93-103 for any even exponent and any whole frequency (the paper's footnote 7).
///
/// # Errors
/// A frequency below 1 or above 100. If the ratio of the energies is beyond what the exponent can carry: some bonds would
/// release energy by breaking.
pub fn critical_energy(
    across_first: f64,
    across_second: f64,
    horizon_mm: f64,
    exponent: u32,
    frequency: u32,
    zeta: f64,
) -> Result<CosineLaw> {
    even(exponent)?;
    if !(1..=MOST_FREQUENT).contains(&frequency) {
        return Err(Error::setting(
            "fracture.frequency",
            format!("found {frequency}"),
            "give 1 (fracture.energy normal to the material's two axes), or a whole number to 100 (normal to its first axis, and at 90 degrees over it)",
        ));
    }
    let scale = horizon_mm.powi(3) / 3.0;
    let [a, b] = crossing(exponent, frequency);
    let span = (across_first - across_second) / (scale * (a - b));
    let second = 0.5 * (across_first / scale - span * a);
    let law = CosineLaw {
        first: second + span,
        second,
        exponent,
        frequency,
        zeta,
    };
    let floor = -1e-12 * law.first.abs().max(law.second.abs());
    if !(across_first > 0.0 && across_second > 0.0) || law.first < floor || law.second < floor {
        return Err(Error::setting(
            "fracture.energy",
            format!(
                "fracture energies {across_first} and {across_second} N/mm with exponent {exponent}: \
                 the critical bond energies are {:.4e} and {:.4e}, one of them not positive",
                law.first, law.second
            ),
            format!(
                "keep their ratio below {:.4}, or raise the exponent",
                largest_ratio(exponent, frequency)
            ),
        ));
    }
    Ok(law)
}

/// The largest ratio of the two fracture energies that an exponent carries with both critical energies positive:
/// 2, 8/3, 3.6571, 5.0922, 7.1454 for n = 2, 4, 8, 16, 32 (eq. 93).
pub fn largest_ratio(exponent: u32, frequency: u32) -> f64 {
    let [a, b] = crossing(exponent, frequency);
    (a / b).max(b / a)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Closed forms of the paper: eqs. 97-99 (frequency 1) and 103 (frequency 2), δ = 1, h = 1.
    #[test]
    fn the_papers_closed_forms() {
        let (g0, g90) = (1.3, 0.9);
        for (n, one, two) in [
            (
                2,
                3.0 * (2.0 * g0 - g90) / 2.0,
                3.0 * (2.0 * g90 - g0) / 2.0,
            ),
            (
                4,
                3.0 * (12.0 * g0 - 7.0 * g90) / 10.0,
                3.0 * (8.0 * g90 - 3.0 * g0) / 10.0,
            ),
            (
                8,
                3.0 * (280.0 * g0 - 187.0 * g90) / 186.0,
                3.0 * (128.0 * g90 - 35.0 * g0) / 186.0,
            ),
        ] {
            let law = critical_energy(g0, g90, 1.0, n, 1, 0.0).unwrap();
            assert!(
                (law.first - one).abs() < 1e-13 && (law.second - two).abs() < 1e-13,
                "n = {n}"
            );
        }
        let (g0, g45) = (1.0, 1.1);
        let law = critical_energy(g0, g45, 1.0, 4, 2, 0.0).unwrap();
        let (one, two) = (
            (208.0 * g45 - 187.0 * g0) / 14.0,
            (128.0 * g0 - 107.0 * g45) / 14.0,
        );
        // Eq. 102 inverted: 107 w1 + 208 w2 = 945 G0/2, 128 w1 + 187 w2 = 945 G45/2.
        assert!((law.first - one).abs() < 1e-12 && (law.second - two).abs() < 1e-12);
        let equal = critical_energy(2.0, 2.0, 1.5, 16, 1, 0.0).unwrap();
        assert!((equal.at(0.4) - 3.0 * 2.0 / (2.0 * 1.5_f64.powi(3))).abs() < 1e-14);
    }

    /// Largest ratios, computed independently (integrals by a computer algebra system).
    #[test]
    fn largest_ratios() {
        for (n, expected) in [
            (2, 2.0),
            (4, 2.6667),
            (8, 3.6571),
            (16, 5.0922),
            (32, 7.1454),
        ] {
            assert!((largest_ratio(n, 1) - expected).abs() < 5e-5, "n = {n}");
        }
        for (n, expected) in [(4, 1.1963), (8, 1.2464), (16, 1.2886)] {
            assert!(
                (largest_ratio(n, 2) - expected).abs() < 5e-5,
                "n = {n}: {}",
                largest_ratio(n, 2)
            );
        }
    }

    #[test]
    fn a_ratio_beyond_the_exponent_is_refused() {
        assert!(critical_energy(3.0, 1.0, 1.0, 4, 1, 0.0).is_err());
        assert!(critical_energy(2.6, 1.0, 1.0, 4, 1, 0.0).is_ok());
        let error = critical_energy(3.0, 1.0, 1.0, 4, 1, 0.0).unwrap_err();
        assert!(error.to_string().contains("fracture.energy"), "{error}");
    }

    /// Against the midpoint rule, any frequency, any turn; frequency 1 against its sums of positive terms.
    #[test]
    fn half_plane_integrals_are_those_of_a_fine_sum() {
        let steps = 20_000;
        let h = PI / f64::from(steps);
        for (n, frequency, turn) in [
            (2, 1, 0.3),
            (4, 3, 0.0),
            (8, 3, 0.7),
            (16, 4, 0.2),
            (12, 5, 1.0),
        ] {
            let sum: f64 = (0..steps)
                .map(|i| (f64::from(i) + 0.5) * h - 0.5 * PI)
                .map(|psi| (f64::from(frequency) * (psi + turn)).cos().powi(n) * psi.cos() * h)
                .sum();
            let found = half_plane(n as u32, frequency as u32, turn);
            assert!((found - sum).abs() < 1e-7, "{n} {frequency}: {found} {sum}");
        }
        for n in [2, 8, 34, 1000] {
            let [a, b] = crossing(n, 1);
            let other = [0.0, 0.5 * PI].map(|turn| half_plane(n, 1, turn));
            assert!(
                (a - other[0]).abs() < 1e-13 && (b - other[1]).abs() < 1e-13,
                "n = {n}"
            );
        }
    }

    /// Frequency 3 repeats every 60 degrees: the energies given lie at 0 and 30 degrees, and come back from the law.
    #[test]
    fn a_law_of_frequency_three_has_its_two_energies() {
        let law = critical_energy(1.0, 1.02, 1.5, 8, 3, 0.2).unwrap();
        for (turn_deg, expected) in [(0.0, 1.0), (30.0, 1.02), (60.0, 1.0), (90.0, 1.02)] {
            let found = fracture_energy(&law, 1.5, 0.2 + f64::to_radians(turn_deg));
            assert!((found - expected).abs() < 1e-13, "{turn_deg}: {found}");
        }
    }

    #[test]
    fn a_frequency_of_none_or_of_too_many_is_refused() {
        for frequency in [0, 101] {
            let error = critical_energy(1.0, 1.0, 1.0, 4, frequency, 0.0).unwrap_err();
            assert!(error.to_string().contains("fracture.frequency"), "{error}");
        }
    }
}
