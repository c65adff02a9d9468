//! Owns the arithmetic of `A x`: every node gathers from its 27 neighbours, eight lanes at a time.
//!
//! What is gathered are differences from the node's own displacement. A translation costs nothing, so in exact arithmetic
//! that is the same; but coefficients rounded to single precision no longer sum to zero, and without differences a soft
//! structure's bending drowned in what that made of its translations.
//!
//! Per node 243 products and sums and 81 differences (567 flops) in nine rows of 9 = 8 + 1 displacements, which lie one
//! after the other in memory. Traffic: 3 scalars read, 3 written, 1 byte for the elements around and a share of a segment; the
//! stencils in use stay in the first two caches.

mod heterogeneous;

pub use heterogeneous::{Elements, heterogeneous_f32, heterogeneous_f64, low_corner};

use super::stencils::{NINTH, STRIDE, Stencils};
use crate::discretisation::voxels::VoxelMesh;
use crate::simd;
use crate::simd::{Isa, Lanes};
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
    for segment in mesh.segments_in(nodes.clone()) {
        let own = segment.nodes();
        let around = &mesh.around[own.clone()];
        let out = &mut y[own.start - nodes.start..own.end - nodes.start];
        let mut i = 0;
        while i < around.len() {
            let stencil = table.stencil(around[i]);
            // SAFETY: the mesh numbers nodes such that no node of a segment has the first or the last number in any row; of two
            // nodes the second is of the same segment.
            unsafe {
                if around[i] == 0 {
                    out[i] = [L::S::default(); 3];
                } else if around.get(i + 1) == Some(&around[i]) {
                    [out[i], out[i + 1]] = two_nodes::<L>(stencil, &segment.rows, i, x);
                    i += 1;
                } else {
                    out[i] = node::<L>(stencil, &segment.rows, i, x);
                }
            }
            i += 1;
        }
    }
}

/// Every set of registers that this processor has, with its name.
#[cfg(test)]
pub fn each_way_f64(mut visit: impl FnMut(&str, Rows<f64>)) {
    visit("plain", gather::<simd::PlainF64>);
    #[cfg(target_arch = "x86_64")]
    {
        // SAFETY: asked for before each.
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            visit("avx2", |m, t, n, x, y| unsafe { avx2_f64(m, t, n, x, y) });
        }
        if simd::isa() == Isa::Avx512 {
            visit("avx512", |m, t, n, x, y| unsafe { avx512(m, t, n, x, y) });
        }
    }
}

/// The same in single precision.
#[cfg(test)]
pub fn each_way_f32(mut visit: impl FnMut(&str, Rows<f32>)) {
    visit("plain", gather::<simd::PlainF32>);
    #[cfg(target_arch = "x86_64")]
    if simd::isa() != Isa::Portable {
        // SAFETY: just asked for.
        visit("avx2", |m, t, n, x, y| unsafe { avx2_f32(m, t, n, x, y) });
    }
}

#[cfg(test)]
pub type Rows<S> = fn(&VoxelMesh, &Stencils<S>, Range<usize>, &[[S; 3]], &mut [[S; 3]]);

/// Node `i`'s own displacement, three times over but for the last component, and that.
///
/// # Safety
/// `rows[4] + i < x.len() − 1`.
#[inline(always)]
unsafe fn own<L: Lanes>(rows: &[u32; 9], i: usize, x: &[[L::S; 3]]) -> (L, L::Four) {
    // SAFETY: four scalars from the node's first on lie within `x`, since a node follows.
    unsafe {
        let own = x.as_ptr().add(rows[4] as usize + i).cast::<L::S>();
        (L::load_threes(own), L::splat4(*own.add(2)))
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
    // SAFETY: nine scalars from node `rows[r] + i − 1` on lie within `x`, by the caller's promise; stencils are of fixed size.
    unsafe {
        let (here, last) = own::<L>(rows, i, x);
        let (mut a, mut b, mut c, mut four) = (L::zero(), L::zero(), L::zero(), L::zero4());
        for (r, &base) in rows.iter().enumerate() {
            let first = x.as_ptr().add(base as usize + i - 1).cast::<L::S>();
            let u = L::load(first).sub(here);
            let k = stencil.as_ptr().add(24 * r);
            a = a.fma(L::load(k), u);
            b = b.fma(L::load(k.add(8)), u);
            c = c.fma(L::load(k.add(16)), u);
            four = L::fma4(
                four,
                stencil.as_ptr().add(NINTH + 4 * r),
                first.add(8),
                last,
            );
        }
        L::sum3(a, b, c, four)
    }
}

/// Nodes `i` and `i + 1`, whose stencils are the same: it is read once.
///
/// # Safety
/// `1 <= rows[r] + i < x.len() − 2` for every row.
#[inline(always)]
unsafe fn two_nodes<L: Lanes>(
    stencil: &[L::S; STRIDE],
    rows: &[u32; 9],
    i: usize,
    x: &[[L::S; 3]],
) -> [[L::S; 3]; 2] {
    // SAFETY: as in [`node`], for both nodes.
    unsafe {
        let (here_0, last_0) = own::<L>(rows, i, x);
        let (here_1, last_1) = own::<L>(rows, i + 1, x);
        let (mut a_0, mut b_0, mut c_0, mut four_0) = (L::zero(), L::zero(), L::zero(), L::zero4());
        let (mut a_1, mut b_1, mut c_1, mut four_1) = (a_0, b_0, c_0, four_0);
        for (r, &base) in rows.iter().enumerate() {
            let first = x.as_ptr().add(base as usize + i - 1).cast::<L::S>();
            let (u_0, u_1) = (
                L::load(first).sub(here_0),
                L::load(first.add(3)).sub(here_1),
            );
            let k = stencil.as_ptr().add(24 * r);
            let ninth = stencil.as_ptr().add(NINTH + 4 * r);
            let k_a = L::load(k);
            (a_0, a_1) = (a_0.fma(k_a, u_0), a_1.fma(k_a, u_1));
            let k_b = L::load(k.add(8));
            (b_0, b_1) = (b_0.fma(k_b, u_0), b_1.fma(k_b, u_1));
            let k_c = L::load(k.add(16));
            (c_0, c_1) = (c_0.fma(k_c, u_0), c_1.fma(k_c, u_1));
            four_0 = L::fma4(four_0, ninth, first.add(8), last_0);
            four_1 = L::fma4(four_1, ninth, first.add(11), last_1);
        }
        [
            L::sum3(a_0, b_0, c_0, four_0),
            L::sum3(a_1, b_1, c_1, four_1),
        ]
    }
}
