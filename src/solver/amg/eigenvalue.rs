//! Owns the largest eigenvalue of `D⁻¹A` on assembled levels, which their smoothers need, and of cycles.

use super::level::{Level, Six};
use rayon::prelude::*;

/// The largest eigenvalue of `BA` on a level, from below: the largest of the Lanczos matrix that conjugate gradients builds for a
/// noisy right-hand side in so many steps (Golub & Van Loan, §11.3). `precondition` makes `B r`; an eigenvalue that stands
/// out is found to a percent in 24 steps, wherever its motion is.
pub fn largest(
    level: &impl Level<6>,
    steps: usize,
    mut precondition: impl FnMut(&[Six], &mut [Six]),
) -> f32 {
    let (n, chunk) = (level.sites(), level.chunk());
    // As much noise in every site's own measure, so that soft ones are not all there is.
    let mut r: Vec<Six> = (0..n)
        .into_par_iter()
        .map(|i| {
            let noise: Six = std::array::from_fn(|d| noise((i * 6 + d) as u32));
            let own = dot(&noise, &level.scale(i, &noise)) as f32;
            let scale = if own > 0.0 { own.sqrt().recip() } else { 0.0 };
            noise.map(|v| v * scale)
        })
        .collect();
    let zero = vec![[0.0; 6]; n];
    let (mut z, mut p, mut q) = (zero.clone(), zero.clone(), zero);
    let (mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new());
    let (mut rz_before, mut alpha_before) = (0.0, 1.0);
    for step in 0..steps {
        precondition(&r, &mut z);
        let rz: f64 = sum(n, chunk, |i| dot(&r[i], &z[i]));
        let beta = if step == 0 { 0.0 } else { rz / rz_before };
        let values = p.par_iter_mut().with_min_len(chunk).zip(&z);
        values.for_each(|(p, z)| *p = std::array::from_fn(|d| z[d] + beta as f32 * p[d]));
        q.par_chunks_mut(chunk).enumerate().for_each(|(c, q)| {
            level.rows(c * chunk..c * chunk + q.len(), &p, q);
        });
        let curvature: f64 = sum(n, chunk, |i| dot(&p[i], &q[i]));
        if !(rz > 0.0 && curvature > 0.0 && curvature.is_finite()) {
            break;
        }
        let alpha = rz / curvature;
        if step > 0 {
            off_diagonal.push(beta.sqrt() / alpha_before);
        }
        diagonal.push(1.0 / alpha + beta / alpha_before);
        let values = r.par_iter_mut().with_min_len(chunk).zip(&q);
        values.for_each(|(r, q)| *r = std::array::from_fn(|d| r[d] - alpha as f32 * q[d]));
        (rz_before, alpha_before) = (rz, alpha);
    }
    largest_of_tridiagonal(&diagonal, &off_diagonal) as f32
}

fn dot(a: &Six, b: &Six) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
}

/// `Σ f(i)`, chunk by chunk.
fn sum(n: usize, size: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let chunk = |c: usize| (c * size..((c + 1) * size).min(n)).map(&f).sum::<f64>();
    let parts: Vec<f64> = (0..n.div_ceil(size)).into_par_iter().map(chunk).collect();
    parts.iter().sum()
}

/// By bisection: the pivots of `T − x` are all negative where `x` is above every eigenvalue (Sturm).
fn largest_of_tridiagonal(diagonal: &[f64], off_diagonal: &[f64]) -> f64 {
    let above = |x: f64| {
        let mut pivot = 1.0;
        diagonal.iter().enumerate().all(|(i, d)| {
            let b = if i == 0 { 0.0 } else { off_diagonal[i - 1] };
            pivot = d - x - b * b / pivot;
            pivot < 0.0
        })
    };
    let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, most(diagonal) + 2.0 * most(off_diagonal));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// A number between −1 and 1 that looks random, the same on every machine.
fn noise(i: u32) -> f32 {
    let mut h = i.wrapping_mul(0x9E37_79B9) ^ 0x5bd1_e995;
    h = (h ^ (h >> 15)).wrapping_mul(0x85EB_CA6B);
    h = (h ^ (h >> 13)).wrapping_mul(0xC2B2_AE35);
    (h ^ (h >> 16)) as f32 / u32::MAX as f32 * 2.0 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bisection_finds_the_largest_eigenvalue_of_a_chain() {
        let n = 9;
        let largest = largest_of_tridiagonal(&vec![2.0; n], &vec![1.0; n - 1]);
        let exact = 2.0 + 2.0 * (std::f64::consts::PI / (n + 1) as f64).cos();
        assert!((largest - exact).abs() < 1e-12);
    }
}
