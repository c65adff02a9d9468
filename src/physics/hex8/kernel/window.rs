//! Owns displacements and forces of the nodes around a range, by component.

use crate::simd::Lanes;
use std::cell::RefCell;
use std::ops::Range;

/// Room past the last node for two whole loads.
const PAST: usize = 24;

/// Room that each thread keeps.
pub trait Room: Sized {
    fn with_room(f: impl FnOnce(&mut Vec<Self>));
}

macro_rules! room {
    ($s:ty) => {
        impl Room for $s {
            fn with_room(f: impl FnOnce(&mut Vec<Self>)) {
                thread_local! {
                    static ROOM: RefCell<Vec<$s>> = const { RefCell::new(Vec::new()) };
                }
                ROOM.with_borrow_mut(f);
            }
        }
    };
}

room!(f32);
room!(f64);

pub struct Window<'a, S> {
    first: usize,
    /// Numbers from one component to the next.
    stride: usize,
    x: &'a mut [S],
    force: &'a mut [S],
}

impl<'a, S: Copy + Default> Window<'a, S> {
    /// With the displacements `x` of all nodes, of which `nodes` are wanted.
    #[inline(always)]
    pub fn over(room: &'a mut Vec<S>, nodes: Range<usize>, x: &[[S; 3]]) -> Self {
        let stride = nodes.len() + PAST;
        if room.len() < 6 * stride {
            room.resize(6 * stride, S::default());
        }
        let (of_x, rest) = room.split_at_mut(3 * stride);
        let force = &mut rest[..3 * stride];
        force.fill(S::default());
        let (u, rest) = of_x.split_at_mut(stride);
        let (v, w) = rest.split_at_mut(stride);
        let values = &x[nodes.clone()];
        let all = u.iter_mut().zip(v.iter_mut()).zip(w.iter_mut());
        for (((u, v), w), x) in all.zip(values) {
            [*u, *v, *w] = *x;
        }
        for past in [u, v, w] {
            past[values.len()..].fill(S::default());
        }
        Window {
            first: nodes.start,
            stride,
            x: of_x,
            force,
        }
    }

    /// Where the node `to` numbers on from `node` is; within the window also where no such node exists.
    #[inline(always)]
    pub fn place(&self, node: usize, to: isize) -> usize {
        let place = node.wrapping_add_signed(to).wrapping_sub(self.first);
        debug_assert!(place + PAST <= self.stride);
        place
    }

    /// Four rows of component `a`, from places of [`Window::place`] on.
    #[inline(always)]
    pub fn rows(&self, a: usize, places: &[usize; 4]) -> [*const S; 4] {
        let x = self.x.as_ptr().wrapping_add(a * self.stride);
        [0, 1, 2, 3].map(|r: usize| x.wrapping_add(places[r]))
    }

    /// Adds eight forces.
    ///
    /// # Safety
    /// The place is one of [`Window::place`], or eight on; the instruction set of `L` is there.
    #[inline(always)]
    pub unsafe fn add<L: Lanes<S = S>>(&mut self, a: usize, place: usize, forces: L) {
        // SAFETY: the caller's.
        unsafe {
            let at = self.force.as_mut_ptr().add(a * self.stride + place);
            L::load(at).add(forces).store(at);
        }
    }

    /// Writes the forces at these nodes.
    #[inline(always)]
    pub fn forces_at(&self, nodes: Range<usize>, y: &mut [[S; 3]]) {
        let part = |a: usize| {
            let start = a * self.stride + nodes.start - self.first;
            &self.force[start..start + nodes.len()]
        };
        let all = part(0).iter().zip(part(1)).zip(part(2));
        for (y, ((u, v), w)) in y.iter_mut().zip(all) {
            *y = [*u, *v, *w];
        }
    }
}
