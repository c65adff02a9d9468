//! Owns thresholds: Otsu's choice of one, and what a histogram needs.

/// Bins of the histogram that Otsu's threshold is chosen from.
pub const BINS: usize = 4096;

/// Counts of values in equal bins between `min` and `max`; others are left out.
pub fn histogram(values: &[f32], min: f32, max: f32) -> Vec<u64> {
    let mut counts = vec![0u64; BINS];
    let scale = BINS as f64 / (f64::from(max) - f64::from(min));
    for &v in values {
        if !(min..=max).contains(&v) {
            continue;
        }
        let bin = ((f64::from(v) - f64::from(min)) * scale) as usize;
        counts[bin.min(BINS - 1)] += 1;
    }
    counts
}

/// Otsu's threshold (1979): the split of the histogram with the largest variance between the two classes. Values at
/// or above it are the upper class. None where all values are in one bin.
pub fn otsu(counts: &[u64], min: f64, max: f64) -> Option<f64> {
    let width = (max - min) / counts.len() as f64;
    let center = |b: usize| min + (b as f64 + 0.5) * width;
    let total: f64 = counts.iter().map(|&c| c as f64).sum();
    let moment: f64 = counts
        .iter()
        .enumerate()
        .map(|(b, &c)| c as f64 * center(b))
        .sum();
    let (mut below, mut moment_below) = (0.0, 0.0);
    // A run of equal maxima lies between two peaks: its middle is taken.
    let (mut best, mut first, mut last) = (0.0, None, 0);
    for (b, &c) in counts.iter().enumerate() {
        if below > 0.0 && below < total {
            let gap = moment_below / below - (moment - moment_below) / (total - below);
            let between = below * (total - below) * gap * gap;
            if between > best * (1.0 + 1e-12) {
                (best, first, last) = (between, Some(b), b);
            } else if between > best * (1.0 - 1e-12) {
                last = b;
            }
        }
        below += c as f64;
        moment_below += c as f64 * center(b);
    }
    first.map(|first| min + 0.5 * (first + last) as f64 * width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_peaks_are_split_in_the_middle_of_the_gap() {
        let values: Vec<f32> = (0..1000)
            .map(|i| if i % 4 == 0 { 90.0 } else { 10.0 })
            .collect();
        let t = otsu(&histogram(&values, 10.0, 90.0), 10.0, 90.0).unwrap();
        assert!((t - 50.0).abs() < 0.1, "{t}");
    }

    #[test]
    fn the_split_maximises_the_variance_between_classes() {
        let mut counts = vec![0u64; 16];
        for (b, c) in [(1, 40), (2, 60), (3, 35), (9, 10), (10, 22), (12, 7)] {
            counts[b] = c;
        }
        let between = |split: usize| {
            let class = |range: std::ops::Range<usize>| {
                let w: f64 = range.clone().map(|b| counts[b] as f64).sum();
                let m: f64 = range.map(|b| counts[b] as f64 * b as f64).sum();
                (w, m / w)
            };
            let ((w0, m0), (w1, m1)) = (class(0..split), class(split..16));
            w0 * w1 * (m0 - m1).powi(2)
        };
        let best = (2..13).map(between).fold(0.0, f64::max);
        let t = otsu(&counts, 0.0, 16.0).unwrap();
        assert!(
            (between(t.floor() as usize) - best).abs() < 1e-9 * best,
            "{t}"
        );
    }

    #[test]
    fn one_value_has_no_threshold() {
        assert_eq!(otsu(&histogram(&[5.0; 9], 0.0, 10.0), 0.0, 10.0), None);
    }
}
