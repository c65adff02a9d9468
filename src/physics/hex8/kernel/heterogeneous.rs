//! Owns the loops over elements that differ from one another.

use super::super::stencils::{NINTH, Stencils};
use super::{node, own};
use crate::discretisation::voxels::VoxelMesh;
use crate::simd;
use crate::simd::{Isa, Lanes};
use std::ops::{Mul, Range};

/// The node that is the corner of smallest x, y, z of element `e` around node `i` of a segment.
#[inline(always)]
pub fn low_corner(rows: &[u32; 9], i: usize, e: usize) -> usize {
    let (x, y, z) = (e & 1, e >> 1 & 1, e >> 2);
    rows[y + 3 * z] as usize + i + x - 1
}

/// Elements that differ: a factor each, and a kind each where there is more than one table of stencils.
#[derive(Clone, Copy)]
pub struct Elements<'a> {
    pub mesh: &'a VoxelMesh,
    pub factor: &'a [f32],
    pub kind: &'a [u8],
}

/// [`rows_f64`] with a factor per element.
pub fn heterogeneous_f64(
    tables: &[Stencils<f64>],
    elements: Elements,
    nodes: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
) {
    match simd::isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 => unsafe { heterogeneous_avx512(tables, elements, nodes, x, y) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        Isa::Avx2 => unsafe { heterogeneous_avx2_f64(tables, elements, nodes, x, y) },
        _ => gather_heterogeneous::<simd::PlainF64>(tables, elements, nodes, x, y),
    }
}

/// The same in single precision.
pub fn heterogeneous_f32(
    tables: &[Stencils<f32>],
    elements: Elements,
    nodes: Range<usize>,
    x: &[[f32; 3]],
    y: &mut [[f32; 3]],
) {
    match simd::isa() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: the processor has what the function asks for.
        Isa::Avx512 | Isa::Avx2 => unsafe { heterogeneous_avx2_f32(tables, elements, nodes, x, y) },
        _ => gather_heterogeneous::<simd::PlainF32>(tables, elements, nodes, x, y),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn heterogeneous_avx512(
    t: &[Stencils<f64>],
    e: Elements,
    n: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
) {
    gather_heterogeneous::<simd::Avx512F64>(t, e, n, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn heterogeneous_avx2_f64(
    t: &[Stencils<f64>],
    e: Elements,
    n: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
) {
    gather_heterogeneous::<simd::Avx2F64>(t, e, n, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn heterogeneous_avx2_f32(
    t: &[Stencils<f32>],
    e: Elements,
    n: Range<usize>,
    x: &[[f32; 3]],
    y: &mut [[f32; 3]],
) {
    gather_heterogeneous::<simd::Avx2F32>(t, e, n, x, y);
}

#[inline(always)]
fn gather_heterogeneous<L: Lanes<S: From<f32> + Mul<Output = L::S>>>(
    tables: &[Stencils<L::S>],
    elements: Elements,
    nodes: Range<usize>,
    x: &[[L::S; 3]],
    y: &mut [[L::S; 3]],
) {
    let Elements { mesh, factor, kind } = elements;
    assert!(x.len() == mesh.len() && factor.len() == mesh.len());
    assert!(kind.is_empty() || kind.len() == mesh.len());
    assert!(nodes.end <= x.len() && y.len() == nodes.len());
    for segment in mesh.segments_in(nodes.clone()) {
        let own = segment.nodes();
        let around = &mesh.around[own.clone()];
        let out = &mut y[own.start - nodes.start..own.end - nodes.start];
        for (i, (&around, out)) in around.iter().zip(out).enumerate() {
            // SAFETY: as for equal elements; a row of elements reads two of the same rows and nodes.
            *out = match around {
                0 => [L::S::default(); 3],
                _ => unsafe {
                    heterogeneous_node::<L>(tables, around, elements, &segment.rows, i, x)
                },
            };
        }
    }
}

impl Elements<'_> {
    /// Factor and kind of all elements `around` node `i` of a segment, if they are alike. There is one at least.
    #[inline(always)]
    pub fn alike(self, around: u8, rows: &[u32; 9], i: usize) -> Option<(f32, usize)> {
        let lowest = around.trailing_zeros() as usize & 7;
        let first = self.of(low_corner(rows, i, lowest));
        let mut alike = true;
        for e in 0..8 {
            // Where there is no element, the first one again: no branch.
            let there = around >> e & 1 == 1;
            let e = if there { e } else { lowest };
            alike &= self.of(low_corner(rows, i, e)) == first;
        }
        alike.then_some(first)
    }

    #[inline(always)]
    pub fn of(self, low: usize) -> (f32, usize) {
        let kind = match self.kind.is_empty() {
            true => 0,
            false => usize::from(self.kind[low]),
        };
        (self.factor[low], kind)
    }
}

/// # Safety
/// `1 <= rows[r] + i < x.len() − 1` for every row that an element around the node reaches.
#[inline(always)]
unsafe fn heterogeneous_node<L: Lanes<S: From<f32> + Mul<Output = L::S>>>(
    tables: &[Stencils<L::S>],
    around: u8,
    elements: Elements,
    rows: &[u32; 9],
    i: usize,
    x: &[[L::S; 3]],
) -> [L::S; 3] {
    // SAFETY: the caller's promise holds for every row that is read.
    unsafe {
        // Inside bone a node costs what it would with one modulus for all.
        if let Some((factor, kind)) = elements.alike(around, rows, i) {
            let sums = node::<L>(tables[kind].stencil(around), rows, i, x);
            return sums.map(|v| v * L::S::from(factor));
        }
        let (here, last) = own::<L>(rows, i, x);
        let (mut a, mut b, mut c, mut four) = (L::zero(), L::zero(), L::zero(), L::zero4());
        for e in (0..8).filter(|e| around >> e & 1 == 1) {
            let (factor, kind) = elements.of(low_corner(rows, i, e));
            let stencil = tables[kind].stencil(1 << e);
            let (mut p, mut q, mut s, mut t) = (L::zero(), L::zero(), L::zero(), L::zero4());
            for k in 0..4 {
                let r = (e >> 1 & 1) + (k & 1) + 3 * ((e >> 2) + (k >> 1));
                let first = x.as_ptr().add(rows[r] as usize + i - 1).cast::<L::S>();
                let u = L::load(first).sub(here);
                let m = stencil.as_ptr().add(24 * r);
                p = p.fma(L::load(m), u);
                q = q.fma(L::load(m.add(8)), u);
                s = s.fma(L::load(m.add(16)), u);
                t = L::fma4(t, stencil.as_ptr().add(NINTH + 4 * r), first.add(8), last);
            }
            let f = L::S::from(factor);
            let wide = L::splat(f);
            a = a.fma(wide, p);
            b = b.fma(wide, q);
            c = c.fma(wide, s);
            four = L::scale4(four, f, t);
        }
        L::sum3(a, b, c, four)
    }
}
