//! Owns which components of bone touch across the faces of their cells, found slab by slab of the lattice: the cells of two
//! slabs at a time, whose voxels' labels are the most that is kept of any, are all there are.

use super::Component;
use super::cell::{Cell, NO_PIECE};
use crate::discretisation::lattice::placement::Frame;
use crate::volume::Volume;
use rayon::prelude::*;

/// Cells' components with less bone than this share of a cell are no sites.
const LEAST_FRACTION: f32 = 0.02;

const NO_SITE: u32 = u32::MAX;

/// Neighbours of every component with the bond of the stencil that leads there: `2a` up axis `a`, `2a + 1` down.
pub struct Touching {
    start: Vec<u32>,
    ends: Vec<u32>,
    bonds: Vec<u8>,
}

impl Touching {
    pub fn of(&self, component: usize) -> impl Iterator<Item = (usize, usize)> {
        let range = self.start[component] as usize..self.start[component + 1] as usize;
        range.map(|t| (self.ends[t] as usize, usize::from(self.bonds[t])))
    }

    /// `links[a]`: pairs of components that touch across a face along axis `a`, the lower one first.
    fn new(components: usize, links: &[Vec<[u32; 2]>; 3]) -> Self {
        let mut start = vec![0u32; components + 1];
        for end in links.iter().flatten().flatten() {
            start[*end as usize + 1] += 1;
        }
        for p in 0..components {
            start[p + 1] += start[p];
        }
        let total = start[components] as usize;
        let (mut ends, mut bonds) = (vec![0; total], vec![0; total]);
        let mut next = start.clone();
        for (a, links) in links.iter().enumerate() {
            for &[low, high] in links {
                for (from, to, bond) in [(low, high, 2 * a), (high, low, 2 * a + 1)] {
                    let place = &mut next[from as usize];
                    (ends[*place as usize], bonds[*place as usize]) = (to, bond as u8);
                    *place += 1;
                }
            }
        }
        Touching { start, ends, bonds }
    }
}

/// Cells of one slab with the number of each of their components.
struct Slab {
    cells: Vec<Option<Box<Cell>>>,
    numbers: Vec<Vec<u32>>,
}

/// All components that are large enough, in the order of their cells, and which of them touch.
pub fn find(frame: &Frame, bone: &Volume<u8>) -> (Vec<Component>, Touching) {
    let size = frame.n[0] * frame.n[1];
    let mut components = Vec::new();
    let mut links: [Vec<[u32; 2]>; 3] = Default::default();
    let mut before: Option<Slab> = None;
    for k in 0..frame.n[2] {
        let cells: Vec<_> = (k * size..(k + 1) * size)
            .into_par_iter()
            .map(|c| {
                let at = frame.position_mm(frame.indices(c));
                Cell::of(bone, at, frame.lp_mm, frame.axis).map(Box::new)
            })
            .collect();
        let numbers = number(&cells, k * size, &mut components);
        let slab = Slab { cells, numbers };
        for c in 0..size {
            if c % frame.n[0] > 0 {
                link(&slab, c - 1, &slab, c, 0, &mut links);
            }
            if c >= frame.n[0] {
                link(&slab, c - frame.n[0], &slab, c, 1, &mut links);
            }
            if let Some(before) = &before {
                link(before, c, &slab, c, 2, &mut links);
            }
        }
        before = Some(slab);
    }
    drop(before);
    let touching = Touching::new(components.len(), &links);
    (components, touching)
}

/// Numbers the components of a slab's cells, whose first candidate is `first`, on from those there are.
fn number(
    cells: &[Option<Box<Cell>>],
    first: usize,
    components: &mut Vec<Component>,
) -> Vec<Vec<u32>> {
    let mut of_cell = |(c, cell): (usize, &Option<Box<Cell>>)| {
        let found = cell.iter().flat_map(|cell| &cell.components);
        let number = |part: &super::cell::Part| {
            if part.fraction <= LEAST_FRACTION {
                return NO_SITE;
            }
            components.push(Component {
                cell: (first + c) as u32,
                fraction: part.fraction,
                ends: part.ends,
            });
            components.len() as u32 - 1
        };
        found.map(number).collect()
    };
    cells.iter().enumerate().map(&mut of_cell).collect()
}

/// Links the components of cell `c` of one slab to those of the next cell along axis `a`.
fn link(
    slab: &Slab,
    c: usize,
    next_slab: &Slab,
    n: usize,
    a: usize,
    links: &mut [Vec<[u32; 2]>; 3],
) {
    let (Some(cell), Some(next)) = (&slab.cells[c], &next_slab.cells[n]) else {
        return;
    };
    let first = links[a].len();
    for (&here, &there) in cell.last[a].iter().zip(&next.first[a]) {
        if here == NO_PIECE || there == NO_PIECE {
            continue;
        }
        let pair = [
            slab.numbers[c][usize::from(here)],
            next_slab.numbers[n][usize::from(there)],
        ];
        if !pair.contains(&NO_SITE) && !links[a][first..].contains(&pair) {
            links[a].push(pair);
        }
    }
}
