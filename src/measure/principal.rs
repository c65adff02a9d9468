//! Owns principal values and directions of symmetric tensors in three dimensions.

/// Sweeps after which Jacobi's rotations have converged for any 3 × 3 matrix (quadratic; five are usual).
const SWEEPS: usize = 12;

/// Principal values of a symmetric tensor, largest first, and the unit vector of each. Components in the order 11, 22, 33, 23, 13,
/// 12; shears are the tensor's own, half of engineering strains. Jacobi's method.
pub fn principal([xx, yy, zz, yz, xz, xy]: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut a, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    (order.map(|i| a[i][i]), order.map(|i| v[i]))
}

/// Makes `a[p][q]` zero by a turn in the plane of p and q; the rows of `v` turn along.
fn rotate(a: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if a[p][q] == 0.0 {
        return;
    }
    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let c = t.hypot(1.0).recip();
    let s = t * c;
    for row in a.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    for m in [a, v] {
        let (low, high) = (m[p], m[q]);
        for k in 0..3 {
            m[p][k] = c * low[k] - s * high[k];
            m[q][k] = s * low[k] + c * high[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_directions_make_the_tensor() {
        for t in [
            [3.0, -1.0, 2.0, 0.5, -0.7, 1.1],
            [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
            [1e-9, -4e3, 2.0, 1e-3, 7.0, -5e2],
        ] {
            let (values, directions) = principal(t);
            assert!(values[0] >= values[1] && values[1] >= values[2]);
            let size = t.iter().fold(0.0f64, |m, c| m.max(c.abs()));
            for (k, (i, j)) in [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
                .into_iter()
                .enumerate()
            {
                let sum: f64 = (0..3)
                    .map(|n| values[n] * directions[n][i] * directions[n][j])
                    .sum();
                assert!((sum - t[k]).abs() < 1e-12 * size, "{t:?}: {sum} {k}");
                let product: f64 = (0..3).map(|n| directions[i][n] * directions[j][n]).sum();
                let unit = f64::from(u8::from(i == j));
                assert!((product - unit).abs() < 1e-12, "{directions:?}");
            }
        }
    }

    #[test]
    fn pure_shear_pulls_along_the_diagonal() {
        let (values, directions) = principal([0.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
        assert!((values[0] - 2.0).abs() < 1e-14 && (values[2] + 2.0).abs() < 1e-14);
        assert!((directions[0][0].abs() - 0.5f64.sqrt()).abs() < 1e-14);
        assert!((directions[0][0] - directions[0][1]).abs() < 1e-14);
    }
}
