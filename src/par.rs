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

/// Calls `f` with each of the chunks of `values` and its first place; what it returns is added up in order.
pub fn each_chunk<T: Send, const K: usize>(
    values: &mut [T],
    length: usize,
    f: impl Fn(usize, &mut [T]) -> [f64; K] + Sync,
) -> [f64; K] {
    let parts: Vec<[f64; K]> = values
        .par_chunks_mut(length)
        .enumerate()
        .map(|(c, chunk)| f(c * length, chunk))
        .collect();
    std::array::from_fn(|k| parts.iter().map(|p| p[k]).sum())
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
