//! Owns eight lanes in AVX2 and AVX-512 registers.

use super::Lanes;
use std::arch::x86_64::*;

/// Eight f64 in one AVX-512 register.
#[derive(Clone, Copy)]
pub struct Avx512F64(__m512d);

impl Lanes for Avx512F64 {
    type S = f64;
    #[inline(always)]
    unsafe fn zero() -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_setzero_pd()) }
    }
    #[inline(always)]
    unsafe fn splat(s: f64) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_set1_pd(s)) }
    }
    #[inline(always)]
    unsafe fn load(p: *const f64) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F, and `p` is valid for reads of eight scalars, and the load asks for no alignment.
        unsafe { Avx512F64(_mm512_loadu_pd(p)) }
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f64) {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F, and `p` is valid for writes of eight scalars, and the store asks for no alignment.
        unsafe { _mm512_storeu_pd(p, self.0) }
    }
    #[inline(always)]
    unsafe fn fma(self, a: Self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_fmadd_pd(a.0, b.0, self.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_sub_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_add_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe { Avx512F64(_mm512_mul_pd(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn after(self, before: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX-512F; no memory is read or written.
        unsafe {
            let [own, before] = [_mm512_castpd_si512(self.0), _mm512_castpd_si512(before.0)];
            Avx512F64(_mm512_castsi512_pd(_mm512_alignr_epi64::<7>(own, before)))
        }
    }
}

/// Eight f64 in two AVX registers.
#[derive(Clone, Copy)]
pub struct Avx2F64(__m256d, __m256d);

impl Lanes for Avx2F64 {
    type S = f64;
    #[inline(always)]
    unsafe fn zero() -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F64(_mm256_setzero_pd(), _mm256_setzero_pd()) }
    }
    #[inline(always)]
    unsafe fn splat(s: f64) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F64(_mm256_set1_pd(s), _mm256_set1_pd(s)) }
    }
    #[inline(always)]
    unsafe fn load(p: *const f64) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA, and `p` is valid for reads of eight scalars, and the load asks for no alignment.
        unsafe { Avx2F64(_mm256_loadu_pd(p), _mm256_loadu_pd(p.add(4))) }
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f64) {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA, and `p` is valid for writes of eight scalars, and the store asks for no alignment.
        unsafe {
            _mm256_storeu_pd(p, self.0);
            _mm256_storeu_pd(p.add(4), self.1);
        }
    }
    #[inline(always)]
    unsafe fn fma(self, a: Self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe {
            let low = _mm256_fmadd_pd(a.0, b.0, self.0);
            Avx2F64(low, _mm256_fmadd_pd(a.1, b.1, self.1))
        }
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F64(_mm256_sub_pd(self.0, b.0), _mm256_sub_pd(self.1, b.1)) }
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F64(_mm256_add_pd(self.0, b.0), _mm256_add_pd(self.1, b.1)) }
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F64(_mm256_mul_pd(self.0, b.0), _mm256_mul_pd(self.1, b.1)) }
    }
    #[inline(always)]
    unsafe fn after(self, before: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe {
            let low = _mm256_permute2f128_pd::<0x21>(before.1, self.0);
            let high = _mm256_permute2f128_pd::<0x21>(self.0, self.1);
            Avx2F64(
                _mm256_shuffle_pd::<0b0101>(low, self.0),
                _mm256_shuffle_pd::<0b0101>(high, self.1),
            )
        }
    }
}

/// Eight f32 in one AVX register.
#[derive(Clone, Copy)]
pub struct Avx2F32(__m256);

impl Lanes for Avx2F32 {
    type S = f32;
    #[inline(always)]
    unsafe fn zero() -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_setzero_ps()) }
    }
    #[inline(always)]
    unsafe fn splat(s: f32) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_set1_ps(s)) }
    }
    #[inline(always)]
    unsafe fn load(p: *const f32) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA, and `p` is valid for reads of eight scalars, and the load asks for no alignment.
        unsafe { Avx2F32(_mm256_loadu_ps(p)) }
    }
    #[inline(always)]
    unsafe fn store(self, p: *mut f32) {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA, and `p` is valid for writes of eight scalars, and the store asks for no alignment.
        unsafe { _mm256_storeu_ps(p, self.0) }
    }
    #[inline(always)]
    unsafe fn fma(self, a: Self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_fmadd_ps(a.0, b.0, self.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_sub_ps(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn add(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_add_ps(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, b: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe { Avx2F32(_mm256_mul_ps(self.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn after(self, before: Self) -> Self {
        // SAFETY: by the contract of `Lanes` the processor has AVX2 and FMA; no memory is read or written.
        unsafe {
            let turned = _mm256_set_epi32(6, 5, 4, 3, 2, 1, 0, 7);
            let lanes = _mm256_blend_ps::<0x80>(self.0, before.0);
            Avx2F32(_mm256_permutevar8x32_ps(lanes, turned))
        }
    }
}
