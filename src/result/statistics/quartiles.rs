//! Owns the five numbers of a box plot.

use serde::Serialize;

/// Quartiles interpolate linearly between order statistics (Hyndman and Fan's type 7, the default of R and NumPy).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Default)]
pub struct Quartiles {
    /// Number of values.
    pub n: usize,
    /// Least value.
    pub min: f64,
    /// First quartile.
    pub q1: f64,
    /// Second quartile.
    pub median: f64,
    /// Third quartile.
    pub q3: f64,
    /// Largest value.
    pub max: f64,
}

/// None for no values.
pub fn quartiles(values: &[f64]) -> Option<Quartiles> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().checked_sub(1)?;
    let at = |share: f64| {
        let place = share * last as f64;
        let below = place.floor() as usize;
        let above = (below + 1).min(last);
        sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
    };
    Some(Quartiles {
        n: sorted.len(),
        min: sorted[0],
        q1: at(0.25),
        median: at(0.5),
        q3: at(0.75),
        max: sorted[last],
    })
}

#[cfg(test)]
mod tests {
    use super::super::cases::{A, close};
    use super::*;

    // tests/peers/statistics.py
    const Q_1: f64 = 27.6;
    const Q_2: f64 = 51.35;
    const Q_3: f64 = 87.42500000000001;

    #[test]
    fn quartiles_are_those_of_numpy() {
        let found = quartiles(&A).unwrap();
        close(found.q1, Q_1);
        close(found.median, Q_2);
        close(found.q3, Q_3);
        assert_eq!((found.n, found.min, found.max), (8, 9.1, 151.3));
        assert_eq!(quartiles(&[]), None);
        assert_eq!(quartiles(&[2.0]).unwrap().q3, 2.0);
    }
}
