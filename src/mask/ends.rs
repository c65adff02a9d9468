//! Owns the ends of a specimen: the slices between which every part of a section bears bone, and how much of it plane ends touch.

use crate::grid::Axis;
use crate::volume::Volume;

/// Tiles with less than this share of the median tile's bone are slivers of the rim: where they end says nothing.
const SLIVER: f64 = 0.25;

/// First and past-the-last slice along z such that every tile of the section (about `tile_mm` wide) that holds bone has
/// some in the end slices or beyond them. None without bone, or where no slice is left.
pub fn flat(bone: &Volume<u8>, tile_mm: f64) -> Option<[usize; 2]> {
    let [nx, ny, nz] = bone.grid.n;
    let size = bone.grid.size_mm();
    // Of equal width, so that none is a sliver by itself.
    let tiles = |a: usize, n: usize| ((size[a] / tile_mm).round() as usize).clamp(1, n.max(1));
    let (across, down) = (tiles(0, nx), tiles(1, ny));
    let mut found = vec![Tile::new(nz); across * down];
    for (row, voxels) in bone.as_slice().chunks_exact(nx.max(1)).enumerate() {
        let (y, z) = (row % ny, row / ny);
        for x in (0..nx).filter(|&x| voxels[x] != 0) {
            found[y * down / ny * across + x * across / nx].meet(z);
        }
    }
    found.retain(|tile| tile.voxels > 0);
    found.sort_by_key(|tile| tile.voxels);
    let least = SLIVER * found.get(found.len() / 2)?.voxels as f64;
    let bearing = || found.iter().filter(|tile| tile.voxels as f64 >= least);
    let first = bearing().map(|tile| tile.first).max()?;
    let end = bearing().map(|tile| tile.end).min()?;
    (first < end).then_some([first, end])
}

/// Bone in the first and in the last slice across `axis` over the area that all bone covers as seen along it. None without bone.
pub fn touched(bone: &Volume<u8>, axis: Axis) -> Option<[f64; 2]> {
    let (n, voxels) = (bone.grid.n, bone.as_slice());
    let a = axis.index();
    let [b, c] = [[1, 2], [0, 2], [0, 1]][a];
    let mut seen = vec![false; n[b] * n[c]];
    let mut ends = [0usize; 2];
    for (i, _) in voxels.iter().enumerate().filter(|(_, v)| **v != 0) {
        let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
        seen[at[c] * n[b] + at[b]] = true;
        ends[0] += usize::from(at[a] == 0);
        ends[1] += usize::from(at[a] + 1 == n[a]);
    }
    let area = seen.iter().filter(|seen| **seen).count();
    (area > 0).then(|| ends.map(|count| count as f64 / area as f64))
}

#[derive(Clone, Copy)]
struct Tile {
    voxels: u64,
    first: usize,
    end: usize,
}

impl Tile {
    fn new(slices: usize) -> Self {
        Tile {
            voxels: 0,
            first: slices,
            end: 0,
        }
    }

    fn meet(&mut self, z: usize) {
        self.voxels += 1;
        self.first = self.first.min(z);
        self.end = self.end.max(z + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn block(bone: impl Fn([usize; 3]) -> bool) -> Volume<u8> {
        let n = [20, 20, 30];
        let grid = Grid::new(n, [0.05; 3]);
        let voxels = (0..grid.len()).map(|i| u8::from(bone([i % 20, i / 20 % 20, i / 400])));
        Volume::from_vec(grid, voxels.collect())
    }

    #[test]
    fn a_slanted_end_is_cut_where_its_lowest_tile_ends() {
        // The top falls from 28 at x = 0 to 18 at x = 19; the bottom is at 3.
        let slanted = block(|[x, _, z]| (3..28 - x / 2).contains(&z));
        // Tiles of five voxels: the last holds x = 15..19, of which 15 reaches highest, to 21.
        assert_eq!(flat(&slanted, 0.25), Some([3, 21]));
        assert_eq!(flat(&slanted, 0.05), Some([3, 19]));
        // Tiles wider than the section: only what is empty goes.
        assert_eq!(flat(&slanted, 5.0), Some([3, 28]));
    }

    #[test]
    fn plane_ends_touch_a_share_of_what_is_seen() {
        // A plate of 20 × 20 that stands on a foot of 4 × 5, empty above.
        let table = block(|[x, y, z]| z < 28 && z > 4 || z <= 4 && x < 4 && y < 5);
        assert_eq!(touched(&table, Axis::Z), Some([20.0 / 400.0, 0.0]));
        assert_eq!(
            touched(&table, Axis::X).map(|t| t.map(|v| v > 0.8)),
            Some([true, true])
        );
        assert_eq!(touched(&block(|_| false), Axis::Z), None);
    }

    #[test]
    fn slivers_and_pores_do_not_count() {
        let bone = |[x, y, z]: [usize; 3]| (2..26).contains(&z) && (x + y + z) % 3 == 0;
        let speck = block(|p| bone(p) && p[0] < 15 || p == [18, 3, 10]);
        assert_eq!(flat(&speck, 0.25), Some([2, 26]));
        assert_eq!(flat(&block(|_| false), 0.25), None);
        // Two halves that do not overlap along z have no common section.
        let halves = block(|[x, _, z]| (x < 10) == (z < 15));
        assert_eq!(flat(&halves, 0.5), None);
    }
}
