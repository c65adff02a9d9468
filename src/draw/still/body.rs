//! Owns bone as rays see it: a smooth surface that keeps every voxel of the mask on its side.

use super::vec3::{Vec3, along, unit};
use crate::draw::reduced::Reduced;
use crate::volume::Volume;
use rayon::prelude::*;

/// The longest side of what rays walk through, in voxels; a longer mask is reduced by a whole factor.
const MOST: usize = 320;

/// Density at the surface.
pub(super) const SURFACE: f32 = 127.5;

/// Voxels a side of the blocks whose bone fractions give the ambient light.
const BLOCK: usize = 4;

/// Cells a side of the blocks that a ray passes in one step.
pub(super) const LEAP: usize = 8;

/// The bone, on a grid with one voxel more at each side that repeats the outermost. A point `q` of this grid has whole
/// coordinates in the middles of voxels.
pub(super) struct Body {
    /// Voxels with the repeated ones.
    pub(super) n: [usize; 3],
    /// Edges of a voxel, mm.
    pub(super) voxel_mm: Vec3,
    /// Half of it the mask, half of it the smoothed mask, 0 to 255: bone is never below the surface's value, pore never above.
    density: Vec<u8>,
    /// The smoothed mask: its gradient is the normal.
    soft: Vec<u8>,
    /// The highest density of the eight corners of the cell after a voxel.
    high: Vec<u8>,
    /// The highest of `high` in blocks of [`LEAP`] cells a side: where it is low, a ray passes the block in one step.
    high_blocks: Blocks,
    /// Smoothed bone fractions of blocks.
    blocks: Blocks,
    /// Voxels of the mask a side of a voxel here.
    pub(super) factor: usize,
}

struct Blocks {
    n: [usize; 3],
    share: Vec<u8>,
}

impl Body {
    pub(super) fn new(bone: &Volume<u8>) -> Body {
        let reduced = Reduced::new(bone, |n| n.iter().all(|n| *n <= MOST));
        let n = reduced.n.map(|n| n + 2);
        let padded = padded(&reduced.share, reduced.n);
        let soft = smoothed(&smoothed(&padded, n), n);
        let density: Vec<u8> = padded
            .par_iter()
            .zip(&soft)
            .map(|(&whole, &soft)| {
                let side: u32 = if whole >= reduced.level { 255 } else { 0 };
                ((side + u32::from(soft)) / 2) as u8
            })
            .collect();
        let high = highest(&density, n);
        Body {
            n,
            voxel_mm: bone
                .grid
                .spacing_mm
                .map(|s| (s * reduced.factor as f64) as f32),
            blocks: Blocks::new(&padded, n),
            high_blocks: Blocks::highest(&high, n),
            density,
            soft,
            high,
            factor: reduced.factor,
        }
    }

    /// Position in the grid of voxels of the point `q`.
    pub(super) fn to_grid(&self, at_mm: Vec3) -> Vec3 {
        std::array::from_fn(|a| at_mm[a] / self.voxel_mm[a] + 0.5)
    }

    /// Whether the surface can run through a cell.
    pub(super) fn is_near(&self, cell: [usize; 3]) -> bool {
        f32::from(self.high[self.index(cell)]) >= SURFACE
    }

    /// Whether the surface can run through a cell of the block that holds this one.
    pub(super) fn is_near_block(&self, cell: [usize; 3]) -> bool {
        let [x, y, z] = cell.map(|c| c / LEAP);
        let n = self.high_blocks.n;
        f32::from(self.high_blocks.share[x + n[0] * (y + n[1] * z)]) >= SURFACE
    }

    /// The same body, whose rays go cell by cell.
    #[cfg(test)]
    pub(super) fn without_leaps(mut self) -> Body {
        self.high_blocks.share.fill(255);
        self
    }

    pub(super) fn density(&self, q: Vec3) -> f32 {
        trilinear(&self.density, self.n, q)
    }

    /// Outwards, of length 1, at the point `q` of the surface: from four corners of a cube around it.
    pub(super) fn normal(&self, q: Vec3) -> Vec3 {
        let mut slope = [0.0; 3];
        for corner in [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ] {
            let value = trilinear(&self.soft, self.n, along(q, corner, 0.8));
            slope = along(slope, corner, -value);
        }
        unit(std::array::from_fn(|a| slope[a] / self.voxel_mm[a]))
    }

    /// `voxels` edges along x from `q`, in a direction of length 1.
    pub(super) fn moved(&self, q: Vec3, towards: Vec3, voxels: f32) -> Vec3 {
        std::array::from_fn(|a| q[a] + voxels * towards[a] * self.voxel_mm[0] / self.voxel_mm[a])
    }

    /// Bone fraction around `q`, 0 to 1; 0 outside the specimen's box.
    pub(super) fn fraction(&self, q: Vec3) -> f32 {
        if (0..3).any(|a| q[a] < 0.5 || q[a] > self.n[a] as f32 - 1.5) {
            return 0.0;
        }
        let block = q.map(|c| (c - 0.5 * (BLOCK as f32 - 1.0)) / BLOCK as f32);
        trilinear(&self.blocks.share, self.blocks.n, block) / 255.0
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.n[0] * (y + self.n[1] * z)
    }
}

impl Blocks {
    fn new(padded: &[u8], n: [usize; 3]) -> Blocks {
        let blocks = n.map(|n| n.div_ceil(BLOCK).max(2));
        let share = fill(blocks, |at| mean(padded, n, at, BLOCK));
        Blocks {
            n: blocks,
            share: smoothed(&share, blocks),
        }
    }
}

impl Blocks {
    fn highest(high: &[u8], n: [usize; 3]) -> Blocks {
        let blocks = n.map(|n| n.div_ceil(LEAP));
        let of_block = |at: [usize; 3]| {
            let [xs, ys, zs] =
                std::array::from_fn(|a| at[a] * LEAP..((at[a] + 1) * LEAP).min(n[a]));
            let rows = zs.flat_map(|z| ys.clone().map(move |y| n[0] * (y + n[1] * z)));
            let values = rows.flat_map(|row| &high[row + xs.start..row + xs.end]);
            values.copied().max().unwrap_or(0)
        };
        Blocks {
            n: blocks,
            share: fill(blocks, of_block),
        }
    }
}

/// A value for each voxel, x fastest.
fn fill(n: [usize; 3], value: impl Fn([usize; 3]) -> u8 + Sync) -> Vec<u8> {
    let mut all = vec![0; n[0] * n[1] * n[2]];
    all.par_chunks_mut(n[0] * n[1])
        .enumerate()
        .for_each(|(z, plane)| {
            for (y, row) in plane.chunks_mut(n[0]).enumerate() {
                row.iter_mut()
                    .enumerate()
                    .for_each(|(x, v)| *v = value([x, y, z]));
            }
        });
    all
}

/// The mean of one block.
fn mean(all: &[u8], n: [usize; 3], at: [usize; 3], side: usize) -> u8 {
    let [xs, ys, zs] =
        std::array::from_fn(|a| (at[a] * side).min(n[a] - 1)..((at[a] + 1) * side).min(n[a]));
    let count = xs.len() * ys.len() * zs.len();
    let rows = zs.flat_map(|z| ys.clone().map(move |y| n[0] * (y + n[1] * z)));
    let sum: usize = rows
        .map(|row| {
            all[row + xs.start..row + xs.end]
                .iter()
                .map(|&b| usize::from(b))
                .sum::<usize>()
        })
        .sum();
    (sum / count) as u8
}

/// With one voxel more at each side, which repeats the outermost.
fn padded(values: &[u8], inner: [usize; 3]) -> Vec<u8> {
    let n = inner.map(|n| n + 2);
    let mut all = vec![0; n[0] * n[1] * n[2]];
    let within = |i: usize, a: usize| i.saturating_sub(1).min(inner[a] - 1);
    all.par_chunks_mut(n[0]).enumerate().for_each(|(i, row)| {
        let (y, z) = (within(i % n[1], 1), within(i / n[1], 2));
        let from = &values[inner[0] * (y + inner[1] * z)..][..inner[0]];
        row[1..=inner[0]].copy_from_slice(from);
        row[0] = from[0];
        row[inner[0] + 1] = from[inner[0] - 1];
    });
    all
}

/// A quarter, a half and a quarter of three voxels along each axis; the outermost repeat.
fn smoothed(values: &[u8], n: [usize; 3]) -> Vec<u8> {
    let blend =
        |[a, b, c]: [u8; 3]| ((u16::from(a) + 2 * u16::from(b) + u16::from(c) + 2) / 4) as u8;
    of_three(values, n, blend)
}

/// The highest of the eight corners of the cell after each voxel.
fn highest(values: &[u8], n: [usize; 3]) -> Vec<u8> {
    let of_two = |[_, b, c]: [u8; 3]| b.max(c);
    of_three(values, n, of_two)
}

/// What `join` makes of each voxel and its two neighbours, along x, then y, then z; the outermost repeat.
fn of_three(values: &[u8], n: [usize; 3], join: impl Fn([u8; 3]) -> u8 + Sync) -> Vec<u8> {
    let mut along_x = vec![0; values.len()];
    let rows = along_x.par_chunks_mut(n[0]).zip(values.par_chunks(n[0]));
    rows.with_min_len(64).for_each(|(to, from)| {
        let last = n[0] - 1;
        to[0] = join([from[0], from[0], from[last.min(1)]]);
        to[last] = join([from[last.saturating_sub(1)], from[last], from[last]]);
        let inner = to.iter_mut().skip(1).zip(from.windows(3));
        inner.for_each(|(to, w)| *to = join([w[0], w[1], w[2]]));
    });
    let across = |from: &[u8], count: usize, step: usize| {
        let mut to = vec![0; from.len()];
        let lines = to
            .par_chunks_mut(step)
            .enumerate()
            .with_min_len(4096_usize.div_ceil(step));
        lines.for_each(|(i, to)| {
            let at = i % count;
            let line = |k: usize| &from[(i - at + k) * step..][..step];
            let (a, b, c) = (
                line(at.saturating_sub(1)),
                line(at),
                line((at + 1).min(count - 1)),
            );
            let three = a.iter().zip(b).zip(c);
            to.iter_mut()
                .zip(three)
                .for_each(|(to, ((a, b), c))| *to = join([*a, *b, *c]));
        });
        to
    };
    let along_y = across(&along_x, n[1], n[0]);
    across(&along_y, n[2], n[0] * n[1])
}
/// Between the middles of eight voxels; beyond the outermost, that one. Each side has two voxels or more.
#[inline]
fn trilinear(values: &[u8], n: [usize; 3], q: Vec3) -> f32 {
    let mut low = [0; 3];
    let mut share = [0.0; 3];
    for a in 0..3 {
        let c = q[a].clamp(0.0, (n[a] - 1) as f32);
        low[a] = (c as usize).min(n[a] - 2);
        share[a] = c - low[a] as f32;
    }
    let row = |y: usize, z: usize| {
        let at = low[0] + n[0] * (low[1] + y + n[1] * (low[2] + z));
        match values.get(at..at + 2) {
            Some(&[a, b]) => f32::from(a) + share[0] * (f32::from(b) - f32::from(a)),
            _ => 0.0,
        }
    };
    let plane = |z: usize| {
        let (a, b) = (row(0, z), row(1, z));
        a + share[1] * (b - a)
    };
    let (a, b) = (plane(0), plane(1));
    a + share[2] * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn every_voxel_stays_on_its_side_of_the_surface() {
        let grid = Grid::new([9, 7, 5], [0.1, 0.2, 0.3]);
        let mask: Vec<u8> = (0..grid.len()).map(|i| u8::from(i * i % 11 < 4)).collect();
        let body = Body::new(&Volume::from_vec(grid, mask.clone()));
        for (i, bone) in mask.iter().enumerate() {
            let at = [i % 9, i / 9 % 7, i / 63];
            let middle = std::array::from_fn(|a| (at[a] as f32 + 0.5) * grid.spacing_mm[a] as f32);
            assert_eq!(
                body.density(body.to_grid(middle)) > SURFACE,
                *bone != 0,
                "{at:?}"
            );
        }
    }

    #[test]
    fn the_normal_of_a_plane_is_its_own_whatever_the_voxels() {
        let grid = Grid::new([20, 20, 20], [0.1, 0.2, 0.4]);
        let mask = (0..grid.len()).map(|i| u8::from(i % 20 < 10)).collect();
        let body = Body::new(&Volume::from_vec(grid, mask));
        let normal = body.normal(body.to_grid([1.0, 2.0, 4.0]));
        assert!(
            (normal[0] - 1.0).abs() < 1e-5 && normal[1].abs() < 1e-5 && normal[2].abs() < 1e-5,
            "{normal:?}"
        );
    }
}
