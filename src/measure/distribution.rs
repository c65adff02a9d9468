//! Owns how values are distributed: moments and percentiles, each value weighted by the volume that has it.

/// A distribution. Moments are those of the population; percentiles are the least values that at least their share of the
/// volume does not exceed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distribution {
    pub count: usize,
    pub mean: f64,
    pub sd: f64,
    /// Third central moment over the cube of `sd`; None where all values are one.
    pub skewness: Option<f64>,
    pub minimum: f64,
    pub p5: f64,
    pub p25: f64,
    pub median: f64,
    pub p75: f64,
    pub p95: f64,
    pub maximum: f64,
}

/// Spread below this share of the mean is rounding of single precision.
const ALIKE: f64 = 1e-6;

/// Of values with their volumes; None without any volume.
pub fn distribution(mut values: Vec<(f32, f32)>) -> Option<Distribution> {
    values.retain(|(value, volume)| *volume > 0.0 && value.is_finite());
    values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (first, last) = (values.first()?.0, values.last()?.0);
    let whole: f64 = values.iter().map(|v| f64::from(v.1)).sum();
    let about = |centre: f64, power: i32| {
        let part = |&(x, w): &(f32, f32)| f64::from(w) * (f64::from(x) - centre).powi(power);
        values.iter().map(part).sum::<f64>() / whole
    };
    let mean = about(0.0, 1);
    let sd = about(mean, 2).sqrt();
    let shares = [0.05, 0.25, 0.5, 0.75, 0.95];
    let [p5, p25, median, p75, p95] = percentiles(&values, shares.map(|share| share * whole));
    Some(Distribution {
        count: values.len(),
        mean,
        sd,
        skewness: (sd > ALIKE * mean.abs()).then(|| about(mean, 3) / sd.powi(3)),
        minimum: f64::from(first),
        p5,
        p25,
        median,
        p75,
        p95,
        maximum: f64::from(last),
    })
}

/// Of sorted values, where the volume up to them first reaches each of the rising `volumes`.
fn percentiles<const N: usize>(sorted: &[(f32, f32)], volumes: [f64; N]) -> [f64; N] {
    let mut at = 0;
    let mut below = 0.0;
    volumes.map(|wanted| {
        // A hair less, so that a share that is met exactly counts as met.
        while at + 1 < sorted.len() && below + f64::from(sorted[at].1) < wanted * (1.0 - 1e-9) {
            below += f64::from(sorted[at].1);
            at += 1;
        }
        f64::from(sorted[at].0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hundred_numbers_have_their_moments_and_percentiles() {
        let values: Vec<(f32, f32)> = (1..=100).map(|i| (i as f32, 1.0)).collect();
        let d = distribution(values).unwrap();
        assert_eq!(
            (d.p5, d.p25, d.median, d.p75, d.p95),
            (5.0, 25.0, 50.0, 75.0, 95.0)
        );
        assert_eq!((d.minimum, d.maximum, d.count), (1.0, 100.0, 100));
        // Variance of 1 to n: (n² − 1) / 12.
        assert!((d.mean - 50.5).abs() < 1e-12 && (d.sd - (9999.0f64 / 12.0).sqrt()).abs() < 1e-12);
        assert!(d.skewness.unwrap().abs() < 1e-12);
    }

    #[test]
    fn volumes_weigh_and_one_value_has_no_skewness() {
        // Two thirds of the volume at 1, one third at 4: mean 2, sd √2, skewness 1/√2.
        let d = distribution(vec![(4.0, 1.0), (1.0, 2.0), (9.0, 0.0)]).unwrap();
        assert!((d.mean - 2.0).abs() < 1e-12 && (d.sd - 2f64.sqrt()).abs() < 1e-12);
        assert!((d.skewness.unwrap() - 0.5f64.sqrt()).abs() < 1e-12);
        assert_eq!((d.median, d.p75, d.maximum), (1.0, 4.0, 4.0));
        assert_eq!(distribution(vec![(3.0, 1.0); 5]).unwrap().skewness, None);
        assert_eq!(distribution(vec![(3.0, 0.0)]), None);
    }
}
