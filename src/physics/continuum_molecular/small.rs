//! Owns dense linear systems of a few unknowns.

/// Solves a x = b by Gaussian elimination with row pivoting; None where `a` is singular to 1e-12 of its largest entry.
pub fn solve_dense<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> Option<[f64; N]> {
    let largest = a.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    for c in 0..N {
        let pivot = (c..N).max_by(|&i, &j| a[i][c].abs().total_cmp(&a[j][c].abs()))?;
        a.swap(c, pivot);
        b.swap(c, pivot);
        if a[c][c].is_nan() || a[c][c].abs() <= 1e-12 * largest {
            return None;
        }
        let row = a[c];
        for i in c + 1..N {
            let factor = a[i][c] / row[c];
            a[i].iter_mut().zip(row).for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[c];
        }
    }
    let mut x = [0.0; N];
    for c in (0..N).rev() {
        x[c] = (b[c] - (c + 1..N).map(|j| a[c][j] * x[j]).sum::<f64>()) / a[c][c];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_are_solved_and_singular_ones_refused() {
        let a = [[0.0, 2.0, 1.0], [1.0, 1.0, 0.0], [3.0, 0.0, -1.0]];
        let x = solve_dense(a, [7.0, 3.0, 0.0]).unwrap();
        for (x, expected) in x.iter().zip([1.0, 2.0, 3.0]) {
            assert!((x - expected).abs() < 1e-14);
        }
        assert!(solve_dense([[1.0, 2.0], [2.0, 4.0]], [1.0, 1.0]).is_none());
    }
}
