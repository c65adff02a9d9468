//! Owns which grey values a threshold may be chosen from: padding around a round field of view and a few hot voxels say nothing
//! of bone.

use crate::mask::threshold::{self, BINS};
use rayon::prelude::*;

/// The finite values of a scan at their ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    pub min: f32,
    pub max: f32,
    /// Voxels that hold the least and the largest value.
    counts: [u64; 2],
    /// The next values inwards; those of `min` and `max` where there is one value only.
    inner: [f32; 2],
    pub finite: u64,
    pub non_finite: u64,
}

const EMPTY: Extremes = Extremes {
    min: f32::INFINITY,
    max: f32::NEG_INFINITY,
    counts: [0; 2],
    inner: [f32::INFINITY, f32::NEG_INFINITY],
    finite: 0,
    non_finite: 0,
};

/// None where no value is finite.
pub fn extremes(values: &[f32]) -> Option<Extremes> {
    // Parts that stay in the cache while they are passed twice.
    let parts = values.par_chunks(1 << 14).map(of_part);
    let found = parts.reduce(|| EMPTY, Extremes::and);
    (found.finite > 0).then_some(found)
}

/// Lanes that the compiler makes vectors of.
const LANES: usize = 16;

/// Folds `values` lane by lane, without a branch; `one` puts a value into a lane.
fn lanes<T: Copy>(
    values: &[f32],
    start: T,
    one: impl Fn(T, f32) -> T,
    both: impl Fn(T, T) -> T,
) -> T {
    let mut found = [start; LANES];
    let (whole, rest) = values.as_chunks::<LANES>();
    for part in whole {
        for (lane, v) in found.iter_mut().zip(part) {
            *lane = one(*lane, *v);
        }
    }
    for (lane, v) in found.iter_mut().zip(rest) {
        *lane = one(*lane, *v);
    }
    found.into_iter().fold(start, both)
}

fn of_part(part: &[f32]) -> Extremes {
    // Comparisons with NaN are false; infinities are no ends.
    let low = |m: f32, v: f32| if v < m && v > f32::NEG_INFINITY { v } else { m };
    let high = |m: f32, v: f32| if v > m && v < f32::INFINITY { v } else { m };
    let min = lanes(part, f32::INFINITY, low, f32::min);
    let max = lanes(part, f32::NEG_INFINITY, high, f32::max);
    let sum = |a: u32, b: u32| a + b;
    let broken = lanes(part, 0, |n, v| n + u32::from(!v.is_finite()), sum);
    let at = |end: f32| u64::from(lanes(part, 0, |n, v| n + u32::from(v == end), sum));
    let next = |m: f32, v: f32| if v > min { low(m, v) } else { m };
    let before = |m: f32, v: f32| if v < max { high(m, v) } else { m };
    Extremes {
        min,
        max,
        // Where nothing is finite the ends are infinities, and nothing is at them.
        counts: if min <= max {
            [at(min), at(max)]
        } else {
            [0; 2]
        },
        inner: [
            lanes(part, f32::INFINITY, next, f32::min),
            lanes(part, f32::NEG_INFINITY, before, f32::max),
        ],
        finite: part.len() as u64 - u64::from(broken),
        non_finite: u64::from(broken),
    }
}

impl Extremes {
    #[inline]
    fn low(&mut self, v: f32, count: u64) {
        if v < self.min {
            (self.inner[0], self.min, self.counts[0]) = (self.min, v, count);
        } else if v == self.min {
            self.counts[0] += count;
        } else {
            self.inner[0] = self.inner[0].min(v);
        }
    }

    #[inline]
    fn high(&mut self, v: f32, count: u64) {
        if v > self.max {
            (self.inner[1], self.max, self.counts[1]) = (self.max, v, count);
        } else if v == self.max {
            self.counts[1] += count;
        } else {
            self.inner[1] = self.inner[1].max(v);
        }
    }

    fn and(mut self, other: Extremes) -> Extremes {
        self.low(other.min, other.counts[0]);
        self.low(other.inner[0], 0);
        self.high(other.max, other.counts[1]);
        self.high(other.inner[1], 0);
        self.finite += other.finite;
        self.non_finite += other.non_finite;
        self
    }
}

/// A value that stands for no measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Padding {
    pub value: f32,
    pub voxels: u64,
}

/// At least this share of the voxels holds a padding value.
const PADDED: f64 = 0.01;
/// Between a padding value and the next lies at least this share of the range of the rest.
const APART: f64 = 0.2;
/// A scan of fewer different values (bins of the histogram) than this is a mask or labels.
const GREYS: usize = 16;
/// At most this share of the voxels are outliers, and they take up more than half of the range.
const OUTLYING: f64 = 1e-4;

/// Padding that no file marks, among `values`, and the range of the others.
pub fn padding(values: &[f32], ends: &Extremes) -> (Vec<Padding>, [f32; 2]) {
    let mut range = [ends.min, ends.max];
    let mut found = Vec::new();
    for side in 0..2 {
        let candidate = ends.counts[side] as f64 >= PADDED * ends.finite as f64;
        if !candidate || ends.inner[0] > ends.inner[1] {
            continue;
        }
        let mut rest = range;
        rest[side] = ends.inner[side];
        let (trimmed, occupied) = trimmed(values, rest, ends.finite);
        let apart = (f64::from(range[side]) - f64::from(ends.inner[side])).abs();
        let clear = apart > APART * (f64::from(trimmed[1]) - f64::from(trimmed[0]));
        if clear && occupied >= GREYS {
            found.push(Padding {
                value: range[side],
                voxels: ends.counts[side],
            });
            range = rest;
        }
    }
    (found, range)
}

/// The range without outliers, and how many voxels are outliers: a few values that take up most of the range.
pub fn without_outliers(values: &[f32], range: [f32; 2], finite: u64) -> ([f32; 2], u64) {
    let (trimmed, _) = trimmed(values, range, finite);
    let outliers = match trimmed == range {
        true => 0,
        false => between(values, range) - between(values, trimmed),
    };
    (trimmed, outliers)
}

/// The range without outliers, and how many bins of it hold values.
fn trimmed(values: &[f32], mut range: [f32; 2], finite: u64) -> ([f32; 2], usize) {
    let few = (OUTLYING * finite as f64).ceil() as u64;
    // Each pass leaves out more than half of the range: it ends.
    loop {
        if range[0] >= range[1] {
            return (range, 1);
        }
        let counts = counted(values, range);
        let occupied = counts.iter().filter(|c| **c > 0).count();
        let edge = |bin: usize| {
            let width = (f64::from(range[1]) - f64::from(range[0])) / BINS as f64;
            (f64::from(range[0]) + bin as f64 * width) as f32
        };
        let (top, bottom) = (kept(counts.iter().rev(), few), kept(counts.iter(), few));
        // A scan of a few voxels has no outliers.
        if finite < 1000 {
            return (range, occupied);
        }
        if top > BINS / 2 {
            range[1] = edge(BINS - top);
        } else if bottom > BINS / 2 {
            range[0] = edge(bottom);
        } else {
            return (range, occupied);
        }
    }
}

/// Bins at one end that together hold at most `few` voxels.
fn kept<'a>(counts: impl Iterator<Item = &'a u64>, few: u64) -> usize {
    let mut sum = 0;
    let within = |count: &&u64| {
        sum += **count;
        sum <= few
    };
    counts.take_while(within).count()
}

fn counted(values: &[f32], [low, high]: [f32; 2]) -> Vec<u64> {
    let parts = values
        .par_chunks(1 << 18)
        .map(|part| threshold::histogram(part, low, high));
    parts.reduce(
        || vec![0; BINS],
        |mut a, b| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        },
    )
}

fn between(values: &[f32], [low, high]: [f32; 2]) -> u64 {
    let parts = values.par_chunks(1 << 16);
    let count = |part: &[f32]| part.iter().filter(|v| (low..=high).contains(v)).count() as u64;
    parts.map(count).sum()
}

/// What Otsu's threshold leaves out of `voxels`, in words.
pub fn left_out(padding: &[Padding], range: [f32; 2], outliers: u64, voxels: u64) -> Vec<String> {
    let percent = |n: u64| 100.0 * n as f64 / voxels.max(1) as f64;
    let words = |p: &Padding| {
        format!(
            "Otsu's threshold leaves out {:.1} % of the voxels, which hold {}: padding, as it is far from all other values",
            percent(p.voxels),
            p.value
        )
    };
    let mut notes: Vec<String> = padding.iter().map(words).collect();
    if outliers > 0 {
        notes.push(format!(
            "Otsu's threshold leaves out {outliers} voxels of extreme values: all others lie between {} and {}",
            range[0], range[1]
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Air about 100, bone about 900, in noise of 40 to either side.
    fn scan(n: usize) -> Vec<f32> {
        let noise = |i: usize| ((i * 7919) % 81) as f32 - 40.0;
        (0..n)
            .map(|i| if i % 3 == 0 { 900.0 } else { 100.0 } + noise(i))
            .collect()
    }

    fn of(values: &[f32]) -> (Vec<Padding>, [f32; 2], u64) {
        let ends = extremes(values).unwrap();
        let (padding, range) = padding(values, &ends);
        let (range, outliers) = without_outliers(values, range, ends.finite);
        (padding, range, outliers)
    }

    #[test]
    fn ends_are_counted() {
        let values = [3.0, 1.0, f32::NAN, 1.0, 2.0, 5.0, 4.0];
        let found = extremes(&values).unwrap();
        assert_eq!((found.min, found.max, found.counts), (1.0, 5.0, [2, 1]));
        assert_eq!(
            (found.inner, found.finite, found.non_finite),
            ([2.0, 4.0], 6, 1)
        );
        assert_eq!(extremes(&[f32::NAN]), None);
        // The same in parts.
        let many: Vec<f32> = (0..300_000).map(|i| (i % 1000) as f32).collect();
        let found = extremes(&many).unwrap();
        assert_eq!((found.counts, found.inner), ([300; 2], [1.0, 998.0]));
    }

    #[test]
    fn padding_and_hot_voxels_are_left_out() {
        let plain = scan(20_000);
        let ends = extremes(&plain).unwrap();
        assert_eq!(of(&plain), (Vec::new(), [ends.min, ends.max], 0));
        let mut padded = plain.clone();
        padded.iter_mut().take(4000).for_each(|v| *v = -3024.0);
        let expected = Padding {
            value: -3024.0,
            voxels: 4000,
        };
        assert_eq!(of(&padded), (vec![expected], [ends.min, ends.max], 0));
        padded[5000] = 1e9;
        let (padding, range, outliers) = of(&padded);
        assert_eq!((padding.as_slice(), outliers), (&[expected][..], 1));
        assert!(
            range[0] == ends.min && (ends.max..1200.0).contains(&range[1]),
            "{range:?}"
        );
        let words = left_out(&padding, range, outliers, 20_000).join("; ");
        assert!(
            words.contains("20.0 % of the voxels, which hold -3024"),
            "{words}"
        );
        assert!(words.contains("1 voxels of extreme values"), "{words}");
    }

    #[test]
    fn masks_labels_and_clipped_air_are_no_padding() {
        let mask: Vec<f32> = (0..5000)
            .map(|i| if i % 3 == 0 { 255.0 } else { 0.0 })
            .collect();
        assert!(of(&mask).0.is_empty());
        let labels: Vec<f32> = (0..5000).map(|i| [0.0, 100.0, 127.0][i % 3]).collect();
        assert!(of(&labels).0.is_empty());
        let clipped: Vec<f32> = scan(20_000)
            .into_iter()
            .map(|v| (v - 100.0).max(0.0))
            .collect();
        assert!(of(&clipped).0.is_empty());
        assert_eq!(of(&[7.0; 2000]).1, [7.0; 2]);
    }
}
