//! Owns eight-lane arithmetic chosen at run time, so that one binary is fast on every processor: AVX-512, AVX2 with
//! fused multiply-add, or plain arrays that the compiler maps to what the target has.

pub mod vec3;

use std::sync::OnceLock;

/// The instruction set in use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Isa {
    Avx512,
    Avx2,
    Portable,
}

/// Where this variable of the environment is set, whatever to, the program uses plain arrays on every processor.
pub const PORTABLE: &str = "BONEPD_PORTABLE";

/// The instruction set in use, chosen at the first call.
#[inline]
pub fn isa() -> Isa {
    static CHOSEN: OnceLock<Isa> = OnceLock::new();
    *CHOSEN.get_or_init(|| match std::env::var_os(PORTABLE) {
        Some(_) => Isa::Portable,
        None => best(),
    })
}

/// The best instruction set of this processor.
fn best() -> Isa {
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

/// Eight lanes of one scalar type.
///
/// # Safety
/// The methods of an implementation may be called only where its instruction set is available; pointers must be valid
/// for the lanes that are read or written. No alignment is asked for.
#[allow(clippy::missing_safety_doc)] // one contract for all methods, above
pub trait Lanes: Copy {
    type S: Copy + Default;
    unsafe fn zero() -> Self;
    unsafe fn splat(s: Self::S) -> Self;
    unsafe fn load(p: *const Self::S) -> Self;
    unsafe fn store(self, p: *mut Self::S);
    /// `self + a b`.
    unsafe fn fma(self, a: Self, b: Self) -> Self;
    unsafe fn add(self, b: Self) -> Self;
    unsafe fn sub(self, b: Self) -> Self;
    unsafe fn mul(self, b: Self) -> Self;
    /// The last lane of `before`, then the first seven of these.
    unsafe fn after(self, before: Self) -> Self;
}

macro_rules! portable {
    ($name:ident, $s:ty) => {
        /// Plain arrays.
        #[derive(Clone, Copy)]
        pub struct $name([$s; 8]);

        impl Lanes for $name {
            type S = $s;
            #[inline(always)]
            unsafe fn zero() -> Self {
                $name([0.0; 8])
            }
            #[inline(always)]
            unsafe fn splat(s: $s) -> Self {
                $name([s; 8])
            }
            #[inline(always)]
            unsafe fn load(p: *const $s) -> Self {
                // SAFETY: by the contract of `Lanes` `p` is valid for reads of eight scalars; the read asks for no alignment.
                $name(unsafe { p.cast::<[$s; 8]>().read_unaligned() })
            }
            #[inline(always)]
            unsafe fn store(self, p: *mut $s) {
                // SAFETY: by the contract of `Lanes` `p` is valid for writes of eight scalars; the write asks for no alignment.
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
            unsafe fn add(mut self, b: Self) -> Self {
                for l in 0..8 {
                    self.0[l] += b.0[l];
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
            unsafe fn mul(mut self, b: Self) -> Self {
                for l in 0..8 {
                    self.0[l] *= b.0[l];
                }
                self
            }
            #[inline(always)]
            unsafe fn after(self, before: Self) -> Self {
                $name(std::array::from_fn(|l| match l {
                    0 => before.0[7],
                    _ => self.0[l - 1],
                }))
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
