//! Owns how far a solution is from the field that holds its rim.

/// The field of differences, as scenes name it.
pub const DIFFERENCE: &str = "difference_from_known";

/// Differences of a solution from a known field over the free points.
pub struct Difference {
    /// Size of the difference at each point; 0 where the point is held.
    pub at: Vec<f64>,
    /// The largest of them.
    pub largest: f64,
    /// Root mean square of the differences over that of the field.
    pub relative: f64,
}

impl Difference {
    /// As columns of `history.csv`.
    pub fn numbers(&self) -> [(String, f64); 2] {
        [
            ("largest_difference_from_known_field".into(), self.largest),
            ("relative_difference_from_known_field".into(), self.relative),
        ]
    }
}

/// The difference at each of `points`; 0 where all are held.
pub fn at_points(difference: Option<Difference>, points: usize) -> Vec<f64> {
    difference.map_or_else(|| vec![0.0; points], |d| d.at)
}

/// `found` and `known` by point, compared by their first `components`; a point all of whose values are `held` does not count. None
/// where none is free.
pub fn difference<const D: usize>(
    found: &[[f64; D]],
    known: &[[f64; D]],
    held: impl Fn(usize) -> bool,
    components: usize,
) -> Option<Difference> {
    let squared = |v: [f64; D]| v.iter().take(components).map(|c| c * c).sum::<f64>();
    let (mut error, mut size, mut free) = (0.0, 0.0, false);
    let mut at = vec![0.0; found.len()];
    for (p, at) in at.iter_mut().enumerate().filter(|(p, _)| !held(*p)) {
        let off = squared(std::array::from_fn(|d| found[p][d] - known[p][d]));
        *at = off.sqrt();
        (error, size, free) = (error + off, size + squared(known[p]), true);
    }
    // Unlike the largest of two, this keeps what is not a number.
    let largest = at.iter().fold(0.0_f64, |m, &e| if m >= e { m } else { e });
    free.then(|| Difference {
        largest,
        relative: (error / size).sqrt(),
        at,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_free_points_count() {
        let (found, known) = (
            [[1.0, 0.0, 9.0], [3.0, 4.0, 0.0]],
            [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        );
        let d = difference(&found, &known, |p| p == 1, 2).unwrap();
        assert_eq!((d.largest, d.relative), (0.0, 0.0));
        let d = difference(&found, &known, |_| false, 2).unwrap();
        assert_eq!((d.largest, d.relative), (5.0, 5.0));
        assert_eq!(d.at, [0.0, 5.0]);
        assert!(difference(&found, &known, |_| true, 2).is_none());
    }
}
