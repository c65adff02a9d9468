//! Owns the mesh of voxel finite elements: one 8-node brick per bone voxel, no lists of neighbours.
//!
//! Nodes are numbered along x, then y, then z. Where two stretches of nodes in a row are one missing node apart, that
//! node gets a number too, without elements; the first two and the last two numbers are such padding as well. So of any row
//! of neighbours the nodes at x−1, x, x+1 are numbered j−1, j, j+1 with one j, whichever of them exist, and whatever
//! is read in place of a missing one is a number of the same vector. Along a row, j moves in step with the node's own
//! number over long stretches, the [`Segment`]s.

use crate::error::{Error, Result};
use crate::grid::{Axis, Grid};
use crate::mask::runs::{Run, Runs};
use rayon::prelude::*;
use std::ops::Range;

/// Nodes `start..start + len` in one row at `(x, y, z)`, `(x + 1, y, z)`, ….
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Segment {
    pub start: u32,
    pub len: u32,
    /// Node indices (0 to n along each axis) of the first node.
    pub at: [u32; 3],
    /// For the first node, where each of the nine rows of neighbours (dy fastest, then dz, from −1) has its own x.
    pub rows: [u32; 9],
}

impl Segment {
    pub fn nodes(&self) -> Range<usize> {
        self.start as usize..(self.start + self.len) as usize
    }
}

/// The node planes that are gripped: those up to `low` and from `high` on, along `axis`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Planes {
    pub axis: Axis,
    pub low: usize,
    pub high: usize,
}

impl Planes {
    /// All planes within `grip_mm` of the two faces (0: the end planes).
    ///
    /// # Errors
    /// If the grips meet.
    pub fn within(grid: &Grid, axis: Axis, grip_mm: f64) -> Result<Self> {
        let (n, h) = (grid.n[axis.index()], grid.spacing_mm[axis.index()]);
        let low = ((grip_mm / h + 1e-9).floor().max(0.0) as usize).min(n);
        if 2 * low >= n {
            return Err(Error::setting(
                "grip_mm",
                format!(
                    "{grip_mm} mm at each end leaves nothing of a specimen {} mm long",
                    n as f64 * h
                ),
                "choose thinner grips",
            ));
        }
        Ok(Planes {
            axis,
            low,
            high: n - low,
        })
    }
}

/// Whether voxels (x fastest) for which `is_bone` holds join the grips by chains of shared nodes.
pub fn connects<T: Sync>(
    grid: Grid,
    voxels: &[T],
    is_bone: impl Fn(&T) -> bool + Sync,
    grips: Planes,
) -> bool {
    between(&Runs::of(grid.n, voxels, is_bone), grips).voxels() > 0
}

/// The runs of the parts that reach from grip to grip.
fn between(all: &Runs, grips: Planes) -> Runs {
    let spans = |run: Run, y: usize, z: usize| match grips.axis {
        Axis::X => [run.x0 as usize, run.x1 as usize],
        Axis::Y => [y, y + 1],
        Axis::Z => [z, z + 1],
    };
    all.spanning(
        |run, y, z| spans(run, y, z)[0] <= grips.low,
        |run, y, z| spans(run, y, z)[1] >= grips.high,
    )
}

/// Bit of [`VoxelMesh::around`] of the element on the side of larger x, y, z.
const LOW_CORNER_OF: u8 = 1 << 7;

/// One brick per voxel, those only that can carry load from grip to grip.
#[derive(Debug, Clone)]
pub struct VoxelMesh {
    /// The grid of elements.
    pub grid: Grid,
    pub segments: Vec<Segment>,
    /// Which of a node's eight elements exist: bit dx + 2 dy + 4 dz, with dx = 1 for the one on the side of larger x.
    pub around: Vec<u8>,
    pub elements: usize,
    /// Bone voxels left out because no chain of shared nodes joins them to both grips.
    pub dropped: usize,
}

impl VoxelMesh {
    /// Meshes the voxels (x fastest) for which `is_bone` holds.
    ///
    /// # Errors
    /// If there are more nodes than 32-bit numbers. A specimen without a path between the grips is an empty mesh.
    pub fn new<T: Sync>(
        grid: Grid,
        voxels: &[T],
        is_bone: impl Fn(&T) -> bool + Sync,
        grips: Planes,
    ) -> Result<Self> {
        let all = Runs::of(grid.n, voxels, is_bone);
        VoxelMesh::of(grid, &all, &between(&all, grips))
    }

    /// Meshes the voxels for which `is_bone` holds and that are joined to a face of the grid.
    ///
    /// # Errors
    /// If there are more nodes than 32-bit numbers. A specimen that reaches no face is an empty mesh.
    pub fn at_faces<T: Sync>(
        grid: Grid,
        voxels: &[T],
        is_bone: impl Fn(&T) -> bool + Sync,
    ) -> Result<Self> {
        let all = Runs::of(grid.n, voxels, is_bone);
        let [nx, ny, nz] = grid.n;
        let outer = |run: Run, y: usize, z: usize| {
            run.x0 == 0 || run.x1 as usize == nx || y == 0 || y + 1 == ny || z == 0 || z + 1 == nz
        };
        let kept = all.spanning(outer, outer);
        VoxelMesh::of(grid, &all, &kept)
    }

    /// Meshes the voxels for which `is_bone` holds and that are joined to a run for which `low` holds and to one for which `high` does.
    ///
    /// # Errors
    /// If there are more nodes than 32-bit numbers.
    pub fn joining<T: Sync>(
        grid: Grid,
        voxels: &[T],
        is_bone: impl Fn(&T) -> bool + Sync,
        low: impl Fn(Run, usize, usize) -> bool,
        high: impl Fn(Run, usize, usize) -> bool,
    ) -> Result<Self> {
        let all = Runs::of(grid.n, voxels, is_bone);
        let kept = all.spanning(low, high);
        VoxelMesh::of(grid, &all, &kept)
    }

    fn of(grid: Grid, all: &Runs, kept: &Runs) -> Result<Self> {
        let rows = Rows::number(kept)?;
        let (segments, around) = rows.fill(kept);
        Ok(VoxelMesh {
            grid,
            segments,
            around,
            elements: kept.voxels(),
            dropped: all.voxels() - kept.voxels(),
        })
    }

    /// Length of a vector over the nodes, padding included.
    pub fn len(&self) -> usize {
        self.around.len()
    }

    pub fn is_empty(&self) -> bool {
        self.elements == 0
    }

    /// Number of nodes, padding left out.
    pub fn nodes(&self) -> usize {
        self.around.par_iter().filter(|&&m| m != 0).count()
    }

    /// The segments that overlap a range of nodes, cut to it.
    pub fn segments_in(&self, nodes: Range<usize>) -> impl Iterator<Item = Segment> + '_ {
        let first = self
            .segments
            .partition_point(|s| s.nodes().end <= nodes.start);
        self.segments[first..]
            .iter()
            .take_while(move |s| (s.start as usize) < nodes.end)
            .map(move |s| {
                let skip = (nodes.start as u32).saturating_sub(s.start);
                let end = (s.start + s.len).min(nodes.end as u32);
                let mut cut = *s;
                cut.start += skip;
                cut.len = end - cut.start;
                cut.at[0] += skip;
                cut.rows.iter_mut().for_each(|r| *r += skip);
                cut
            })
    }

    /// A range that holds every neighbour of these nodes.
    pub fn reach(&self, nodes: Range<usize>) -> Range<usize> {
        let (mut low, mut high) = (nodes.start, nodes.end);
        for s in self.segments_in(nodes) {
            for row in s.rows.map(|r| r as usize) {
                low = low.min(row.saturating_sub(1));
                high = high.max(row + s.len as usize + 1);
            }
        }
        low..high.min(self.len())
    }

    /// Numbers from the first to the last corner of all bricks that have a corner among these nodes or, of those, their corner of
    /// smallest x, y, z before the last of them. Need not be tight.
    pub fn corners(&self, nodes: Range<usize>) -> Range<usize> {
        let numbered = PADDING as usize..self.len() - PADDING as usize;
        let (first, last) = (nodes.start.max(numbered.start), nodes.end.min(numbered.end));
        if first >= last {
            return nodes;
        }
        let from = |node: usize, d: i64| {
            let [x, y, z] = self.indices(node).map(i64::from);
            self.first_from([z + d, y + d, x + d])
        };
        let (low, high) = (from(first, -1), from(last - 1, 1));
        low.min(nodes.start)..(high + 1).max(nodes.end).min(self.len())
    }

    /// The first node at or after z, y, x, in the order of the nodes.
    fn first_from(&self, [z, y, x]: [i64; 3]) -> usize {
        let segments = &self.segments[1..self.segments.len() - 1];
        let end = |s: &Segment| {
            let [sx, sy, sz] = s.at.map(i64::from);
            [sz, sy, sx + i64::from(s.len)]
        };
        let next = segments.partition_point(|s| end(s) <= [z, y, x]);
        let Some(s) = segments.get(next) else {
            return self.len() - PADDING as usize;
        };
        let [sx, sy, sz] = s.at.map(i64::from);
        let skip = if [sz, sy] == [z, y] {
            (x - sx).max(0)
        } else {
            0
        };
        s.start as usize + skip as usize
    }

    /// The node with these indices (0 to n along each axis), where elements have one there.
    pub fn node(&self, at: [usize; 3]) -> Option<usize> {
        let [x, y, z] = at.map(|v| v as i64);
        let node = self.first_from([z, y, x]);
        let is_there = node < self.len() - PADDING as usize && self.around[node] != 0;
        (is_there && self.indices(node).map(|v| v as usize) == at).then_some(node)
    }

    /// Node indices (0 to n along each axis) of a node.
    pub fn indices(&self, node: usize) -> [u32; 3] {
        let i = self.segments.partition_point(|s| s.nodes().end <= node);
        let s = self.segments[i];
        [s.at[0] + node as u32 - s.start, s.at[1], s.at[2]]
    }

    /// Position of a node in mm.
    pub fn position(&self, node: usize) -> [f64; 3] {
        let at = self.indices(node);
        std::array::from_fn(|a| f64::from(at[a]) * self.grid.spacing_mm[a])
    }

    /// Whether the element of which `node` is the corner of smallest x, y, z exists.
    pub fn has_element(&self, node: usize) -> bool {
        self.around[node] & LOW_CORNER_OF != 0
    }

    /// The element of which each node is the corner of smallest x, y, z, in the order of the nodes, as indices into
    /// the grid; None where that element does not exist.
    pub fn low_corner_elements(&self) -> impl Iterator<Item = Option<usize>> + '_ {
        self.segments.iter().flat_map(move |s| {
            s.nodes().map(move |node| {
                let x = s.at[0] as usize + node - s.start as usize;
                let at = [x, s.at[1] as usize, s.at[2] as usize];
                self.has_element(node).then(|| self.grid.index(at))
            })
        })
    }
}

/// Numbers without a node at either end: a row may be addressed one node before its first or after its last.
const PADDING: u32 = 2;

/// A stretch of numbered nodes `x0..x1` of one row.
#[derive(Clone, Copy)]
struct Stretch {
    x0: u32,
    x1: u32,
    start: u32,
}

/// All stretches, row by row of nodes.
struct Rows {
    n: [usize; 3],
    stretches: Vec<Stretch>,
    rows: Vec<usize>,
    numbers: u32,
}

impl Rows {
    fn number(kept: &Runs) -> Result<Self> {
        let n = [kept.n[0] + 1, kept.n[1] + 1, kept.n[2] + 1];
        let mut by_row: Vec<Vec<Stretch>> = (0..n[1] * n[2])
            .into_par_iter()
            .map(|row| stretches(kept, row % n[1], row / n[1]))
            .collect();
        let mut next = PADDING as u64;
        for stretch in by_row.iter_mut().flatten() {
            stretch.start = next as u32;
            next += u64::from(stretch.x1 - stretch.x0);
            // Room for the padding at the end, so that start + len and rows + 1 never overflow.
            if next > u64::from(u32::MAX) - 8 {
                return Err(Error::specimen(
                    "more than 4 294 967 287 nodes, which 32-bit node numbers cannot count",
                    "crop or coarsen the scan",
                ));
            }
        }
        let mut rows = vec![0];
        for row in &by_row {
            rows.push(rows.last().unwrap_or(&0) + row.len());
        }
        Ok(Rows {
            n,
            stretches: by_row.into_iter().flatten().collect(),
            rows,
            numbers: next as u32 + PADDING,
        })
    }

    fn row(&self, y: isize, z: isize) -> &[Stretch] {
        if y < 0 || z < 0 || y >= self.n[1] as isize || z >= self.n[2] as isize {
            return &[];
        }
        let row = z as usize * self.n[1] + y as usize;
        &self.stretches[self.rows[row]..self.rows[row + 1]]
    }

    /// Segments that tile all numbers, and every node's elements.
    fn fill(&self, kept: &Runs) -> (Vec<Segment>, Vec<u8>) {
        let mut around = vec![0u8; self.numbers as usize];
        let mut rest = &mut around[PADDING as usize..];
        let mut planes = Vec::new();
        for z in 0..self.n[2] {
            let stretches =
                &self.stretches[self.rows[z * self.n[1]]..self.rows[(z + 1) * self.n[1]]];
            let numbers: u32 = stretches.iter().map(|s| s.x1 - s.x0).sum();
            let (here, others) = rest.split_at_mut(numbers as usize);
            planes.push((z, here));
            rest = others;
        }
        let inner: Vec<Vec<Segment>> = planes
            .into_par_iter()
            .map(|(z, around)| self.fill_plane(kept, z, around))
            .collect();
        let padding = |start| Segment {
            start,
            len: PADDING,
            at: [0; 3],
            rows: [start; 9],
        };
        let mut segments = vec![padding(0)];
        segments.extend(inner.into_iter().flatten());
        segments.push(padding(self.numbers - PADDING));
        (segments, around)
    }

    fn fill_plane(&self, kept: &Runs, z: usize, around: &mut [u8]) -> Vec<Segment> {
        let mut bits = vec![0u8; self.n[0]];
        let mut segments = Vec::new();
        let mut done = 0;
        for y in 0..self.n[1] {
            elements_around(kept, y, z, &mut bits);
            for s in self.row(y as isize, z as isize) {
                let len = (s.x1 - s.x0) as usize;
                around[done..done + len].copy_from_slice(&bits[s.x0 as usize..s.x1 as usize]);
                done += len;
                self.cut(*s, y, z, &mut segments);
            }
        }
        segments
    }

    /// Cuts one stretch where the offset to any row of neighbours changes.
    fn cut(&self, s: Stretch, y: usize, z: usize, segments: &mut Vec<Segment>) {
        let neighbours: [&[Stretch]; 9] = std::array::from_fn(|r| {
            self.row(
                y as isize + r as isize % 3 - 1,
                z as isize + r as isize / 3 - 1,
            )
        });
        let mut cursor = [0; 9];
        let mut x = s.x0;
        while x < s.x1 {
            let own = s.start + (x - s.x0);
            let mut end = s.x1;
            let mut rows = [own; 9];
            for r in 0..9 {
                let row = neighbours[r];
                while cursor[r] < row.len() && row[cursor[r]].x1 < x {
                    cursor[r] += 1;
                }
                // The stretch that holds x − 1, x or x + 1, if any; it serves nodes up to its own end + 1.
                match row.get(cursor[r]) {
                    Some(t) if t.x0 <= x + 1 => {
                        rows[r] = t.start + x - t.x0;
                        end = end.min(t.x1 + 1);
                    }
                    Some(t) => end = end.min(t.x0 - 1),
                    None => {}
                }
            }
            segments.push(Segment {
                start: own,
                len: end - x,
                at: [x, y as u32, z as u32],
                rows,
            });
            x = end;
        }
    }
}

/// The node stretches of one row, gaps of one node closed, numbers still open.
fn stretches(kept: &Runs, y: usize, z: usize) -> Vec<Stretch> {
    let (y, z) = (y as isize, z as isize);
    let mut all: Vec<[u32; 2]> = [(y - 1, z - 1), (y, z - 1), (y - 1, z), (y, z)]
        .into_iter()
        .flat_map(|(y, z)| kept.row(y, z))
        .map(|r| [r.x0, r.x1 + 1])
        .collect();
    all.sort_unstable();
    let mut out: Vec<Stretch> = Vec::new();
    for [x0, x1] in all {
        match out.last_mut() {
            Some(last) if x0 <= last.x1 + 1 => last.x1 = last.x1.max(x1),
            _ => out.push(Stretch { x0, x1, start: 0 }),
        }
    }
    out
}

/// `bits[x]`: which of the eight elements around node `(x, y, z)` exist.
fn elements_around(kept: &Runs, y: usize, z: usize, bits: &mut [u8]) {
    bits.fill(0);
    for corner in 0..4usize {
        let (dy, dz) = (corner % 2, corner / 2);
        let row = kept.row(y as isize + dy as isize - 1, z as isize + dz as isize - 1);
        let low = 1u8 << (2 * dy + 4 * dz);
        for run in row {
            for x in run.x0 as usize..run.x1 as usize {
                bits[x] |= low << 1;
                bits[x + 1] |= low;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn random(n: [usize; 3], percent: u64, seed: u64) -> Vec<u8> {
        let mut state = seed * 7919 + 1;
        (0..n.iter().product())
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
                u8::from((state >> 33) % 100 < percent)
            })
            .collect()
    }

    /// Every node's nine rows of three against a table of positions.
    #[test]
    fn rows_address_all_27_neighbours() {
        let n = [9, 6, 5];
        for seed in 0..30 {
            let grid = Grid::new(n, [1.0; 3]);
            let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
            let mask = random(n, 30, seed);
            let mesh = VoxelMesh::new(grid, &mask, |&b| b != 0, grips).unwrap();
            let mut numbers = HashMap::new();
            for i in 0..mesh.len() {
                if mesh.around[i] != 0 {
                    numbers.insert(mesh.indices(i).map(|v| v as i64), i as i64);
                }
            }
            assert_eq!(numbers.len(), mesh.nodes());
            for s in &mesh.segments {
                for i in 0..s.len {
                    check_node(&mesh, s, i, &numbers);
                }
            }
        }
    }

    fn check_node(mesh: &VoxelMesh, s: &Segment, i: u32, numbers: &HashMap<[i64; 3], i64>) {
        let at = [s.at[0] + i, s.at[1], s.at[2]].map(i64::from);
        for r in 0..9 {
            let base = i64::from(s.rows[r] + i);
            if mesh.around[(s.start + i) as usize] == 0 {
                continue; // padding: never read from
            }
            assert!(base >= 1 && base + 1 < mesh.len() as i64);
            for dx in -1..=1 {
                let q = [
                    at[0] + dx,
                    at[1] + r as i64 % 3 - 1,
                    at[2] + r as i64 / 3 - 1,
                ];
                if let Some(&number) = numbers.get(&q) {
                    assert_eq!(number, base + dx);
                }
            }
        }
    }

    #[test]
    fn grips_that_meet_are_refused() {
        let grid = Grid::new([4, 4, 10], [0.1; 3]);
        assert!(Planes::within(&grid, Axis::Z, 0.5).is_err());
        let planes = Planes::within(&grid, Axis::Z, 0.3).unwrap();
        assert_eq!((planes.low, planes.high), (3, 7));
    }
}
