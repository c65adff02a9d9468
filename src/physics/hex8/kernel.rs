//! Owns the arithmetic of `A x`: every node gathers from its 27 neighbours, eight lanes at a time.
//!
//! Per node 243 products and sums (486 flops) in nine rows of 9 = 8 + 1 displacements, which lie one after the other
//! in memory. Traffic: 3 scalars read, 3 written, 1 byte for the elements around and a share of a segment; the
//! stencils in use stay in the first two caches.

use super::stencils::{NINTH, STRIDE, Stencils};
use crate::simd::{self, Isa, Lanes};
use crate::topology::voxels::VoxelMesh;
use std::ops::Range;

/// `y[i − nodes.start] = (A x)_i` for `i` in `nodes`, in double precision.
pub fn rows_f64(
    mesh: &VoxelMesh,
    table: &Stencils<f64>,
    nodes: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
) {
    match simd::isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 => unsafe { avx512(mesh, table, nodes, x, y) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Isa::Avx2 => unsafe { avx2_f64(mesh, table, nodes, x, y) },
        _ => gather::<simd::PlainF64>(mesh, table, nodes, x, y),
    }
}

/// The same in single precision.
pub fn rows_f32(
    mesh: &VoxelMesh,
    table: &Stencils<f32>,
    nodes: Range<usize>,
    x: &[[f32; 3]],
    y: &mut [[f32; 3]],
) {
    match simd::isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 | Isa::Avx2 => unsafe { avx2_f32(mesh, table, nodes, x, y) },
        _ => gather::<simd::PlainF32>(mesh, table, nodes, x, y),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn avx512(m: &VoxelMesh, t: &Stencils<f64>, n: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
    gather::<simd::Avx512F64>(m, t, n, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2_f64(m: &VoxelMesh, t: &Stencils<f64>, n: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
    gather::<simd::Avx2F64>(m, t, n, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2_f32(m: &VoxelMesh, t: &Stencils<f32>, n: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
    gather::<simd::Avx2F32>(m, t, n, x, y);
}

#[inline(always)]
fn gather<L: Lanes>(
    mesh: &VoxelMesh,
    table: &Stencils<L::S>,
    nodes: Range<usize>,
    x: &[[L::S; 3]],
    y: &mut [[L::S; 3]],
) {
    assert!(x.len() == mesh.len() && nodes.end <= x.len() && y.len() == nodes.len());
    for (segment, _) in mesh.segments_in(nodes.clone()) {
        let own = segment.nodes();
        let around = &mesh.around[own.clone()];
        let out = &mut y[own.start - nodes.start..own.end - nodes.start];
        for (i, (&around, out)) in around.iter().zip(out).enumerate() {
            *out = if around == 0 {
                [L::S::default(); 3]
            } else {
                // SAFETY: the mesh numbers nodes such that a row's base is never the first or the last number.
                unsafe { node::<L>(table.stencil(around), &segment.rows, i, x) }
            };
        }
    }
}

/// # Safety
/// `1 <= rows[r] + i < x.len() − 1` for every row.
#[inline(always)]
pub unsafe fn node<L: Lanes>(
    stencil: &[L::S; STRIDE],
    rows: &[u32; 9],
    i: usize,
    x: &[[L::S; 3]],
) -> [L::S; 3] {
    unsafe {
        let (mut a, mut b, mut c, mut four) = (L::zero(), L::zero(), L::zero(), L::zero4());
        for (r, &base) in rows.iter().enumerate() {
            let first = x.as_ptr().add(base as usize + i - 1).cast::<L::S>();
            let u = L::load(first);
            let k = stencil.as_ptr().add(24 * r);
            a = a.fma(L::load(k), u);
            b = b.fma(L::load(k.add(8)), u);
            c = c.fma(L::load(k.add(16)), u);
            four = L::fma4(four, stencil.as_ptr().add(NINTH + 4 * r), first.add(8));
        }
        L::sum3(a, b, c, four)
    }
}
