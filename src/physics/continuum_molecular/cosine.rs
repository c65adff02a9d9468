//! Owns the two-parameter angular law a₂ + (a₁ - a₂) cosⁿ f(ψ - ζ) with its integrals in closed form for any even n.

use crate::error::{Error, Result};
use std::f64::consts::PI;

/// `low + (high - low) cosⁿ(frequency · (ψ - ζ))`, the form of eqs. 93, 101, 163 and 179.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CosineLaw {
    /// Value along the material's first axis (a₁).
    pub first: f64,
    /// Value along its second axis, or at 45 degrees for frequency 2 (a₂).
    pub second: f64,
    /// Even, at least 2.
    pub exponent: u32,
    /// 1, or 2 for a law that repeats every quarter turn.
    pub frequency: u32,
    /// Angle of the material's first axis.
    pub zeta: f64,
}

impl CosineLaw {
    pub fn at(&self, psi: f64) -> f64 {
        let c = (f64::from(self.frequency) * (psi - self.zeta)).cos();
        self.second + (self.first - self.second) * c.powi(self.exponent as i32)
    }

    /// The law whose second moment over all directions, ∫ k(ψ) n nᵀ dψ, has the eigenvalues `major` and `minor`
    /// along the axes at `zeta` and `zeta` + 90 degrees.
    ///
    /// # Errors
    /// An exponent that is odd or zero.
    pub fn of_second_moment(major: f64, minor: f64, exponent: u32, zeta: f64) -> Result<Self> {
        even(exponent)?;
        let along = full_cosine(exponent + 2);
        let across = full_cosine(exponent) - along;
        let span = (major - minor) / (along - across);
        let second = (major - span * along) / PI;
        Ok(CosineLaw {
            first: second + span,
            second,
            exponent,
            frequency: 1,
            zeta,
        })
    }
}

/// ∫ cosⁿ over a full turn, n even: 2π (n-1)!!/n!!.
pub fn full_cosine(n: u32) -> f64 {
    (1..=n / 2)
        .map(|i| f64::from(2 * i - 1) / f64::from(2 * i))
        .product::<f64>()
        * 2.0
        * PI
}

/// ∫ cosⁿ⁺¹ over -π/2 .. π/2, n even: 2 n!!/(n+1)!!.
pub fn half_cosine(n: u32) -> f64 {
    (1..=n / 2)
        .map(|i| f64::from(2 * i) / f64::from(2 * i + 1))
        .product::<f64>()
        * 2.0
}

/// Refuses an exponent for which the law is not the same in opposite directions.
pub fn even(exponent: u32) -> Result<()> {
    if exponent == 0 || exponent % 2 == 1 || exponent > 1000 {
        return Err(Error::setting(
            "exponent",
            format!("n = {exponent}"),
            "an even exponent from 2 to 1000: opposite directions are one bond",
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_integrals_match_the_trapezoidal_rule() {
        for n in [2, 4, 12, 34] {
            let steps = 4096;
            let turn: f64 = (0..steps)
                .map(|i| {
                    (2.0 * PI * f64::from(i) / f64::from(steps))
                        .cos()
                        .powi(n as i32)
                })
                .sum::<f64>()
                * 2.0
                * PI
                / f64::from(steps);
            assert!((full_cosine(n) - turn).abs() < 1e-13 * turn, "n = {n}");
            // |cos|^(n+1) over a full turn is twice the half turn.
            let half: f64 = (0..steps)
                .map(|i| {
                    (PI * (f64::from(i) + 0.5) / f64::from(steps) - PI / 2.0)
                        .cos()
                        .powi(n as i32 + 1)
                })
                .sum::<f64>()
                * PI
                / f64::from(steps);
            assert!((half_cosine(n) - half).abs() < 1e-6 * half, "n = {n}");
        }
    }

    #[test]
    fn odd_exponents_are_refused() {
        assert!(CosineLaw::of_second_moment(2.0, 1.0, 3, 0.0).is_err());
        assert!(CosineLaw::of_second_moment(2.0, 1.0, 0, 0.0).is_err());
    }
}
