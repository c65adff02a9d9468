//! Owns Student's t: two-sided p, the quantile of 95 % intervals, and the noncentral distribution.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};
use statrs::function::gamma::ln_gamma;

/// Two-sided p of a t value; 0 where the fit is exact.
pub(super) fn two_sided(t: f64, freedom: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(student) if t.is_finite() => 2.0 * student.sf(t.abs()),
        _ => 0.0,
    }
}

/// The t that 5 % exceed in magnitude.
pub(super) fn quantile(freedom: f64) -> f64 {
    bisect(0.0, 1e6, |t| two_sided(t, freedom) > 0.05)
}

/// Steps of Simpson's rule for the noncentral distribution; its integrand is smooth.
const STEPS: usize = 4000;

/// P(T <= t) of the noncentral t distribution: `∫ Φ(t s − δ) g(s) ds` with `g` the density of `√(χ²/ν)`.
pub(super) fn noncentral_cdf(t: f64, freedom: f64, noncentrality: f64) -> f64 {
    let normal = Normal::standard();
    let constant = 2f64.ln() + 0.5 * freedom * (0.5 * freedom).ln() - ln_gamma(0.5 * freedom);
    let density = |s: f64| match s {
        s if s <= 0.0 && freedom > 1.0 => 0.0,
        s => {
            let power = if freedom == 1.0 {
                0.0
            } else {
                (freedom - 1.0) * s.ln()
            };
            (constant + power - 0.5 * freedom * s * s).exp()
        }
    };
    let spread = 1.0 / (2.0 * freedom).sqrt();
    let (first, last) = ((1.0 - 12.0 * spread).max(0.0), 1.0 + 12.0 * spread);
    let step = (last - first) / STEPS as f64;
    let sum: f64 = (0..=STEPS)
        .map(|i| {
            let s = first + i as f64 * step;
            let weight = match i {
                0 | STEPS => 1.0,
                i if i % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * normal.cdf(t * s - noncentrality) * density(s)
        })
        .sum();
    sum * step / 3.0
}

/// The noncentralities for which `t` lies at the 97.5th and at the 2.5th percentile: a 95 % interval.
pub(super) fn noncentrality_interval(t: f64, freedom: f64) -> [f64; 2] {
    let far = 8.0 * t.abs() + 20.0;
    [0.975, 0.025].map(|share| bisect(-far, far, |d| noncentral_cdf(t, freedom, d) > share))
}

/// Where `above` turns from true to false, to the last bit that halving gives.
fn bisect(mut low: f64, mut high: f64, above: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if above(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::super::cases::close;
    use super::*;

    // tests/peers/statistics.py
    const T_QUANTILE_7: f64 = 2.364624251592784;
    const T_QUANTILE_2_5: f64 = 3.5746548420036817;
    const NCT_CDF: f64 = 0.7235138641687227;
    const NCT_CDF_NEGATIVE: f64 = 0.13788368837898263;

    #[test]
    fn quantiles_and_the_noncentral_distribution_are_those_of_scipy() {
        close(quantile(7.0), T_QUANTILE_7);
        close(quantile(2.5), T_QUANTILE_2_5);
        close(noncentral_cdf(2.0, 5.0, 1.2), NCT_CDF);
        close(noncentral_cdf(-0.4, 14.0, 0.7), NCT_CDF_NEGATIVE);
    }

    #[test]
    fn without_noncentrality_it_is_students() {
        let student = StudentsT::new(0.0, 1.0, 9.0).unwrap();
        close(noncentral_cdf(1.3, 9.0, 0.0), student.cdf(1.3));
    }
}
