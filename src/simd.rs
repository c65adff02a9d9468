//! Owns eight-lane arithmetic chosen at run time, so that one binary is fast on every processor: AVX-512, AVX2 with
//! fused multiply-add, or plain arrays that the compiler maps to what the target has.

use std::ops::Sub;

/// The instruction set in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    Avx512,
    Avx2,
    Portable,
}

/// The best instruction set of this processor (the standard library caches the answer).
#[inline]
pub fn isa() -> Isa {
    #[cfg(target_arch = "x86_64")]
    {
        let fma = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
        if fma && is_x86_feature_detected!("avx512f") {
            return Isa::Avx512;
        }
        if fma {
            return Isa::Avx2;
        }
    }
    Isa::Portable
}

/// Eight lanes of one scalar type, and four more for the remainder of a nine-term row.
///
/// # Safety
/// The methods of an implementation may be called only where its instruction set is available; pointers must be valid
/// for the lanes that are read or written. No alignment is asked for.
#[allow(clippy::missing_safety_doc)] // one contract for all methods, above
pub trait Lanes: Copy {
    type S: Copy + Default + Sub<Output = Self::S>;
    type Four: Copy;
    unsafe fn zero() -> Self;
    unsafe fn zero4() -> Self::Four;
    unsafe fn splat(s: Self::S) -> Self;
    unsafe fn load(p: *const Self::S) -> Self;
    /// The first three of four scalars over and over.
    unsafe fn load_threes(p: *const Self::S) -> Self;
    unsafe fn store(self, p: *mut Self::S);
    /// `self + a b`.
    unsafe fn fma(self, a: Self, b: Self) -> Self;
    unsafe fn splat4(s: Self::S) -> Self::Four;
    /// `four + a[0..4] · (x[0] − less)`.
    unsafe fn fma4(
        four: Self::Four,
        a: *const Self::S,
        x: *const Self::S,
        less: Self::Four,
    ) -> Self::Four;
    unsafe fn sub(self, b: Self) -> Self;
    /// `four + s four_b`.
    unsafe fn scale4(four: Self::Four, s: Self::S, b: Self::Four) -> Self::Four;
    /// The sums over the lanes of `a`, `b`, `c`, plus the first three lanes of `four`.
    unsafe fn sum3(a: Self, b: Self, c: Self, four: Self::Four) -> [Self::S; 3];
}

macro_rules! portable {
    ($name:ident, $s:ty) => {
        /// Plain arrays.
        #[derive(Clone, Copy)]
        pub struct $name([$s; 8]);

        impl Lanes for $name {
            type S = $s;
            type Four = [$s; 4];
            #[inline(always)]
            unsafe fn zero() -> Self {
                $name([0.0; 8])
            }
            #[inline(always)]
            unsafe fn zero4() -> [$s; 4] {
                [0.0; 4]
            }
            #[inline(always)]
            unsafe fn splat(s: $s) -> Self {
                $name([s; 8])
            }
            #[inline(always)]
            unsafe fn load(p: *const $s) -> Self {
                $name(unsafe { p.cast::<[$s; 8]>().read_unaligned() })
            }
            #[inline(always)]
            unsafe fn load_threes(p: *const $s) -> Self {
                $name(std::array::from_fn(|l| unsafe { *p.add(l % 3) }))
            }
            #[inline(always)]
            unsafe fn store(self, p: *mut $s) {
                unsafe { p.cast::<[$s; 8]>().write_unaligned(self.0) }
            }
            #[inline(always)]
            unsafe fn fma(mut self, a: Self, b: Self) -> Self {
                for l in 0..8 {
                    self.0[l] += a.0[l] * b.0[l];
                }
                self
            }
            #[inline(always)]
            unsafe fn sub(mut self, b: Self) -> Self {
                for l in 0..8 {
                    self.0[l] -= b.0[l];
                }
                self
            }
            #[inline(always)]
            unsafe fn splat4(s: $s) -> [$s; 4] {
                [s; 4]
            }
            #[inline(always)]
            unsafe fn fma4(
                mut four: [$s; 4],
                a: *const $s,
                x: *const $s,
                less: [$s; 4],
            ) -> [$s; 4] {
                let (a, x) = unsafe { (a.cast::<[$s; 4]>().read_unaligned(), *x) };
                for l in 0..4 {
                    four[l] += a[l] * (x - less[l]);
                }
                four
            }
            #[inline(always)]
            unsafe fn scale4(mut four: [$s; 4], s: $s, b: [$s; 4]) -> [$s; 4] {
                for l in 0..4 {
                    four[l] += s * b[l];
                }
                four
            }
            #[inline(always)]
            unsafe fn sum3(a: Self, b: Self, c: Self, four: [$s; 4]) -> [$s; 3] {
                let sum =
                    |v: [$s; 8]| ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
                [sum(a.0) + four[0], sum(b.0) + four[1], sum(c.0) + four[2]]
            }
        }
    };
}

portable!(PlainF64, f64);
portable!(PlainF32, f32);

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2F32, Avx2F64, Avx512F64};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Lanes;
    use std::arch::x86_64::*;

    #[inline(always)]
    unsafe fn sum3_f64(a: __m256d, b: __m256d, c: __m256d, four: __m256d) -> [f64; 3] {
        unsafe {
            let ab = _mm256_hadd_pd(a, b);
            let cc = _mm256_hadd_pd(c, c);
            let low = _mm256_permute2f128_pd::<0x20>(ab, cc);
            let high = _mm256_permute2f128_pd::<0x31>(ab, cc);
            let all = _mm256_add_pd(_mm256_add_pd(low, high), four);
            let mut out = [0.0; 4];
            _mm256_storeu_pd(out.as_mut_ptr(), all);
            [out[0], out[1], out[2]]
        }
    }

    /// Eight f64 in one AVX-512 register.
    #[derive(Clone, Copy)]
    pub struct Avx512F64(__m512d);

    impl Lanes for Avx512F64 {
        type S = f64;
        type Four = __m256d;
        #[inline(always)]
        unsafe fn zero() -> Self {
            unsafe { Avx512F64(_mm512_setzero_pd()) }
        }
        #[inline(always)]
        unsafe fn zero4() -> __m256d {
            unsafe { _mm256_setzero_pd() }
        }
        #[inline(always)]
        unsafe fn splat(s: f64) -> Self {
            unsafe { Avx512F64(_mm512_set1_pd(s)) }
        }
        #[inline(always)]
        unsafe fn load(p: *const f64) -> Self {
            unsafe { Avx512F64(_mm512_loadu_pd(p)) }
        }
        #[inline(always)]
        unsafe fn load_threes(p: *const f64) -> Self {
            unsafe {
                let order = _mm512_set_epi64(1, 0, 2, 1, 0, 2, 1, 0);
                let four = _mm512_castpd256_pd512(_mm256_loadu_pd(p));
                Avx512F64(_mm512_permutexvar_pd(order, four))
            }
        }
        #[inline(always)]
        unsafe fn store(self, p: *mut f64) {
            unsafe { _mm512_storeu_pd(p, self.0) }
        }
        #[inline(always)]
        unsafe fn fma(self, a: Self, b: Self) -> Self {
            unsafe { Avx512F64(_mm512_fmadd_pd(a.0, b.0, self.0)) }
        }
        #[inline(always)]
        unsafe fn sub(self, b: Self) -> Self {
            unsafe { Avx512F64(_mm512_sub_pd(self.0, b.0)) }
        }
        #[inline(always)]
        unsafe fn splat4(s: f64) -> __m256d {
            unsafe { _mm256_set1_pd(s) }
        }
        #[inline(always)]
        unsafe fn fma4(four: __m256d, a: *const f64, x: *const f64, less: __m256d) -> __m256d {
            unsafe {
                let x = _mm256_sub_pd(_mm256_broadcast_sd(&*x), less);
                _mm256_fmadd_pd(_mm256_loadu_pd(a), x, four)
            }
        }
        #[inline(always)]
        unsafe fn scale4(four: __m256d, s: f64, b: __m256d) -> __m256d {
            unsafe { _mm256_fmadd_pd(_mm256_set1_pd(s), b, four) }
        }
        #[inline(always)]
        unsafe fn sum3(a: Self, b: Self, c: Self, four: __m256d) -> [f64; 3] {
            unsafe {
                let half = |v: __m512d| {
                    _mm256_add_pd(_mm512_castpd512_pd256(v), _mm512_extractf64x4_pd::<1>(v))
                };
                sum3_f64(half(a.0), half(b.0), half(c.0), four)
            }
        }
    }

    /// Eight f64 in two AVX registers.
    #[derive(Clone, Copy)]
    pub struct Avx2F64(__m256d, __m256d);

    impl Lanes for Avx2F64 {
        type S = f64;
        type Four = __m256d;
        #[inline(always)]
        unsafe fn zero() -> Self {
            unsafe { Avx2F64(_mm256_setzero_pd(), _mm256_setzero_pd()) }
        }
        #[inline(always)]
        unsafe fn zero4() -> __m256d {
            unsafe { _mm256_setzero_pd() }
        }
        #[inline(always)]
        unsafe fn splat(s: f64) -> Self {
            unsafe { Avx2F64(_mm256_set1_pd(s), _mm256_set1_pd(s)) }
        }
        #[inline(always)]
        unsafe fn load(p: *const f64) -> Self {
            unsafe { Avx2F64(_mm256_loadu_pd(p), _mm256_loadu_pd(p.add(4))) }
        }
        #[inline(always)]
        unsafe fn load_threes(p: *const f64) -> Self {
            unsafe {
                let four = _mm256_loadu_pd(p);
                Avx2F64(
                    _mm256_permute4x64_pd::<0b00_10_01_00>(four),
                    _mm256_permute4x64_pd::<0b01_00_10_01>(four),
                )
            }
        }
        #[inline(always)]
        unsafe fn store(self, p: *mut f64) {
            unsafe {
                _mm256_storeu_pd(p, self.0);
                _mm256_storeu_pd(p.add(4), self.1);
            }
        }
        #[inline(always)]
        unsafe fn fma(self, a: Self, b: Self) -> Self {
            unsafe {
                let low = _mm256_fmadd_pd(a.0, b.0, self.0);
                Avx2F64(low, _mm256_fmadd_pd(a.1, b.1, self.1))
            }
        }
        #[inline(always)]
        unsafe fn sub(self, b: Self) -> Self {
            unsafe { Avx2F64(_mm256_sub_pd(self.0, b.0), _mm256_sub_pd(self.1, b.1)) }
        }
        #[inline(always)]
        unsafe fn splat4(s: f64) -> __m256d {
            unsafe { _mm256_set1_pd(s) }
        }
        #[inline(always)]
        unsafe fn fma4(four: __m256d, a: *const f64, x: *const f64, less: __m256d) -> __m256d {
            unsafe {
                let x = _mm256_sub_pd(_mm256_broadcast_sd(&*x), less);
                _mm256_fmadd_pd(_mm256_loadu_pd(a), x, four)
            }
        }
        #[inline(always)]
        unsafe fn scale4(four: __m256d, s: f64, b: __m256d) -> __m256d {
            unsafe { _mm256_fmadd_pd(_mm256_set1_pd(s), b, four) }
        }
        #[inline(always)]
        unsafe fn sum3(a: Self, b: Self, c: Self, four: __m256d) -> [f64; 3] {
            unsafe {
                let half = |v: Self| _mm256_add_pd(v.0, v.1);
                sum3_f64(half(a), half(b), half(c), four)
            }
        }
    }

    /// Eight f32 in one AVX register.
    #[derive(Clone, Copy)]
    pub struct Avx2F32(__m256);

    impl Lanes for Avx2F32 {
        type S = f32;
        type Four = __m128;
        #[inline(always)]
        unsafe fn zero() -> Self {
            unsafe { Avx2F32(_mm256_setzero_ps()) }
        }
        #[inline(always)]
        unsafe fn zero4() -> __m128 {
            unsafe { _mm_setzero_ps() }
        }
        #[inline(always)]
        unsafe fn splat(s: f32) -> Self {
            unsafe { Avx2F32(_mm256_set1_ps(s)) }
        }
        #[inline(always)]
        unsafe fn load(p: *const f32) -> Self {
            unsafe { Avx2F32(_mm256_loadu_ps(p)) }
        }
        #[inline(always)]
        unsafe fn load_threes(p: *const f32) -> Self {
            unsafe {
                let order = _mm256_set_epi32(1, 0, 2, 1, 0, 2, 1, 0);
                let four = _mm256_castps128_ps256(_mm_loadu_ps(p));
                Avx2F32(_mm256_permutevar8x32_ps(four, order))
            }
        }
        #[inline(always)]
        unsafe fn store(self, p: *mut f32) {
            unsafe { _mm256_storeu_ps(p, self.0) }
        }
        #[inline(always)]
        unsafe fn fma(self, a: Self, b: Self) -> Self {
            unsafe { Avx2F32(_mm256_fmadd_ps(a.0, b.0, self.0)) }
        }
        #[inline(always)]
        unsafe fn sub(self, b: Self) -> Self {
            unsafe { Avx2F32(_mm256_sub_ps(self.0, b.0)) }
        }
        #[inline(always)]
        unsafe fn splat4(s: f32) -> __m128 {
            unsafe { _mm_set1_ps(s) }
        }
        #[inline(always)]
        unsafe fn fma4(four: __m128, a: *const f32, x: *const f32, less: __m128) -> __m128 {
            unsafe {
                let x = _mm_sub_ps(_mm_broadcast_ss(&*x), less);
                _mm_fmadd_ps(_mm_loadu_ps(a), x, four)
            }
        }
        #[inline(always)]
        unsafe fn scale4(four: __m128, s: f32, b: __m128) -> __m128 {
            unsafe { _mm_fmadd_ps(_mm_set1_ps(s), b, four) }
        }
        #[inline(always)]
        unsafe fn sum3(a: Self, b: Self, c: Self, four: __m128) -> [f32; 3] {
            unsafe {
                let half = |v: __m256| {
                    _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps::<1>(v))
                };
                let c = half(c.0);
                let pairs = _mm_hadd_ps(_mm_hadd_ps(half(a.0), half(b.0)), _mm_hadd_ps(c, c));
                let mut out = [0.0; 4];
                _mm_storeu_ps(out.as_mut_ptr(), _mm_add_ps(pairs, four));
                [out[0], out[1], out[2]]
            }
        }
    }
}
