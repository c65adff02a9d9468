//! Owns the largest eigenvalue of `D⁻¹A` on assembled levels, which their smoothers need.

use super::aggregate::CHUNK;
use super::level::Level;
use rayon::prelude::*;

/// Steps of the Lanczos process: an eigenvalue that stands out is found to a percent, wherever its motion is.
const STEPS: usize = 24;

/// The largest eigenvalue of `D⁻¹A`, from below: the largest of the Lanczos matrix that conjugate gradients builds for
/// a noisy right-hand side (Golub & Van Loan, §11.3).
pub fn largest<const D: usize>(level: &impl Level<D>) -> f32 {
    let n = level.sites();
    // As much noise in every site's own measure, so that soft ones are not all there is.
    let mut r: Vec<[f32; D]> = (0..n)
        .into_par_iter()
        .map(|i| {
            let noise: [f32; D] = std::array::from_fn(|d| noise((i * D + d) as u32));
            let z = level.scale(i, &noise);
            let own: f32 = noise.iter().zip(&z).map(|(r, z)| r * z).sum();
            let scale = if own > 0.0 { own.sqrt().recip() } else { 0.0 };
            noise.map(|v| v * scale)
        })
        .collect();
    let mut p = vec![[0.0; D]; n];
    let mut q = vec![[0.0; D]; n];
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    let (mut rz_before, mut alpha_before) = (0.0, 1.0);
    for step in 0..STEPS {
        let rz: f64 = sum(n, |i| dot(&r[i], &level.scale(i, &r[i])));
        let beta = if step == 0 { 0.0 } else { rz / rz_before };
        p.par_iter_mut().enumerate().for_each(|(i, p)| {
            let z = level.scale(i, &r[i]);
            for d in 0..D {
                p[d] = z[d] + beta as f32 * p[d];
            }
        });
        q.par_chunks_mut(CHUNK).enumerate().for_each(|(c, q)| {
            level.rows(c * CHUNK..c * CHUNK + q.len(), &p, q);
        });
        let curvature: f64 = sum(n, |i| dot(&p[i], &q[i]));
        if !(rz > 0.0 && curvature > 0.0 && curvature.is_finite()) {
            break;
        }
        let alpha = rz / curvature;
        if step > 0 {
            beside.push(beta.sqrt() / alpha_before);
        }
        diagonal.push(1.0 / alpha + beta / alpha_before);
        r.par_iter_mut().zip(&q).for_each(|(r, q)| {
            for d in 0..D {
                r[d] -= alpha as f32 * q[d];
            }
        });
        (rz_before, alpha_before) = (rz, alpha);
    }
    largest_of_tridiagonal(&diagonal, &beside) as f32
}

fn dot<const D: usize>(a: &[f32; D], b: &[f32; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum()
}

/// `Σ f(i)`, chunk by chunk.
fn sum(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let chunk = |c: usize| (c * CHUNK..((c + 1) * CHUNK).min(n)).map(&f).sum::<f64>();
    let parts: Vec<f64> = (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    parts.iter().sum()
}

/// By bisection: the pivots of `T − x` are all negative where `x` is above every eigenvalue (Sturm).
fn largest_of_tridiagonal(diagonal: &[f64], beside: &[f64]) -> f64 {
    let above = |x: f64| {
        let mut pivot = 1.0;
        diagonal.iter().enumerate().all(|(i, d)| {
            let b = if i == 0 { 0.0 } else { beside[i - 1] };
            pivot = d - x - b * b / pivot;
            pivot < 0.0
        })
    };
    let most = |v: &[f64]| v.iter().copied().fold(0.0, f64::max);
    let (mut low, mut high) = (0.0, most(diagonal) + 2.0 * most(beside));
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
