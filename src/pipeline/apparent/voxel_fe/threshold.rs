//! Owns how the modulus of voxel elements answers to the threshold: what the voxels change that a threshold moves first.
//!
//! The bone voxels nearest to the threshold are taken away, the pores nearest to it are added, each by itself: together they are how energy
//! changes with volume. The staircase's energy density at its surface does not say that: its corners bear nothing.

use crate::discretisation::voxels::{Planes, VoxelMesh};
use crate::grid::Grid;
use crate::mask::gaussian;
use crate::physics::hex8::flips::Solved;
use crate::volume::{Specimen, Volume};
use rayon::prelude::*;
use std::cmp::Ordering;

/// Part of the bone volume that changes sides.
const MOVED: f64 = 0.01;

/// Voxels of either kind that are tried, evenly over all that change sides.
const TRIED: usize = 1000;

/// σ in voxels of the smoothing that says which voxels of a mask are nearest to its surface.
const SMOOTHED: f64 = 0.8;

/// Relative change of energy per relative change of volume; `mean` is that of the bricks' energies in N mm. Pores that would join bone that is
/// apart are left out: the topology stays, and nodes around them would not. Of a specimen without grey values the mask is smoothed in
/// their place. None without a surface.
pub fn sensitivity(solved: &Solved, specimen: &Specimen, grips: Planes, mean: f64) -> Option<f64> {
    let mut shell = Shell::of(solved.mesh, grips);
    let grid = shell.grid;
    let grey = specimen.grey.as_ref().zip(specimen.threshold.as_ref());
    match grey.filter(|(grey, _)| grey.grid.n == grid.n) {
        Some((grey, threshold)) => {
            let (values, voi) = (grey.as_slice(), threshold.inside.as_ref());
            // Pores above the upper threshold are not moved by the lower one.
            let moves = |e: &usize| values[*e] < threshold.lower;
            let is_inside = |e: &usize| voi.is_none_or(|voi| voi.as_slice()[*e] != 0);
            shell.pores.retain(|e| moves(e) && is_inside(e));
            let of = |voxels: &[usize]| voxels.iter().map(|e| values[*e]).collect();
            let values = [of(&shell.bone), of(&shell.pores)];
            shell.keep_nearest(values);
        }
        None => {
            let values = smoothed(grid, &shell.filled, [&shell.bone, &shell.pores]);
            shell.keep_nearest(values);
        }
    }
    let change = |e: &usize| solved.change(at(grid, *e).map(|v| v as i64));
    let mean_of = |voxels: &[usize]| {
        let step = voxels.len().div_ceil(TRIED).max(1);
        let tried = voxels.par_iter().step_by(step).filter_map(change);
        let tried: Vec<f64> = tried.collect();
        (!tried.is_empty()).then(|| tried.iter().sum::<f64>() / tried.len() as f64)
    };
    let [freed, stored] = [mean_of(&shell.bone)?, mean_of(&shell.pores)?];
    (mean > 0.0).then(|| 0.5 * (freed + stored) / mean)
}

/// Voxels that share a face with one of the other kind, by index in the grid.
struct Shell {
    grid: Grid,
    filled: Vec<bool>,
    elements: usize,
    /// Rising, as `pores` are.
    bone: Vec<usize>,
    pores: Vec<usize>,
}

impl Shell {
    /// Without pores next to the grips: new nodes where ends move would have to move with them.
    fn of(mesh: &VoxelMesh, grips: Planes) -> Shell {
        let grid = mesh.grid;
        let mut filled = vec![false; grid.len()];
        let elements = || mesh.low_corner_elements().flatten();
        elements().for_each(|e| filled[e] = true);
        let mut is_pore = vec![false; grid.len()];
        let mut bone = Vec::new();
        for e in elements() {
            let mut is_free = false;
            each_beside(grid, e, |other| {
                is_free |= !filled[other];
                is_pore[other] |= !filled[other];
            });
            if is_free {
                bone.push(e);
            }
        }
        bone.sort_unstable();
        let axis = grips.axis.index();
        let is_between = |e: &usize| {
            let z = at(grid, *e)[axis];
            z > grips.low && z + 1 < grips.high
        };
        let pores = (0..grid.len()).filter(|e| is_pore[*e]).filter(is_between);
        Shell {
            grid,
            elements: mesh.elements,
            bone,
            pores: pores.collect(),
            filled,
        }
    }

    /// Leaves [`MOVED`] of the volume: bone of the smallest values, pores of the largest. `of_bone` and `of_pores` are theirs.
    fn keep_nearest(&mut self, [of_bone, of_pores]: [Vec<f32>; 2]) {
        let moved = ((MOVED * self.elements as f64) as usize).max(1);
        let (grid, filled) = (self.grid, &self.filled);
        let rising =
            |values: &[f32], a: usize, b: usize| values[a].total_cmp(&values[b]).then(a.cmp(&b));
        let mut places: Vec<usize> = (0..self.bone.len()).collect();
        keep_first(
            &mut places,
            moved,
            |a, b| rising(&of_bone, *a, *b),
            |_| true,
        );
        self.bone = places.iter().map(|place| self.bone[*place]).collect();
        places = (0..self.pores.len()).collect();
        let pores = &self.pores;
        keep_first(
            &mut places,
            moved,
            |a, b| rising(&of_pores, *b, *a),
            |place| !joins(grid, filled, pores[place]),
        );
        self.pores = places.iter().map(|place| self.pores[*place]).collect();
    }
}

/// Leaves the first `n` of the voxels that may be kept, in their order. No two are equal in it. Few are asked for whether they may:
/// that takes longer than finding the first ones.
fn keep_first(
    voxels: &mut Vec<usize>,
    n: usize,
    order: impl Fn(&usize, &usize) -> Ordering,
    may_keep: impl Fn(usize) -> bool,
) {
    let (mut kept, mut rest) = (Vec::new(), &mut voxels[..]);
    while kept.len() < n && !rest.is_empty() {
        let count = (n - kept.len()).min(rest.len());
        if count < rest.len() {
            rest.select_nth_unstable_by(count, &order);
        }
        let (first, others) = rest.split_at_mut(count);
        first.sort_unstable_by(&order);
        kept.extend(first.iter().copied().filter(|e| may_keep(*e)));
        rest = others;
    }
    *voxels = kept;
}

fn at(grid: Grid, e: usize) -> [usize; 3] {
    let [nx, ny, _] = grid.n;
    [e % nx, e / nx % ny, e / (nx * ny)]
}

fn each_beside(grid: Grid, e: usize, mut visit: impl FnMut(usize)) {
    let ([nx, ny, _], place) = (grid.n, at(grid, e));
    for (a, stride) in [1, nx, nx * ny].into_iter().enumerate() {
        if place[a] > 0 {
            visit(e - stride);
        }
        if place[a] + 1 < grid.n[a] {
            visit(e + stride);
        }
    }
}

/// The mask at some voxels, smoothed: a guess of how near to the surface they are. Their indices rise.
fn smoothed(grid: Grid, filled: &[bool], at: [&[usize]; 2]) -> [Vec<f32>; 2] {
    let sharp = filled.iter().map(|f| f32::from(u8::from(*f))).collect();
    let sharp = Volume::from_vec(grid, sharp);
    let plane = grid.n[0] * grid.n[1];
    let slabs = gaussian::map_slabs(
        &sharp,
        SMOOTHED,
        |v| v,
        |slices, part| {
            let (first, end) = (slices.start * plane, slices.end * plane);
            at.map(|voxels| {
                let [from, to] = [first, end].map(|e| voxels.partition_point(|v| *v < e));
                voxels[from..to]
                    .iter()
                    .map(|e| part[e - first])
                    .collect::<Vec<f32>>()
            })
        },
    );
    [0, 1].map(|k| slabs.iter().flat_map(|slab| &slab[k]).copied().collect())
}

/// Whether bone around a pore is in parts that only the pore would join: voxels of 3 × 3 × 3 that share faces.
fn joins(grid: Grid, filled: &[bool], e: usize) -> bool {
    let centre = at(grid, e);
    let bone: [bool; 27] = std::array::from_fn(|i| {
        let step = [i % 3, i / 3 % 3, i / 9];
        let place: [usize; 3] = std::array::from_fn(|a| (centre[a] + step[a]).wrapping_sub(1));
        i != 13 && (0..3).all(|a| place[a] < grid.n[a]) && filled[grid.index(place)]
    });
    let share_a_face = |a: usize, b: usize| {
        let apart = |k: usize| (a / k % 3).abs_diff(b / k % 3);
        apart(1) + apart(3) + apart(9) == 1
    };
    let mut seen = [false; 27];
    let mut open: Vec<usize> = (0..27).find(|i| bone[*i]).into_iter().collect();
    while let Some(i) = open.pop() {
        seen[i] = true;
        open.extend((0..27).filter(|j| bone[*j] && !seen[*j] && share_a_face(i, *j)));
    }
    (0..27).any(|i| bone[i] && !seen[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that repeat: which of them stay, and in which order, is that of a whole sort.
    #[test]
    fn the_first_voxels_are_those_of_a_whole_sort() {
        let value = |e: usize| (e * 7919 % 31) as f32;
        let rising = |a: &usize, b: &usize| value(*a).total_cmp(&value(*b)).then(a.cmp(b));
        for n in [1, 2, 50, 199, 200, 201] {
            let mut sorted: Vec<usize> = (0..200).rev().collect();
            let mut kept = sorted.clone();
            keep_first(&mut kept, n, rising, |_| true);
            sorted.sort_unstable_by(rising);
            sorted.truncate(n);
            assert_eq!(kept, sorted, "{n}");
        }
    }
}
