//! Owns the numbers that describe one group: mean, standard deviation, confidence interval of the mean, median.

use super::quartiles::quartiles;
use super::student::quantile;
use super::{deviations, mean};
use serde::Serialize;

/// `sd` and the interval are None for a single value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Summary {
    /// Number of values.
    pub n: usize,
    /// Mean of the values.
    pub mean: f64,
    /// Standard deviation with n − 1.
    pub sd: Option<f64>,
    /// 95 % confidence interval of the mean (Student's t).
    pub mean_low: Option<f64>,
    /// The upper end of that interval.
    pub mean_high: Option<f64>,
    /// Quartiles as in [`quartiles`].
    pub median: f64,
}

/// None for no values.
pub fn summary(values: &[f64]) -> Option<Summary> {
    let (n, mean) = (values.len(), mean(values));
    let median = quartiles(values)?.median;
    let sd = (n > 1).then(|| (deviations(values, values) / (n - 1) as f64).sqrt());
    let half = sd.map(|sd| quantile((n - 1) as f64) * sd / (n as f64).sqrt());
    Some(Summary {
        n,
        mean,
        sd,
        mean_low: half.map(|h| mean - h),
        mean_high: half.map(|h| mean + h),
        median,
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, close};
    use super::*;

    // tests/peers/statistics.py
    const SUM_MEAN: f64 = 62.175000000000004;
    const SUM_SD: f64 = 48.22138677866018;
    const SUM_LOW: f64 = 21.86091178304175;
    const SUM_HIGH: f64 = 102.48908821695827;

    #[test]
    fn mean_and_interval_are_those_of_scipy() {
        let found = summary(&A).unwrap();
        close(found.mean, SUM_MEAN);
        close(found.sd.unwrap(), SUM_SD);
        close(found.mean_low.unwrap(), SUM_LOW);
        close(found.mean_high.unwrap(), SUM_HIGH);
    }

    #[test]
    fn one_value_has_no_spread_and_none_has_nothing() {
        let one = summary(&[3.0]).unwrap();
        assert_eq!((one.n, one.mean, one.median), (1, 3.0, 3.0));
        assert_eq!((one.sd, one.mean_low), (None, None));
        assert_eq!(summary(&[]), None);
    }
}
