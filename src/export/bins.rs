//! Owns stiffnesses sorted into bins, for formats that have one table entry per stiffness.

/// Stiffnesses in use, and which one each item has.
#[derive(Debug, Clone, PartialEq)]
pub struct Bins {
    /// Ascending. Each is the mean of its items, so that their sum is what it was.
    pub values: Vec<f64>,
    pub of: Vec<u32>,
    /// The largest difference of an item from its bin, over the bin.
    pub worst: f64,
}

impl Bins {
    /// As many bins as there are different values or, where there are more than `most`, up to `most` of equal width on a
    /// logarithmic scale. `values` are above 0.
    pub fn of(values: &[f64], most: usize) -> Bins {
        let mut distinct: Vec<f64> = Vec::with_capacity(most + 1);
        for &v in values {
            if let Err(at) = distinct.binary_search_by(|d| d.total_cmp(&v)) {
                distinct.insert(at, v);
                if distinct.len() > most {
                    break;
                }
            }
        }
        let raw: Vec<usize> = if distinct.len() <= most {
            let at = |v: &f64| distinct.binary_search_by(|d| d.total_cmp(v));
            values.iter().map(|v| at(v).unwrap_or(0)).collect()
        } else {
            logarithmic(values, most)
        };
        gathered(values, &raw, most.max(distinct.len()))
    }
}

fn logarithmic(values: &[f64], most: usize) -> Vec<usize> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min).ln();
    let high = values.iter().copied().fold(0.0, f64::max).ln();
    let scale = most as f64 / (high - low);
    let bin = |v: &f64| (((v.ln() - low) * scale) as usize).min(most - 1);
    values.iter().map(bin).collect()
}

/// Means of the bins that hold something, numbered again from 0.
fn gathered(values: &[f64], raw: &[usize], bins: usize) -> Bins {
    let mut sums = vec![(0.0, 0u64); bins];
    for (v, &bin) in values.iter().zip(raw) {
        sums[bin].0 += v;
        sums[bin].1 += 1;
    }
    let mut number = vec![0u32; bins];
    let mut means = Vec::new();
    for (bin, &(sum, count)) in sums.iter().enumerate().filter(|(_, s)| s.1 > 0) {
        number[bin] = means.len() as u32;
        means.push(sum / count as f64);
    }
    let of: Vec<u32> = raw.iter().map(|&bin| number[bin]).collect();
    let off = |(v, &bin): (&f64, &u32)| (v / means[bin as usize] - 1.0).abs();
    let worst = values.iter().zip(&of).map(off).fold(0.0, f64::max);
    Bins {
        values: means,
        of,
        worst,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_stay_what_they_are() {
        let bins = Bins::of(&[3.0, 1.0, 3.0, 2.0], 3);
        assert_eq!(bins.values, [1.0, 2.0, 3.0]);
        assert_eq!(bins.of, [2, 0, 2, 1]);
        assert_eq!(bins.worst, 0.0);
        assert_eq!(Bins::of(&[], 3).values, [0.0; 0]);
    }

    #[test]
    fn many_values_keep_their_sum_and_are_off_by_half_a_bin_and_little_more() {
        let values: Vec<f64> = (0..1000).map(|i| 100.0 * 1.005f64.powi(i % 500)).collect();
        let bins = Bins::of(&values, 20);
        assert_eq!(bins.values.len(), 20);
        let sum: f64 = bins.of.iter().map(|&b| bins.values[b as usize]).sum();
        assert!((sum / values.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        // A bin is a factor of 1.005^25 wide: 13 %.
        assert!(bins.worst > 0.05 && bins.worst < 0.075, "{}", bins.worst);
    }
}
