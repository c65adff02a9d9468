//! Owns the lowest eigenpairs of K v = λ M v by Lanczos on the inverse of a shifted matrix.

use faer::{Mat, Side};

/// One eigenpair.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    pub eigenvalue: f64,
    /// Scaled to vᵀ M v = 1.
    pub vector: Vec<f64>,
}

/// The `count` lowest eigenpairs of K v = λ M v. `inverse` does x := (K + σ M)⁻¹ x for the shift σ > 0 that makes
/// K + σ M positive definite; `mass` is M's diagonal, which may have zeros. Lanczos in the inner product of M with full
/// reorthogonalisation, until the wanted eigenvalues move by less than 1e-12 of themselves plus the shift.
pub fn lowest(
    count: usize,
    mass: &[f64],
    shift: f64,
    mut inverse: impl FnMut(&mut [f64]),
) -> Vec<Mode> {
    let n = mass.len();
    let limit = n.min(20 * count + 60);
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let (mut alpha, mut beta): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    // A start vector without symmetry, so that every mode is in it.
    let mut w: Vec<f64> = (0..n)
        .map(|i| 0.5 + ((i as f64) * 0.754_877_666).fract())
        .collect();
    inverse(&mut w);
    let mut previous: Vec<f64> = Vec::new();
    loop {
        let norm = weighted(&w, &w, mass).sqrt();
        if norm.is_nan() || norm <= 1e-14 * beta.first().copied().unwrap_or(0.0) {
            break;
        }
        if !basis.is_empty() {
            beta.push(norm);
        }
        let v: Vec<f64> = w.iter().map(|x| x / norm).collect();
        w = v.iter().zip(mass).map(|(v, m)| v * m).collect();
        inverse(&mut w);
        alpha.push(weighted(&w, &v, mass));
        basis.push(v);
        for _ in 0..2 {
            for v in &basis {
                let share = weighted(&w, v, mass);
                w.iter_mut().zip(v).for_each(|(w, v)| *w -= share * v);
            }
        }
        if basis.len() >= limit {
            break;
        }
        if basis.len() > 2 * count && basis.len().is_multiple_of(5) {
            let now: Vec<f64> = ritz(&alpha, &beta).0.into_iter().take(count).collect();
            let settled = now.len() == count
                && previous.len() == count
                && now
                    .iter()
                    .zip(&previous)
                    .all(|(a, b)| (a - b).abs() <= 1e-12 * a);
            previous = now;
            if settled {
                break;
            }
        }
    }
    let (theta, s) = ritz(&alpha, &beta);
    let modes = theta.iter().take(count).enumerate();
    modes
        .map(|(k, theta)| {
            let mut vector = vec![0.0; n];
            for (j, v) in basis.iter().enumerate() {
                vector
                    .iter_mut()
                    .zip(v)
                    .for_each(|(x, v)| *x += s[(j, k)] * v);
            }
            Mode {
                eigenvalue: 1.0 / theta - shift,
                vector,
            }
        })
        .collect()
}

fn weighted(a: &[f64], b: &[f64], mass: &[f64]) -> f64 {
    crate::par::sum_chunks(a.len(), |range| range.map(|i| a[i] * b[i] * mass[i]).sum())
}

/// Eigenvalues of the tridiagonal matrix, largest first, with their vectors as columns.
fn ritz(alpha: &[f64], beta: &[f64]) -> (Vec<f64>, Mat<f64>) {
    let k = alpha.len();
    let t = Mat::from_fn(k, k, |i, j| match i.abs_diff(j) {
        0 => alpha[i],
        1 => beta[i.min(j)],
        _ => 0.0,
    });
    match t.self_adjoint_eigen(Side::Lower) {
        Ok(eigen) => {
            let values = eigen.S().column_vector();
            let theta = (0..k).rev().map(|i| values[i]).collect();
            (theta, Mat::from_fn(k, k, |i, j| eigen.U()[(i, k - 1 - j)]))
        }
        Err(_) => (Vec::new(), Mat::zeros(k, 0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of equal springs and masses, ends free: λ = 4 sin²(kπ/2n); the first is the rigid translation.
    #[test]
    fn modes_of_a_free_chain() {
        let n = 40;
        let shift = 0.01;
        let k = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
            0 => shift + if i == 0 || i == n - 1 { 1.0 } else { 2.0 },
            1 => -1.0,
            _ => 0.0,
        });
        let llt = k.llt(Side::Lower).unwrap();
        let inverse = |x: &mut [f64]| {
            let b = Mat::from_fn(n, 1, |i, _| x[i]);
            let y = faer::linalg::solvers::Solve::solve(&llt, &b);
            (0..n).for_each(|i| x[i] = y[(i, 0)]);
        };
        let modes = lowest(5, &vec![1.0; n], shift, inverse);
        for (i, mode) in modes.iter().enumerate() {
            let exact = 4.0
                * (i as f64 * std::f64::consts::PI / (2.0 * n as f64))
                    .sin()
                    .powi(2);
            assert!(
                (mode.eigenvalue - exact).abs() < 1e-11,
                "{i}: {} {exact}",
                mode.eigenvalue
            );
            assert!((mode.vector.iter().map(|v| v * v).sum::<f64>() - 1.0).abs() < 1e-10);
        }
    }
}
