//! Owns the arithmetic of `A x`: bricks along x, eight at a time, in the modes of their corners ([`super::modes`]).
//!
//! Some 200 operations a brick, 567 a node if each gathered from its 27 neighbours; and a modulus of its own costs a brick 21
//! products. A range of nodes is swept brick by brick of those that have a corner in it. What they have in common with the
//! bricks of another range is made in both, so ranges should be several layers thick ([`chunk`]). Displacements and forces are
//! kept by component while they are worked on.

mod brick;
mod window;

use super::modes::Modal;
use crate::discretisation::voxels::{Segment, VoxelMesh};
use crate::simd;
use crate::simd::{Isa, Lanes};
use brick::{Modes, Wide};
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

/// Nodes per task: some layers, as of each task one more is made in vain.
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

/// Nodes, one after the other, whose bricks' other rows of corners move in step.
#[derive(Clone, Copy)]
struct Run {
    start: usize,
    end: usize,
    /// From a node to those at the same x in the rows of larger y, z, and both.
    to: [isize; 3],
}

impl Run {
    /// The part of a segment that is in a range.
    fn of(s: &Segment, range: &Range<usize>) -> Self {
        Run {
            start: s.nodes().start.max(range.start),
            end: s.nodes().end.min(range.end),
            to: [5, 7, 8].map(|r| s.rows[r] as isize - s.start as isize),
        }
    }
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

/// Adds the forces of the bricks of a run.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn bricks<L: Lanes<S: Scalar>>(e: Elements<L::S>, run: Run, window: &mut Window<L::S>) {
    // SAFETY: the caller's; rows of corners begin within the window, and it has room for two loads more at its end.
    unsafe {
        let mut carried = Carried::<L>::new();
        let mut at = run.start;
        while at < run.end {
            if !e.mesh.has_element(at) {
                at += 1;
                continue;
            }
            let count = (run.end - at).min(8);
            let mut rows = [window.place(at, 0); 4];
            for (row, to) in rows[1..].iter_mut().zip(run.to) {
                *row = window.place(at, to);
            }
            let q = [
                brick::modes::<L>(window.rows(0, &rows)),
                brick::modes::<L>(window.rows(1, &rows)),
                brick::modes::<L>(window.rows(2, &rows)),
            ];
            let g = forces::<L>(e, at, count, &q);
            if carried.next != at {
                carried.give(window);
            }
            for a in 0..3 {
                let (low, high) = brick::corners::<L>(&g[a]);
                for r in 0..4 {
                    let both = low[r].add(high[r].after(carried.forces[a][r]));
                    window.add(a, rows[r], both);
                    carried.forces[a][r] = high[r];
                }
            }
            at += 8;
            (carried.next, carried.rows) = (at, rows);
        }
        carried.give(window);
    }
}

/// What the last brick of a pack pulls at: the first node of the next pack, or one that no pack begins at.
struct Carried<L> {
    next: usize,
    /// Where the pack's rows begin.
    rows: [usize; 4],
    forces: [[L; 4]; 3],
}

impl<L: Lanes<S: Scalar>> Carried<L> {
    /// # Safety
    /// The instruction set of `L` is there.
    #[inline(always)]
    unsafe fn new() -> Self {
        Carried {
            next: usize::MAX,
            rows: [0; 4],
            // SAFETY: the caller's.
            forces: unsafe { [[L::zero(); 4]; 3] },
        }
    }

    /// Adds it where no pack begins.
    ///
    /// # Safety
    /// The instruction set of `L` is there.
    #[inline(always)]
    unsafe fn give(&mut self, window: &mut Window<L::S>) {
        if self.next == usize::MAX {
            return;
        }
        for a in 0..3 {
            for r in 0..4 {
                // SAFETY: the caller's; a pack's rows have a node after their eighth, or nothing is carried there.
                unsafe {
                    window.add(a, self.rows[r] + 8, L::zero().after(self.forces[a][r]));
                    self.forces[a][r] = L::zero();
                }
            }
        }
    }
}

/// Forces of the modes `q` of the bricks of `count` nodes from `at` on, those that exist.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
unsafe fn forces<L: Lanes<S: Scalar>>(
    e: Elements<L::S>,
    at: usize,
    count: usize,
    q: &Modes<L>,
) -> Modes<L> {
    let none = L::S::default();
    let around = &e.mesh.around[at..at + count];
    let mut factor = [none; 8];
    if e.factor.is_empty() {
        for (factor, around) in factor.iter_mut().zip(around) {
            *factor = if around >> 7 == 1 {
                L::S::from(1.0)
            } else {
                none
            };
        }
    } else {
        let own = &e.factor[at..at + count];
        for ((factor, around), own) in factor.iter_mut().zip(around).zip(own) {
            *factor = if around >> 7 == 1 {
                L::S::from(*own)
            } else {
                none
            };
        }
    }
    // SAFETY: the caller's.
    unsafe {
        if e.kind.is_empty() {
            return brick::forces::<L>(&e.modal[0], L::load(factor.as_ptr()), q);
        }
        let mut sum = [[L::zero(); 7]; 3];
        for (kind, modal) in e.modal.iter().enumerate() {
            let mut own = [none; 8];
            for (k, of) in e.kind[at..at + count].iter().enumerate() {
                if usize::from(*of) == kind {
                    own[k] = factor[k];
                }
            }
            let part = brick::forces::<L>(modal, L::load(own.as_ptr()), q);
            for (sum, part) in sum.iter_mut().zip(part) {
                for (sum, part) in sum.iter_mut().zip(part) {
                    *sum = sum.add(part);
                }
            }
        }
        sum
    }
}

/// Every set of registers that this processor has, with its name.
#[cfg(test)]
pub fn each_way_f64(mut visit: impl FnMut(&str, Way<f64>)) {
    // SAFETY: plain arrays ask for nothing; the others are asked for before each.
    visit("plain", |e, n, x, y| unsafe {
        sweep::<simd::PlainF64>(e, n, x, y, &mut Vec::new())
    });
    #[cfg(target_arch = "x86_64")]
    {
        if simd::isa() != Isa::Portable {
            visit("avx2", |e, n, x, y| unsafe {
                avx2_f64(e, n, x, y, &mut Vec::new())
            });
        }
        if simd::isa() == Isa::Avx512 {
            visit("avx512", |e, n, x, y| unsafe {
                avx512(e, n, x, y, &mut Vec::new())
            });
        }
    }
}

/// The same in single precision.
#[cfg(test)]
pub fn each_way_f32(mut visit: impl FnMut(&str, Way<f32>)) {
    // SAFETY: as above.
    visit("plain", |e, n, x, y| unsafe {
        sweep::<simd::PlainF32>(e, n, x, y, &mut Vec::new())
    });
    #[cfg(target_arch = "x86_64")]
    if simd::isa() != Isa::Portable {
        visit("avx2", |e, n, x, y| unsafe {
            avx2_f32(e, n, x, y, &mut Vec::new())
        });
    }
}

#[cfg(test)]
pub type Way<S> = fn(Elements<S>, Range<usize>, &[[S; 3]], &mut [[S; 3]]);
