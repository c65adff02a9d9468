//! Owns the arithmetic of `A x`: bricks along x, eight at a time, in the modes of their corners ([`super::modes`]).
//!
//! Some 200 operations a brick, 567 a node if each gathered from its 27 neighbours; and a modulus of its own costs a brick 21
//! products. A range of nodes is swept brick by brick of those that have a corner in it. What they have in common with the
//! bricks of another range is made in both, so ranges should be several layers thick ([`chunk`]). Displacements and forces are
//! kept by component while they are worked on.

mod brick;
mod run;
mod window;

use super::modes::Modal;
use crate::discretisation::voxels::VoxelMesh;
use crate::simd;
use crate::simd::{Isa, Lanes};
use brick::Wide;
use run::{Run, bricks};
use std::ops::Range;
use window::{Room, Window};

/// Elements of a mesh: the stiffness of each kind, a factor each (none: all 1), and a kind each where there are several.
#[derive(Clone, Copy)]
pub struct Elements<'a, S> {
    pub mesh: &'a VoxelMesh,
    pub modal: &'a [Wide<S>],
    /// By the node that is the element's corner of smallest x, y, z.
    pub factor: &'a [f32],
    pub kind: &'a [u8],
}

/// Eight of each coefficient.
pub fn wide<S: Copy>(modal: &Modal<S>) -> Wide<S> {
    modal.map(|v| [v; 8])
}

/// Nodes per task: some layers, because each task computes one layer more than it uses.
pub fn chunk(mesh: &VoxelMesh) -> usize {
    let layers = mesh.grid.n[2] + 1;
    let thick = (layers / 16).clamp(4, 8);
    (thick * mesh.len()).div_ceil(layers).max(STEP)
}

/// Least nodes per task.
const STEP: usize = 2048;

/// A scalar that the kernel comes in.
pub trait Scalar: Copy + Default + From<f32> + Room + 'static {
    /// [`rows`] with what this processor has.
    fn rows(e: Elements<Self>, nodes: Range<usize>, x: &[[Self; 3]], y: &mut [[Self; 3]]);
}

impl Scalar for f64 {
    fn rows(e: Elements<f64>, nodes: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        Self::with_room(|room| match simd::isa() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 => unsafe { avx512(e, nodes, x, y, room) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            Isa::Avx2 => unsafe { avx2_f64(e, nodes, x, y, room) },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe { sweep::<simd::PlainF64>(e, nodes, x, y, room) },
        })
    }
}

impl Scalar for f32 {
    fn rows(e: Elements<f32>, nodes: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        Self::with_room(|room| match simd::isa() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has what the function asks for.
            Isa::Avx512 | Isa::Avx2 => unsafe { avx2_f32(e, nodes, x, y, room) },
            // SAFETY: plain arrays ask for nothing.
            _ => unsafe { sweep::<simd::PlainF32>(e, nodes, x, y, room) },
        })
    }
}

/// `y[i − nodes.start] = (A x)_i` for `i` in `nodes`.
pub fn rows<S: Scalar>(e: Elements<S>, nodes: Range<usize>, x: &[[S; 3]], y: &mut [[S; 3]]) {
    S::rows(e, nodes, x, y);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn avx512(
    e: Elements<f64>,
    nodes: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
    room: &mut Vec<f64>,
) {
    // SAFETY: this function has the features that the lanes ask for.
    unsafe { sweep::<simd::Avx512F64>(e, nodes, x, y, room) };
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2_f64(
    e: Elements<f64>,
    nodes: Range<usize>,
    x: &[[f64; 3]],
    y: &mut [[f64; 3]],
    room: &mut Vec<f64>,
) {
    // SAFETY: as above.
    unsafe { sweep::<simd::Avx2F64>(e, nodes, x, y, room) };
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2_f32(
    e: Elements<f32>,
    nodes: Range<usize>,
    x: &[[f32; 3]],
    y: &mut [[f32; 3]],
    room: &mut Vec<f32>,
) {
    // SAFETY: as above.
    unsafe { sweep::<simd::Avx2F32>(e, nodes, x, y, room) };
}

/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn sweep<L: Lanes<S: Scalar>>(
    e: Elements<L::S>,
    nodes: Range<usize>,
    x: &[[L::S; 3]],
    y: &mut [[L::S; 3]],
    room: &mut Vec<L::S>,
) {
    let n = e.mesh.len();
    assert!(x.len() == n && nodes.end <= n && y.len() == nodes.len());
    assert!(e.factor.is_empty() || e.factor.len() == n);
    assert!(e.kind.is_empty() || e.kind.len() == n);
    // Every brick with a corner among the nodes has its first corner here, and its others there.
    let corners = e.mesh.corners(nodes.clone());
    let firsts = corners.start..nodes.end;
    let mut window = Window::over(room, corners, x);
    let mut open: Option<Run> = None;
    let segments = &e.mesh.segments;
    let skipped = segments.partition_point(|s| s.nodes().end <= firsts.start);
    for segment in &segments[skipped..] {
        let next = Run::of(segment, &firsts);
        if next.start >= next.end {
            break;
        }
        match &mut open {
            Some(run) if run.end == next.start && run.to == next.to => run.end = next.end,
            _ => {
                if let Some(run) = open.replace(next) {
                    // SAFETY: the caller's.
                    unsafe { bricks::<L>(e, run, &mut window) };
                }
            }
        }
    }
    if let Some(run) = open {
        // SAFETY: the caller's.
        unsafe { bricks::<L>(e, run, &mut window) };
    }
    window.forces_at(nodes, y);
}

/// Every set of registers that this processor has, with its name.
#[cfg(test)]
pub fn each_way_f64(mut visit: impl FnMut(&str, Way<f64>)) {
    // SAFETY: plain arrays ask for nothing of the processor.
    visit("plain", |e, n, x, y| unsafe {
        sweep::<simd::PlainF64>(e, n, x, y, &mut Vec::new())
    });
    #[cfg(target_arch = "x86_64")]
    {
        if simd::isa() != Isa::Portable {
            // SAFETY: `isa` is other than portable only where there are AVX2 and FMA.
            visit("avx2", |e, n, x, y| unsafe {
                avx2_f64(e, n, x, y, &mut Vec::new())
            });
        }
        if simd::isa() == Isa::Avx512 {
            // SAFETY: `isa` says so only where there is AVX-512F, with AVX2 and FMA.
            visit("avx512", |e, n, x, y| unsafe {
                avx512(e, n, x, y, &mut Vec::new())
            });
        }
    }
}

/// The same in single precision.
#[cfg(test)]
pub fn each_way_f32(mut visit: impl FnMut(&str, Way<f32>)) {
    // SAFETY: plain arrays ask for nothing of the processor.
    visit("plain", |e, n, x, y| unsafe {
        sweep::<simd::PlainF32>(e, n, x, y, &mut Vec::new())
    });
    #[cfg(target_arch = "x86_64")]
    if simd::isa() != Isa::Portable {
        // SAFETY: `isa` is other than portable only where there are AVX2 and FMA.
        visit("avx2", |e, n, x, y| unsafe {
            avx2_f32(e, n, x, y, &mut Vec::new())
        });
    }
}

#[cfg(test)]
pub type Way<S> = fn(Elements<S>, Range<usize>, &[[S; 3]], &mut [[S; 3]]);
