//! Statistics between scans and methods, as studies of bone report them. Verified against SciPy and statsmodels by
//! `tests/peers/statistics.py`, whose values the tests here hold.

pub mod agreement;
pub mod anova;
pub mod fabric_elasticity;
pub mod holm;
pub mod mann_whitney;
pub mod quartiles;
pub mod regression;
mod student;
pub mod summary;
pub mod welch;

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// `Σ (x − x̄)(y − ȳ)`.
pub(crate) fn deviations(x: &[f64], y: &[f64]) -> f64 {
    let (mx, my) = (mean(x), mean(y));
    x.iter().zip(y).map(|(a, b)| (a - mx) * (b - my)).sum()
}

#[cfg(test)]
pub(crate) mod cases {
    //! The data of `tests/peers/statistics.py`.

    /// BV/TV of eight specimens.
    pub const X: [f64; 8] = [0.08, 0.11, 0.14, 0.17, 0.21, 0.24, 0.28, 0.33];
    /// Moduli in MPa by three methods.
    pub const A: [f64; 8] = [9.1, 17.4, 31.0, 42.2, 60.5, 81.9, 104.0, 151.3];
    pub const B: [f64; 8] = [10.2, 18.1, 29.5, 45.0, 63.8, 80.2, 110.9, 158.4];
    pub const C: [f64; 8] = [8.0, 16.6, 28.7, 41.9, 57.1, 78.8, 101.5, 149.0];

    pub fn close(found: f64, expected: f64) {
        // Both sides are double precision; 1e-9 leaves room for their order of summation.
        let error = (found - expected).abs() / expected.abs();
        assert!(error < 1e-9, "{found} is not {expected}");
    }
}
