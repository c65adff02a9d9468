//! Owns the agreement of two methods (Bland and Altman 1986, <https://doi.org/10.1016/S0140-6736(86)90837-8>).

use super::regression::regression;
use super::student::two_sided;
use super::{deviations, mean};
use serde::Serialize;

/// Differences `a − b` of pairs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Agreement {
    /// Number of pairs.
    pub n: usize,
    /// Mean difference.
    pub bias: f64,
    /// Standard deviation of the differences.
    pub sd: f64,
    /// Limits of agreement: bias ∓ 1.96 sd.
    pub lower_limit: f64,
    /// Bias plus 1.96 sd.
    pub upper_limit: f64,
    /// Two-sided paired t test of bias 0; None where the differences do not vary, so that there is nothing to test by.
    pub bias_p: Option<f64>,
    /// Differences over the mean of both, in percent: mean, standard deviation, limits of agreement.
    pub bias_percent: f64,
    /// Their standard deviation.
    pub sd_percent: f64,
    /// `bias_percent` less 1.96 `sd_percent`.
    pub lower_limit_percent: f64,
    /// `bias_percent` plus 1.96 `sd_percent`.
    pub upper_limit_percent: f64,
    /// Slope of those over the mean of both, and its two-sided p; None where there is no line.
    pub slope_percent_per_mpa: Option<f64>,
    /// Two-sided p of that slope 0.
    pub slope_p: Option<f64>,
}

/// Differences `a − b` over the mean of both, in percent.
pub fn percent_differences(a: &[f64], b: &[f64]) -> Vec<f64> {
    let percent = |(a, b): (&f64, &f64)| 200.0 * (a - b) / (a + b);
    a.iter().zip(b).map(percent).collect()
}

/// None for fewer than two pairs.
pub fn agreement(a: &[f64], b: &[f64]) -> Option<Agreement> {
    let n = a.len();
    if n < 2 {
        return None;
    }
    let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
    let bias = mean(&differences);
    let deviation = |v: &[f64]| (deviations(v, v) / (n - 1) as f64).sqrt();
    let sd = deviation(&differences);
    let percents = percent_differences(a, b);
    let (bias_percent, sd_percent) = (mean(&percents), deviation(&percents));
    let means: Vec<f64> = a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect();
    let line = regression(&means, &percents);
    Some(Agreement {
        n,
        bias,
        sd,
        lower_limit: bias - 1.96 * sd,
        upper_limit: bias + 1.96 * sd,
        bias_p: (sd > 0.0).then(|| two_sided(bias / (sd / (n as f64).sqrt()), (n - 1) as f64)),
        bias_percent,
        sd_percent,
        lower_limit_percent: bias_percent - 1.96 * sd_percent,
        upper_limit_percent: bias_percent + 1.96 * sd_percent,
        slope_percent_per_mpa: line.map(|l| l.slope),
        slope_p: line.map(|l| l.slope_p),
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, B, close};
    use super::*;

    // tests/peers/statistics.py
    const BA_BIAS: f64 = -2.3374999999999995;
    const BA_SD: f64 = 3.378054173633099;
    const BA_LOWER: f64 = -8.958486180320874;
    const BA_UPPER: f64 = 4.283486180320875;
    const BA_P: f64 = 0.09119828362586811;
    const BA_PERCENT: f64 = -3.878112994609056;
    const BA_PERCENT_SD: f64 = 5.1527252888442785;
    const BA_PERCENT_LOWER: f64 = -13.977454560743842;
    const BA_PERCENT_UPPER: f64 = 6.22122857152573;
    const BA_SLOPE: f64 = 0.005575579875633607;
    const BA_SLOPE_P: f64 = 0.8999704103211443;

    #[test]
    fn bias_and_limits_are_those_of_statsmodels() {
        let found = agreement(&A, &B).unwrap();
        close(found.bias, BA_BIAS);
        close(found.sd, BA_SD);
        close(found.lower_limit, BA_LOWER);
        close(found.upper_limit, BA_UPPER);
        close(found.bias_p.unwrap(), BA_P);
        close(found.bias_percent, BA_PERCENT);
        close(found.sd_percent, BA_PERCENT_SD);
        close(found.lower_limit_percent, BA_PERCENT_LOWER);
        close(found.upper_limit_percent, BA_PERCENT_UPPER);
        close(found.slope_percent_per_mpa.unwrap(), BA_SLOPE);
        close(found.slope_p.unwrap(), BA_SLOPE_P);
        assert_eq!(agreement(&A[..1], &B[..1]), None);
    }

    #[test]
    fn methods_that_do_not_differ_have_no_p() {
        let same = agreement(&A, &A).unwrap();
        assert_eq!((same.bias, same.sd, same.bias_p), (0.0, 0.0, None));
    }
}
