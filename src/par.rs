//! Owns vector arithmetic whose results do not depend on the number of threads: sums run over fixed chunks, and the
//! chunks' sums are added in order.

use rayon::prelude::*;

/// Sites per chunk: large enough to amortise scheduling, small enough for two cores to share small problems.
pub const CHUNK: usize = 4096;

/// `Σ x·y` over all sites and components.
pub fn dot<const D: usize>(x: &[[f64; D]], y: &[[f64; D]]) -> f64 {
    sum_chunks(x.len(), |range| {
        let (x, y) = (&x[range.clone()], &y[range]);
        let mut lanes = [0.0; D];
        for (a, b) in x.iter().zip(y) {
            for d in 0..D {
                lanes[d] += a[d] * b[d];
            }
        }
        lanes.iter().sum()
    })
}

/// `Σ f(chunk)` over fixed chunks of `0..n`, chunk sums added in order.
pub fn sum_chunks(n: usize, f: impl Fn(std::ops::Range<usize>) -> f64 + Sync) -> f64 {
    let chunks = n.div_ceil(CHUNK);
    let parts: Vec<f64> = (0..chunks)
        .into_par_iter()
        .map(|c| f(c * CHUNK..((c + 1) * CHUNK).min(n)))
        .collect();
    parts.iter().sum()
}
