//! Owns an elimination order for sparse factorisation from positions alone: geometric nested dissection. On wide
//! stencils its fill is a fraction of that of minimum degree.

/// Points in elimination order: `order[k]` is eliminated `k`-th. `width` is how far, along one axis, two coupled points
/// can be apart. Halves of the longer side are ordered first, the strip of `width` between them last.
///
/// # Panics
/// Never; positions must be finite.
pub fn nested_dissection(positions: &[[f64; 2]], width: f64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..positions.len()).collect();
    dissect(&mut order, positions, width);
    order
}

/// Parts smaller than this are left in their natural order; measured flat between 32 and 256.
const LEAF: usize = 64;

fn dissect(part: &mut [usize], positions: &[[f64; 2]], width: f64) {
    if part.len() <= LEAF {
        return;
    }
    let extent = |a: usize| {
        let values = part.iter().map(|&i| positions[i][a]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
        high - low
    };
    let axis = usize::from(extent(1) > extent(0));
    if extent(axis) <= 2.0 * width {
        return;
    }
    let by_axis =
        |a: &usize, b: &usize| (positions[*a][axis].total_cmp(&positions[*b][axis])).then(a.cmp(b));
    part.sort_unstable_by(by_axis);
    let middle = positions[part[part.len() / 2]][axis];
    let first = part.partition_point(|&i| positions[i][axis] < middle - 0.5 * width);
    let last = part.partition_point(|&i| positions[i][axis] < middle + 0.5 * width);
    // Lower half, separator, upper half -> lower half, upper half, separator.
    part[first..].rotate_left(last - first);
    let halves = part.len() - (last - first);
    let (lower, rest) = part.split_at_mut(first);
    dissect(lower, positions, width);
    dissect(&mut rest[..halves - first], positions, width);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_strip_separates_the_halves() {
        let positions: Vec<[f64; 2]> = (0..1600)
            .map(|i| [(i % 80) as f64, (i / 80) as f64])
            .collect();
        let order = nested_dissection(&positions, 3.0);
        let mut seen = order.clone();
        seen.sort_unstable();
        assert_eq!(seen, (0..1600).collect::<Vec<_>>());
        // The first separator is 3 columns of 20; without it, left and right are at least 3 apart.
        let halves = &order[..1600 - 60];
        let strip: Vec<f64> = order[1540..].iter().map(|&i| positions[i][0]).collect();
        let (low, high) = strip
            .iter()
            .fold((f64::MAX, f64::MIN), |(l, h), &x| (l.min(x), h.max(x)));
        assert_eq!(high - low, 2.0);
        assert!(
            halves
                .iter()
                .all(|&i| positions[i][0] < low || positions[i][0] > high)
        );
    }
}
