//! Owns eight-lane arithmetic chosen at run time, so that one binary is fast on every processor: AVX-512, AVX2 with
//! fused multiply-add, or plain arrays that the compiler maps to what the target has.

pub mod vec3;

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
mod x86;
