//! Owns one row of a product with a prolongator, `Σ_j A_ij P_j`, a block of `D × 6` by aggregate, and its arithmetic in eight
//! lanes, of which six count.
//!
//! Arithmetic is in functions that are compiled for an instruction set and called once a row: closures that a level
//! calls are compiled without it.

use super::window::{Wide, Window};
use crate::simd;
use crate::simd::{Isa, Lanes};

/// A block of 6 × 6 in eight lanes.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub struct Wide6(pub [[f32; 8]; 6]);

/// A row in the making. An aggregate's place in it is looked up, not searched.
pub struct Image<const D: usize> {
    /// By aggregate: the row that it was last part of, and its place there.
    places: Vec<(u32, u32)>,
    row: u32,
    aggregates: Vec<u32>,
    blocks: Vec<Wide<D>>,
}

impl<const D: usize> Image<D> {
    pub fn new(aggregates: usize) -> Self {
        Image {
            places: vec![(0, 0); aggregates],
            row: 0,
            aggregates: Vec::new(),
            blocks: Vec::new(),
        }
    }

    pub fn aggregates(&self) -> &[u32] {
        &self.aggregates
    }

    pub fn blocks(&self) -> &[Wide<D>] {
        &self.blocks
    }

    #[inline(always)]
    fn begin(&mut self) {
        self.aggregates.clear();
        self.blocks.clear();
        self.row = self.row.wrapping_add(1);
        if self.row == 0 {
            self.places.fill((0, 0));
            self.row = 1;
        }
    }

    #[inline(always)]
    fn block(&mut self, aggregate: u32) -> &mut Wide<D> {
        let place = &mut self.places[aggregate as usize];
        if place.0 != self.row {
            *place = (self.row, self.blocks.len() as u32);
            self.aggregates.push(aggregate);
            self.blocks.push(Wide([[0.0; 8]; D]));
        }
        &mut self.blocks[place.1 as usize]
    }
}

/// The arithmetic for the instruction set of this processor.
#[derive(Clone, Copy)]
pub struct Gather<const D: usize> {
    isa: Isa,
}

impl<const D: usize> Gather<D> {
    pub fn here() -> Self {
        Gather { isa: simd::isa() }
    }

    /// `image = Σ_j A_ij P_j` without the aggregates below `least`.
    pub fn image(
        &self,
        image: &mut Image<D>,
        columns: &[u32],
        blocks: &[[[f32; D]; D]],
        rows: &Window<D>,
        least: u32,
    ) {
        match self.isa {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe {
                image_avx2(image, columns, blocks, rows, least);
            },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe {
                image_lanes::<simd::PlainF32, D>(image, columns, blocks, rows, least);
            },
        }
    }

    /// `image = P₀ − ω D⁻¹ image`, where `P₀` has the block `own` of the aggregate `home`.
    pub fn smooth(
        &self,
        image: &mut Image<D>,
        omega: f32,
        inverse: &[[f32; D]; D],
        home: u32,
        own: &Wide<D>,
    ) {
        match self.isa {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe { smooth_avx2(image, omega, inverse, home, own) },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe { smooth_lanes::<simd::PlainF32, D>(image, omega, inverse, home, own) },
        }
    }

    /// `sum += aᵀ b`.
    pub fn add_transposed(&self, sum: &mut Wide6, a: &Wide<D>, b: &Wide<D>) {
        match self.isa {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe { transposed_avx2(sum, a, b) },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe { transposed_lanes::<simd::PlainF32, D>(sum, a, b) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn image_avx2<const D: usize>(
    image: &mut Image<D>,
    columns: &[u32],
    blocks: &[[[f32; D]; D]],
    rows: &Window<D>,
    least: u32,
) {
    // SAFETY: this function has the features that the lanes ask for.
    unsafe { image_lanes::<simd::Avx2F32, D>(image, columns, blocks, rows, least) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn smooth_avx2<const D: usize>(
    image: &mut Image<D>,
    omega: f32,
    inverse: &[[f32; D]; D],
    home: u32,
    own: &Wide<D>,
) {
    // SAFETY: as above.
    unsafe { smooth_lanes::<simd::Avx2F32, D>(image, omega, inverse, home, own) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn transposed_avx2<const D: usize>(sum: &mut Wide6, a: &Wide<D>, b: &Wide<D>) {
    // SAFETY: as above.
    unsafe { transposed_lanes::<simd::Avx2F32, D>(sum, a, b) }
}

/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
unsafe fn image_lanes<N: Lanes<S = f32>, const D: usize>(
    image: &mut Image<D>,
    columns: &[u32],
    blocks: &[[[f32; D]; D]],
    rows: &Window<D>,
    least: u32,
) {
    image.begin();
    for (&j, block) in columns.iter().zip(blocks) {
        let (aggregates, entries) = rows.row(j as usize);
        for (&aggregate, entry) in aggregates.iter().zip(entries) {
            if aggregate >= least {
                // SAFETY: the caller's.
                unsafe { add_product::<N, D>(image.block(aggregate), block, entry) };
            }
        }
    }
}

/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
unsafe fn smooth_lanes<N: Lanes<S = f32>, const D: usize>(
    image: &mut Image<D>,
    omega: f32,
    inverse: &[[f32; D]; D],
    home: u32,
    own: &Wide<D>,
) {
    // SAFETY: the caller's; rows of `Wide` are arrays of eight scalars.
    unsafe {
        for block in &mut image.blocks {
            let b: [N; D] = std::array::from_fn(|k| N::load(block.0[k].as_ptr()));
            for r in 0..D {
                let mut lanes = N::zero();
                for k in 0..D {
                    lanes = lanes.fma(N::splat(-omega * inverse[r][k]), b[k]);
                }
                lanes.store(block.0[r].as_mut_ptr());
            }
        }
    }
    let block = image.block(home);
    for (sum, own) in block.0.iter_mut().zip(&own.0) {
        sum.iter_mut().zip(own).for_each(|(s, o)| *s += o);
    }
}

/// `sum += a b`.
///
/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
unsafe fn add_product<N: Lanes<S = f32>, const D: usize>(
    sum: &mut Wide<D>,
    a: &[[f32; D]; D],
    b: &Wide<D>,
) {
    // SAFETY: the caller vouches for the instruction set; rows of `Wide` are arrays of eight scalars.
    unsafe {
        let b: [N; D] = std::array::from_fn(|k| N::load(b.0[k].as_ptr()));
        for r in 0..D {
            let mut lanes = N::load(sum.0[r].as_ptr());
            for k in 0..D {
                lanes = lanes.fma(N::splat(a[r][k]), b[k]);
            }
            lanes.store(sum.0[r].as_mut_ptr());
        }
    }
}

/// # Safety
/// The instruction set of `N` is there.
#[inline(always)]
unsafe fn transposed_lanes<N: Lanes<S = f32>, const D: usize>(
    sum: &mut Wide6,
    a: &Wide<D>,
    b: &Wide<D>,
) {
    // SAFETY: the caller vouches for the instruction set; rows are arrays of eight scalars.
    unsafe {
        let b: [N; D] = std::array::from_fn(|k| N::load(b.0[k].as_ptr()));
        for r in 0..6 {
            let mut lanes = N::load(sum.0[r].as_ptr());
            for k in 0..D {
                lanes = lanes.fma(N::splat(a.0[k][r]), b[k]);
            }
            lanes.store(sum.0[r].as_mut_ptr());
        }
    }
}
