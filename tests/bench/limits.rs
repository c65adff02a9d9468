//! What this machine can do at most, measured beside what is judged by it.

use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// All cores together.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// `a = b + s c` from memory, GB/s without write-allocates.
    pub triad: f64,
    /// Fused multiply-adds on the widest registers there are, GFLOP/s; single precision has twice the lanes of double.
    pub fma_f64: f64,
    pub fma_f32: f64,
    /// The same on 256 bits.
    pub fma_f64_256: f64,
}

impl Limits {
    pub fn measure() -> Self {
        let fma_f64_256 = fma(chains, FLOPS_PER_ROUND);
        let fma_f64 = widest().map_or(fma_f64_256, |chains| fma(chains, 2 * FLOPS_PER_ROUND));
        Limits {
            triad: triad(),
            fma_f64,
            fma_f32: 2.0 * fma_f64,
            fma_f64_256,
        }
    }

    /// The least seconds that an item of so many bytes and floating-point operations can take, and what binds it.
    pub fn least_s(&self, bytes: f64, flops: f64, single: bool) -> (f64, &'static str) {
        let peak = if single { self.fma_f32 } else { self.fma_f64 };
        let (memory, arithmetic) = (bytes / self.triad * 1e-9, flops / peak * 1e-9);
        if memory >= arithmetic {
            (memory, "memory")
        } else {
            (arithmetic, "arithmetic")
        }
    }
}

/// Median of seven runs of `f` in seconds, after one that does not count.
pub fn median_s(mut f: impl FnMut()) -> f64 {
    f();
    let mut times: Vec<f64> = (0..7)
        .map(|_| {
            let start = Instant::now();
            f();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[3]
}

fn triad() -> f64 {
    const N: usize = 1 << 23;
    const PART: usize = 1 << 15;
    let (mut a, b, c) = (vec![0f64; N], vec![1f64; N], vec![2f64; N]);
    let time = median_s(|| {
        a.par_chunks_mut(PART)
            .zip(b.par_chunks(PART))
            .zip(c.par_chunks(PART))
            .for_each(|((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 0.5 * c;
                }
            });
        black_box(&mut a);
    });
    (3 * 8 * N) as f64 / time * 1e-9
}

/// GFLOP/s of chains in double precision.
fn fma(chains: fn(usize) -> f64, flops: usize) -> f64 {
    const ROUNDS: usize = 20_000_000;
    let threads = rayon::current_num_threads();
    let time = median_s(|| {
        rayon::broadcast(|_| black_box(chains(ROUNDS)));
    });
    (threads * ROUNDS * flops) as f64 / time * 1e-9
}

#[cfg(target_arch = "x86_64")]
const FLOPS_PER_ROUND: usize = 2 * 4 * 12;
#[cfg(not(target_arch = "x86_64"))]
const FLOPS_PER_ROUND: usize = 2 * 12;

#[cfg(target_arch = "x86_64")]
fn chains(rounds: usize) -> f64 {
    assert!(is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"));
    // SAFETY: asked for above.
    unsafe { chains_avx2(rounds) }
}

/// Chains on 512 bits, where the processor has them.
#[cfg(target_arch = "x86_64")]
fn widest() -> Option<fn(usize) -> f64> {
    // SAFETY: asked for here.
    is_x86_feature_detected!("avx512f").then_some(|rounds| unsafe { chains_avx512(rounds) })
}

#[cfg(not(target_arch = "x86_64"))]
fn widest() -> Option<fn(usize) -> f64> {
    None
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn chains_avx512(rounds: usize) -> f64 {
    use std::arch::x86_64::*;
    let (x, y) = (
        _mm512_set1_pd(black_box(0.999_999)),
        _mm512_set1_pd(black_box(1e-6)),
    );
    let mut sums = [_mm512_set1_pd(1.0); 12];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm512_fmadd_pd(*sum, x, y);
        }
    }
    sums.iter().map(|s| _mm512_cvtsd_f64(*s)).sum()
}

/// Twelve independent chains, more than latency × units of any processor yet.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chains_avx2(rounds: usize) -> f64 {
    use std::arch::x86_64::*;
    let (x, y) = (
        _mm256_set1_pd(black_box(0.999_999)),
        _mm256_set1_pd(black_box(1e-6)),
    );
    let mut sums = [_mm256_set1_pd(1.0); 12];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = _mm256_fmadd_pd(*sum, x, y);
        }
    }
    sums.iter().map(|s| _mm256_cvtsd_f64(*s)).sum()
}

#[cfg(not(target_arch = "x86_64"))]
fn chains(rounds: usize) -> f64 {
    let (x, y) = (black_box(0.999_999), black_box(1e-6));
    let mut sums = [1.0f64; 12];
    for _ in 0..rounds {
        for sum in &mut sums {
            *sum = sum.mul_add(x, y);
        }
    }
    sums.iter().sum()
}
