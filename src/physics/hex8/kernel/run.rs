//! Owns the sweep along a row of bricks, eight at a time.

use super::brick::{self, Modes};
use super::window::Window;
use super::{Elements, Scalar};
use crate::discretisation::voxels::Segment;
use crate::simd::Lanes;
use std::ops::Range;

/// Nodes, one after the other, whose bricks' other rows of corners move in step.
#[derive(Clone, Copy)]
pub struct Run {
    pub start: usize,
    pub end: usize,
    /// From a node to those at the same x in the rows of larger y, z, and both.
    pub to: [isize; 3],
}

impl Run {
    /// The part of a segment that is in a range.
    pub fn of(s: &Segment, range: &Range<usize>) -> Self {
        Run {
            start: s.nodes().start.max(range.start),
            end: s.nodes().end.min(range.end),
            to: [5, 7, 8].map(|r| s.rows[r] as isize - s.start as isize),
        }
    }
}

/// Adds the forces of the bricks of a run.
///
/// # Safety
/// The instruction set of `L` is there.
#[inline(always)]
pub unsafe fn bricks<L: Lanes<S: Scalar>>(e: Elements<L::S>, run: Run, window: &mut Window<L::S>) {
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
