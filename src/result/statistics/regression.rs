//! Owns straight-line regression by least squares.

use super::student::two_sided;
use super::{deviations, mean};
use serde::Serialize;

/// `y = intercept + slope · x`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Regression {
    /// Number of points.
    pub n: usize,
    /// In units of y over units of x.
    pub slope: f64,
    /// In units of y.
    pub intercept: f64,
    /// Coefficient of determination, 0 to 1.
    pub r2: f64,
    /// In units of the slope.
    pub slope_standard_error: f64,
    /// In units of y.
    pub intercept_standard_error: f64,
    /// Two-sided, of slope 0 and of intercept 0 (Student's t, n − 2 degrees of freedom).
    pub slope_p: f64,
    /// Two-sided p of intercept 0.
    pub intercept_p: f64,
}

/// Fits `y` on `x`. None for fewer than three points or where `x` or `y` does not vary.
pub fn regression(x: &[f64], y: &[f64]) -> Option<Regression> {
    let n = x.len();
    let (sxx, sxy, syy) = (deviations(x, x), deviations(x, y), deviations(y, y));
    if n < 3 || sxx <= 0.0 || syy <= 0.0 {
        return None;
    }
    let slope = sxy / sxx;
    let intercept = mean(y) - slope * mean(x);
    let residual: f64 = x
        .iter()
        .zip(y)
        .map(|(x, y)| (y - intercept - slope * x).powi(2))
        .sum();
    let freedom = (n - 2) as f64;
    let variance = residual / freedom;
    let slope_standard_error = (variance / sxx).sqrt();
    let intercept_standard_error = (variance * (1.0 / n as f64 + mean(x).powi(2) / sxx)).sqrt();
    Some(Regression {
        n,
        slope,
        intercept,
        r2: sxy * sxy / (sxx * syy),
        slope_standard_error,
        intercept_standard_error,
        slope_p: two_sided(slope / slope_standard_error, freedom),
        intercept_p: two_sided(intercept / intercept_standard_error, freedom),
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, B, X, close};
    use super::*;

    // tests/peers/statistics.py
    const REG_SLOPE: f64 = 551.6023166023165;
    const REG_INTERCEPT: f64 = -45.38745173745174;
    const REG_R2: f64 = 0.9682878687210843;
    const REG_SLOPE_SE: f64 = 40.7531259005101;
    const REG_INTERCEPT_SE: f64 = 8.596881326649553;
    const REG_SLOPE_P: f64 = 1.0086948211215041e-05;
    const REG_INTERCEPT_P: f64 = 0.0018660728122035157;

    #[test]
    fn a_fit_is_that_of_scipy_and_statsmodels() {
        let r = regression(&X, &A).unwrap();
        close(r.slope, REG_SLOPE);
        close(r.intercept, REG_INTERCEPT);
        close(r.r2, REG_R2);
        close(r.slope_standard_error, REG_SLOPE_SE);
        close(r.intercept_standard_error, REG_INTERCEPT_SE);
        close(r.slope_p, REG_SLOPE_P);
        close(r.intercept_p, REG_INTERCEPT_P);
    }

    #[test]
    fn an_exact_line_is_found_exactly() {
        let y: Vec<f64> = X.iter().map(|x| 2.0 * x + 1.0).collect();
        let r = regression(&X, &y).unwrap();
        assert!((r.slope - 2.0).abs() < 1e-13 && (r.intercept - 1.0).abs() < 1e-13);
        assert!((r.r2 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn what_has_no_line_has_none() {
        assert_eq!(regression(&X[..2], &B[..2]), None);
        assert_eq!(regression(&[1.0; 5], &B[..5]), None);
    }
}
