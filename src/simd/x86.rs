//! Owns eight lanes in AVX2 and AVX-512 registers.

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
            let half =
                |v: __m256| _mm_add_ps(_mm256_castps256_ps128(v), _mm256_extractf128_ps::<1>(v));
            let c = half(c.0);
            let pairs = _mm_hadd_ps(_mm_hadd_ps(half(a.0), half(b.0)), _mm_hadd_ps(c, c));
            let mut out = [0.0; 4];
            _mm_storeu_ps(out.as_mut_ptr(), _mm_add_ps(pairs, four));
            [out[0], out[1], out[2]]
        }
    }
}
