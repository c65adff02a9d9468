//! Owns the comparison of two independent groups that may differ in spread: Welch's t test and interval, and Hedges' g.

use super::student::{noncentrality_interval, quantile, two_sided};
use super::{deviations, mean};
use serde::Serialize;

/// Differences are `a − b`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Welch {
    /// Difference of the means.
    pub difference: f64,
    /// 95 % confidence interval of the difference of the means.
    pub difference_low: f64,
    /// The upper end of that interval.
    pub difference_high: f64,
    /// Welch's t.
    pub t: f64,
    /// Degrees of freedom (Welch and Satterthwaite).
    pub freedom: f64,
    /// Two-sided p of no difference.
    pub p: f64,
}

/// Standardised difference with its 95 % interval from the noncentral t distribution.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct HedgesG {
    /// Hedges' g.
    pub g: f64,
    /// The lower end of its interval.
    pub g_low: f64,
    /// The upper end.
    pub g_high: f64,
}

fn variance(values: &[f64]) -> f64 {
    deviations(values, values) / (values.len() - 1) as f64
}

/// None for fewer than two values of either, or where neither varies.
pub fn welch(a: &[f64], b: &[f64]) -> Option<Welch> {
    if a.len() < 2 || b.len() < 2 {
        return None;
    }
    let share = |v: &[f64]| variance(v) / v.len() as f64;
    let (sa, sb) = (share(a), share(b));
    let error = (sa + sb).sqrt();
    (error > 0.0).then_some(())?;
    let within = |s: f64, v: &[f64]| s * s / (v.len() - 1) as f64;
    let freedom = (sa + sb).powi(2) / (within(sa, a) + within(sb, b));
    let difference = mean(a) - mean(b);
    let half = quantile(freedom) * error;
    Some(Welch {
        difference,
        difference_low: difference - half,
        difference_high: difference + half,
        t: difference / error,
        freedom,
        p: two_sided(difference / error, freedom),
    })
}

/// Hedges' g, `J (x̄a − x̄b) / s` with the pooled `s` and `J = 1 − 3 / (4 n − 9)` (Hedges 1981,
/// <https://doi.org/10.3102/10769986006002107>). None as for [`welch`].
pub fn hedges_g(a: &[f64], b: &[f64]) -> Option<HedgesG> {
    if a.len() < 2 || b.len() < 2 {
        return None;
    }
    let (na, nb) = (a.len() as f64, b.len() as f64);
    let freedom = na + nb - 2.0;
    let pooled = ((deviations(a, a) + deviations(b, b)) / freedom).sqrt();
    (pooled > 0.0).then_some(())?;
    let correction = 1.0 - 3.0 / (4.0 * (na + nb) - 9.0);
    let scale = (1.0 / na + 1.0 / nb).sqrt();
    let d = (mean(a) - mean(b)) / pooled;
    let [low, high] = noncentrality_interval(d / scale, freedom).map(|t| correction * t * scale);
    Some(HedgesG {
        g: correction * d,
        g_low: low,
        g_high: high,
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, B, close};
    use super::*;

    // tests/peers/statistics.py, of A[:5] and B[3:]
    const W_DIFFERENCE: f64 = -59.62;
    const W_LOW: f64 = -114.05922401595043;
    const W_HIGH: f64 = -5.180775984049568;
    const W_T: f64 = -2.726395845879357;
    const W_FREEDOM: f64 = 5.6036699907309115;
    const W_P: f64 = 0.03682598463268629;
    const HG_G: f64 = -1.5574540576361584;
    const HG_LOW: f64 = -2.872574215748417;
    const HG_HIGH: f64 = -0.17717639877047442;

    #[test]
    fn test_and_interval_are_those_of_scipy_and_statsmodels() {
        let found = welch(&A[..5], &B[3..]).unwrap();
        close(found.difference, W_DIFFERENCE);
        close(found.difference_low, W_LOW);
        close(found.difference_high, W_HIGH);
        close(found.t, W_T);
        close(found.freedom, W_FREEDOM);
        close(found.p, W_P);
    }

    #[test]
    fn effect_size_is_that_of_statsmodels_and_its_interval_that_of_scipy() {
        let found = hedges_g(&A[..5], &B[3..]).unwrap();
        close(found.g, HG_G);
        close(found.g_low, HG_LOW);
        close(found.g_high, HG_HIGH);
    }

    #[test]
    fn groups_swapped_change_the_sign_only() {
        let (ab, ba) = (welch(&A, &B).unwrap(), welch(&B, &A).unwrap());
        assert_eq!((ab.p, ab.difference), (ba.p, -ba.difference));
        let (g, h) = (hedges_g(&A, &B).unwrap(), hedges_g(&B, &A).unwrap());
        close(g.g_low, -h.g_high);
    }

    #[test]
    fn what_does_not_vary_or_is_single_has_no_test() {
        assert_eq!(welch(&[1.0; 3], &[2.0; 4]), None);
        assert_eq!(welch(&A[..1], &B), None);
        assert_eq!(hedges_g(&[1.0; 3], &[2.0; 4]), None);
    }
}
