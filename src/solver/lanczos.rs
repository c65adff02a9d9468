//! Owns the lowest eigenpairs of K v = λ M v by Lanczos on the inverse of a shifted matrix.

use faer::{Mat, Side};

/// One eigenpair.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    pub eigenvalue: f64,
    /// Scaled to vᵀ M v = 1.
    pub vector: Vec<f64>,
}

/// What [`lowest`] found.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// In rising order: as many as asked for, or as there are.
    pub modes: Vec<Mode>,
    /// Whether all of them settled before the basis reached its limit.
    pub settled: bool,
}

/// Vectors of a Lanczos basis for each wanted mode, and in any case. They bound memory and the cost of orthogonalisation, not the
/// accuracy: [`Found::settled`] says whether they were enough.
const LIMIT: [usize; 2] = [20, 60];
/// Share of an eigenvalue (of the inverse) by which it may differ from another and still count as the same.
const SAME: f64 = 1e-9;

/// The `count` lowest eigenpairs of K v = λ M v, each as often as it occurs. `inverse` does x := (K + σ M)⁻¹ x for the
/// shift σ > 0 that makes K + σ M positive definite; `mass` is M's diagonal, which may have zeros. Lanczos in the inner
/// product of M with full reorthogonalisation, until the wanted eigenvalues move by less than 1e-12 of themselves plus the
/// shift. Lanczos sees one vector of each eigenspace, so it starts again, orthogonal to all that was found, until a start
/// brings nothing lower than the highest wanted: of an eigenvalue that occurs k times, k starts find all.
pub fn lowest(
    count: usize,
    mass: &[f64],
    shift: f64,
    mut inverse: impl FnMut(&mut [f64]),
) -> Found {
    // Eigenvalues of the inverse, the largest first, with their vectors.
    let mut pairs: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut settled = true;
    for start in 0..mass.len() {
        let known: Vec<&[f64]> = pairs.iter().map(|(_, v)| v.as_slice()).collect();
        let least = match pairs.len() < count {
            true => 0.0,
            false => pairs[count - 1].0 * (1.0 + SAME),
        };
        let run = run(start, count, least, mass, &known, &mut inverse);
        settled &= run.settled;
        let better = run.pairs.iter().any(|(theta, _)| *theta > least);
        pairs.extend(run.pairs);
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        if !better || count == 1 {
            break;
        }
    }
    pairs.truncate(count);
    let mode = |(theta, vector): (f64, Vec<f64>)| Mode {
        eigenvalue: 1.0 / theta - shift,
        vector,
    };
    Found {
        modes: pairs.into_iter().map(mode).collect(),
        settled,
    }
}

struct Run {
    pairs: Vec<(f64, Vec<f64>)>,
    settled: bool,
}

/// One start of Lanczos, orthogonal to the `known` vectors: the eigenpairs of the inverse above `least` and the next one
/// below, `count` at most.
fn run(
    start: usize,
    count: usize,
    least: f64,
    mass: &[f64],
    known: &[&[f64]],
    inverse: &mut impl FnMut(&mut [f64]),
) -> Run {
    let n = mass.len();
    let limit = LIMIT[0] * count + LIMIT[1];
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let (mut alpha, mut beta): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut w = start_vector(n, start);
    inverse(&mut w);
    let size = weighted(&w, &w, mass).sqrt();
    clear(&mut w, known.iter().copied(), mass);
    let wanted = |theta: &[f64]| {
        let above = theta.iter().take_while(|t| **t > least).count();
        (above + 1).min(count)
    };
    let mut previous: Vec<f64> = Vec::new();
    let mut settled = true;
    loop {
        let norm = weighted(&w, &w, mass).sqrt();
        let smallest = alpha.first().map_or(1e-12 * size, |a: &f64| 1e-14 * a);
        // Nothing is left: the basis spans all that the start has a part in.
        if norm.is_nan() || norm <= smallest || basis.len() + known.len() >= n {
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
        let all = known.iter().copied().chain(basis.iter().map(Vec::as_slice));
        clear(&mut w, all, mass);
        if basis.len() >= limit {
            settled = false;
            break;
        }
        if basis.len() > 2 * wanted(&previous) && basis.len().is_multiple_of(5) {
            let now = ritz(&alpha, &beta).0;
            let k = wanted(&now);
            let same = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-12 * a;
            let still = previous.len() >= k && now.iter().zip(&previous).take(k).all(same);
            previous = now;
            if still {
                break;
            }
        }
    }
    let (theta, s) = ritz(&alpha, &beta);
    let k = wanted(&theta).min(theta.len());
    let vector = |k: usize| {
        let mut vector = vec![0.0; n];
        for (j, v) in basis.iter().enumerate() {
            let share = s[(j, k)];
            vector.iter_mut().zip(v).for_each(|(x, v)| *x += share * v);
        }
        vector
    };
    Run {
        pairs: (0..k).map(|k| (theta[k], vector(k))).collect(),
        settled,
    }
}

/// A vector without symmetry, so that every mode is in it, and another for each start. The steps are those of Roberts' low-discrepancy
/// sequences R2 and R3 (<https://extremelearning.com.au/unreasonable-effectiveness-of-quasirandom-sequences/>): irrational, and unlike.
fn start_vector(n: usize, start: usize) -> Vec<f64> {
    let step = [0.754_877_666, 0.569_840_291, 0.819_172_513, 0.671_043_607][start % 4];
    (0..n)
        .map(|i| 0.5 + ((i + start) as f64 * step).fract())
        .collect()
}

/// Takes the share of each of `vectors` (of norm 1) out of `w`, twice, so that rounding leaves nothing.
fn clear<'a>(w: &mut [f64], vectors: impl Iterator<Item = &'a [f64]> + Clone, mass: &[f64]) {
    for _ in 0..2 {
        for v in vectors.clone() {
            let share = weighted(w, v, mass);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= share * v);
        }
    }
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
        let modes = lowest(5, &vec![1.0; n], shift, inverse).modes;
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

    /// Five equal diagonal entries below others: the eigenvalue comes back five times, and no more modes than there are.
    #[test]
    fn equal_eigenvalues_are_found_as_often_as_they_occur() {
        let diagonal: Vec<f64> = (0..60)
            .map(|i| if i % 12 == 3 { 2.0 } else { 3.0 + i as f64 })
            .collect();
        let inverse = |x: &mut [f64]| x.iter_mut().zip(&diagonal).for_each(|(x, d)| *x /= d + 0.5);
        for count in 1..=8 {
            let found = lowest(count, &vec![1.0; 60], 0.5, inverse);
            let expected = [2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 4.0, 5.0];
            assert!(found.settled && found.modes.len() == count);
            for (mode, expected) in found.modes.iter().zip(expected) {
                assert!(
                    (mode.eigenvalue - expected).abs() < 1e-11,
                    "{count}: {found:?}"
                );
            }
        }
        let few = lowest(9, &[1.0; 4], 0.5, |x: &mut [f64]| {
            x.iter_mut()
                .zip([1.5, 1.5, 2.5, 3.5])
                .for_each(|(x, d)| *x /= d);
        });
        let values: Vec<f64> = few.modes.iter().map(|m| m.eigenvalue).collect();
        assert!(few.settled && values.len() == 4, "{values:?}");
        for (found, expected) in values.iter().zip([1.0, 1.0, 2.0, 3.0]) {
            assert!((found - expected).abs() < 1e-12, "{values:?}");
        }
    }
}
