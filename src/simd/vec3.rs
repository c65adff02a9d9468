//! Owns four-lane arithmetic for one site's vector (x, y, z and an idle lane), chosen at run time: AVX2 with fused
//! multiply-add where the processor has it, plain arrays elsewhere.

use std::ops::{Add, Mul, Sub};

/// # Safety
/// Methods may be called only where the implementation's instruction set is available; pointers must be valid for three
/// scalars and aligned to one. The fourth lane is zero after `load`, and stays what arithmetic makes of zeros.
#[allow(clippy::missing_safety_doc)] // one contract for all methods, above
pub trait Vec3Lanes: Copy {
    type S: Copy;
    unsafe fn zero() -> Self;
    unsafe fn splat(s: Self::S) -> Self;
    /// Three scalars.
    unsafe fn load(p: *const Self::S) -> Self;
    /// Four scalars, the last of them zero.
    unsafe fn constant(p: &[Self::S; 4]) -> Self;
    unsafe fn store(self, p: *mut Self::S);
    unsafe fn add(self, b: Self) -> Self;
    unsafe fn sub(self, b: Self) -> Self;
    /// `self + a b`.
    unsafe fn fma(self, a: Self, b: Self) -> Self;
    /// `(y, z, x)`.
    unsafe fn turn(self) -> Self;
    /// `(z, x, y)`.
    unsafe fn turn_back(self) -> Self;
    /// `x + y + z`.
    unsafe fn sum(self) -> Self::S;
}

/// A precision that the kernels come in.
pub trait Precision:
    Copy
    + Default
    + Send
    + Sync
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
{
    /// With AVX2, where that can be had.
    type Fast: Vec3Lanes<S = Self>;
    type Plain: Vec3Lanes<S = Self>;
    fn of(v: f64) -> Self;
}

impl Precision for f64 {
    #[inline(always)]
    fn of(v: f64) -> f64 {
        v
    }

    #[cfg(target_arch = "x86_64")]
    type Fast = Avx64;
    #[cfg(not(target_arch = "x86_64"))]
    type Fast = Plain64;
    type Plain = Plain64;
}

impl Precision for f32 {
    #[inline(always)]
    fn of(v: f64) -> f32 {
        v as f32
    }

    #[cfg(target_arch = "x86_64")]
    type Fast = Avx32;
    #[cfg(not(target_arch = "x86_64"))]
    type Fast = Plain32;
    type Plain = Plain32;
}

macro_rules! plain {
    ($name:ident, $s:ty) => {
        #[derive(Clone, Copy)]
        pub struct $name([$s; 3]);

        impl Vec3Lanes for $name {
            type S = $s;
            #[inline(always)]
            unsafe fn zero() -> Self {
                $name([0.0; 3])
            }
            #[inline(always)]
            unsafe fn splat(s: $s) -> Self {
                $name([s; 3])
            }
            #[inline(always)]
            unsafe fn load(p: *const $s) -> Self {
                // SAFETY: by the contract of `Vec3Lanes` `p` is valid for reads of three scalars and aligned to one, as `[$s; 3]` is.
                $name(unsafe { *p.cast() })
            }
            #[inline(always)]
            unsafe fn constant(p: &[$s; 4]) -> Self {
                $name([p[0], p[1], p[2]])
            }
            #[inline(always)]
            unsafe fn store(self, p: *mut $s) {
                // SAFETY: by the contract of `Vec3Lanes` `p` is valid for writes of three scalars and aligned to one, as `[$s; 3]` is.
                unsafe { *p.cast() = self.0 }
            }
            #[inline(always)]
            unsafe fn add(self, b: Self) -> Self {
                $name(std::array::from_fn(|l| self.0[l] + b.0[l]))
            }
            #[inline(always)]
            unsafe fn sub(self, b: Self) -> Self {
                $name(std::array::from_fn(|l| self.0[l] - b.0[l]))
            }
            #[inline(always)]
            unsafe fn fma(self, a: Self, b: Self) -> Self {
                $name(std::array::from_fn(|l| self.0[l] + a.0[l] * b.0[l]))
            }
            #[inline(always)]
            unsafe fn turn(self) -> Self {
                let [x, y, z] = self.0;
                $name([y, z, x])
            }
            #[inline(always)]
            unsafe fn turn_back(self) -> Self {
                let [x, y, z] = self.0;
                $name([z, x, y])
            }
            #[inline(always)]
            unsafe fn sum(self) -> $s {
                self.0[0] + self.0[1] + self.0[2]
            }
        }
    };
}

plain!(Plain64, f64);
plain!(Plain32, f32);

#[cfg(target_arch = "x86_64")]
use avx2::{Avx32, Avx64};

#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::Vec3Lanes;
    use std::arch::x86_64::*;

    macro_rules! avx2 {
        ($name:ident, $s:ty, $reg:ty, $mask:expr, $zero:ident, $splat:ident, $load:ident, $constant:ident, $store:ident,
         $add:ident, $sub:ident, $fma:ident, $turn:expr, $turn_back:expr) => {
            #[derive(Clone, Copy)]
            pub struct $name($reg);

            impl Vec3Lanes for $name {
                type S = $s;
                #[inline(always)]
                unsafe fn zero() -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($zero()) }
                }
                #[inline(always)]
                unsafe fn splat(s: $s) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($splat(s)) }
                }
                #[inline(always)]
                unsafe fn load(p: *const $s) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA, and `p` is valid for reads of three scalars: the mask leaves
                    // the fourth unread.
                    unsafe { $name($load(p, $mask)) }
                }
                #[inline(always)]
                unsafe fn constant(p: &[$s; 4]) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; `p` is an array of the four scalars that the load reads, at any
                    // alignment.
                    unsafe { $name($constant(p.as_ptr())) }
                }
                #[inline(always)]
                unsafe fn store(self, p: *mut $s) {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA, and `p` is valid for writes of three scalars: the mask leaves
                    // the fourth unwritten.
                    unsafe { $store(p, $mask, self.0) }
                }
                #[inline(always)]
                unsafe fn add(self, b: Self) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($add(self.0, b.0)) }
                }
                #[inline(always)]
                unsafe fn sub(self, b: Self) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($sub(self.0, b.0)) }
                }
                #[inline(always)]
                unsafe fn fma(self, a: Self, b: Self) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($fma(a.0, b.0, self.0)) }
                }
                #[inline(always)]
                unsafe fn turn(self) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($turn(self.0)) }
                }
                #[inline(always)]
                unsafe fn turn_back(self) -> Self {
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; no memory is read or written.
                    unsafe { $name($turn_back(self.0)) }
                }
                #[inline(always)]
                unsafe fn sum(self) -> $s {
                    let mut lanes = [0.0; 3];
                    // SAFETY: by the contract of `Vec3Lanes` the processor has AVX2 and FMA; `lanes` has room for the three scalars of a store.
                    unsafe { self.store(lanes.as_mut_ptr()) };
                    lanes[0] + lanes[1] + lanes[2]
                }
            }
        };
    }

    // Lane orders: (1, 2, 0, 3) is 0b11_00_10_01, (2, 0, 1, 3) is 0b11_01_00_10.
    avx2!(
        Avx64,
        f64,
        __m256d,
        _mm256_set_epi64x(0, -1, -1, -1),
        _mm256_setzero_pd,
        _mm256_set1_pd,
        _mm256_maskload_pd,
        _mm256_loadu_pd,
        _mm256_maskstore_pd,
        _mm256_add_pd,
        _mm256_sub_pd,
        _mm256_fmadd_pd,
        |v| _mm256_permute4x64_pd::<0b11_00_10_01>(v),
        |v| _mm256_permute4x64_pd::<0b11_01_00_10>(v)
    );
    avx2!(
        Avx32,
        f32,
        __m128,
        _mm_set_epi32(0, -1, -1, -1),
        _mm_setzero_ps,
        _mm_set1_ps,
        _mm_maskload_ps,
        _mm_loadu_ps,
        _mm_maskstore_ps,
        _mm_add_ps,
        _mm_sub_ps,
        _mm_fmadd_ps,
        |v| _mm_permute_ps::<0b11_00_10_01>(v),
        |v| _mm_permute_ps::<0b11_01_00_10>(v)
    );
}
