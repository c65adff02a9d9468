//! Owns the critical bond energy w_c(ψ, ζ): from two fracture energies, for any even exponent.

use super::cosine::{CosineLaw, even, half_cosine};
use crate::error::{Error, Result};

/// Half-plane integrals ∫ w cos ψ dψ of the law's cosine term for a crack normal to the first axis and to the second
/// (45 degrees for frequency 2). G = (δ³/3) ∫ w_c cos ψ dψ over -π/2 .. π/2 (eq. 92 with the inner integrals done).
fn crossing(exponent: u32, frequency: u32) -> [f64; 2] {
    match frequency {
        // cosⁿ⁺¹, and sinⁿ cos.
        1 => [half_cosine(exponent), 2.0 / f64::from(exponent + 1)],
        // cosⁿ(2ψ) cos ψ = (1 - 2s²)ⁿ ds by J_n = (2 (-1)ⁿ + 2n J_{n-1})/(2n + 1); sinⁿ(2ψ) cos ψ by Beta functions.
        _ => {
            let along = (1..=exponent).fold(2.0, |j, k| {
                let sign = if k % 2 == 0 { 2.0 } else { -2.0 };
                (sign + 2.0 * f64::from(k) * j) / f64::from(2 * k + 1)
            });
            [along, doubled_sine(exponent)]
        }
    }
}

/// ∫ sinⁿ(2ψ) cos ψ dψ over -π/2 .. π/2 = 2ⁿ B((n+1)/2, n/2 + 1), n even.
fn doubled_sine(n: u32) -> f64 {
    // B(x, y + 1) = B(x, y) y/(x + y), from B(x, 1) = 1/x, with y = n/2.
    let x = 0.5 * f64::from(n + 1);
    (1..=n / 2)
        .map(|y| 4.0 * f64::from(y) / (x + f64::from(y)))
        .product::<f64>()
        / x
}

/// The critical energy density of bonds in N/mm⁵ per mm of thickness, from the fracture energies (N/mm) of a crack
/// whose plane is normal to the material's first axis (`across_first`) and to its second (`across_second`; with
/// `frequency` 2: at 45 degrees), eqs. 93-103 for any even exponent.
///
/// # Errors
/// A frequency other than 1 and 2. If the ratio of the energies is beyond what the exponent can carry: some bonds would
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
    if ![1, 2].contains(&frequency) {
        return Err(Error::setting(
            "fracture.frequency",
            format!("found {frequency}"),
            "give 1 (fracture.energy normal to the material's two axes) or 2 (normal to its first axis, and at 45 degrees)",
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

    /// The integrals are known for two frequencies only.
    #[test]
    fn other_frequencies_are_refused() {
        for frequency in [0, 3, 4] {
            let error = critical_energy(1.0, 1.0, 1.0, 4, frequency, 0.0).unwrap_err();
            assert!(error.to_string().contains("fracture.frequency"), "{error}");
        }
    }
}
