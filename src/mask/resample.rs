//! Owns finer and coarser copies of a mask for voxel finite elements.

use crate::grid::Grid;
use crate::volume::Volume;
use rayon::prelude::*;

/// Every voxel split into `factor`³.
pub fn refine(mask: &Volume<u8>, factor: usize) -> Volume<u8> {
    let [nx, ny, nz] = mask.grid.n;
    let n = [nx * factor, ny * factor, nz * factor];
    let voxels = mask.as_slice();
    let mut fine = vec![0u8; n.iter().product()];
    fine.par_chunks_mut(n[0].max(1))
        .enumerate()
        .for_each(|(row, out)| {
            let (y, z) = (row % n[1] / factor, row / n[1] / factor);
            let source = &voxels[(z * ny + y) * nx..][..nx];
            for (x, v) in out.iter_mut().enumerate() {
                *v = source[x / factor];
            }
        });
    let spacing = mask.grid.spacing_mm.map(|h| h / factor as f64);
    Volume::from_vec(Grid::new(n, spacing), fine)
}

/// Bone fractions (0 to 1) of voxels `factor` times as long. Where an axis is not a multiple, its voxels are stretched
/// a little less, so that the box stays what it is; a fine voxel across two coarse ones counts in both by its share.
pub fn coarsen(mask: &Volume<u8>, factor: usize) -> Volume<f32> {
    coarsened(mask, factor, |_| 1.0)
}

/// Means over the same coarse voxels of a value that is `values` in bone and 0 in pores.
pub fn coarsen_values(mask: &Volume<u8>, factor: usize, values: &[f32]) -> Volume<f32> {
    coarsened(mask, factor, |voxel| values[voxel])
}

/// Bone fractions of blocks twice as wide about the same centres; beyond the box nothing counts.
pub fn coarsen_wide(mask: &Volume<u8>, factor: usize) -> Volume<f32> {
    let blocks = blocks(mask.grid, factor);
    let wide = |a: usize| wide_shares(mask.grid.n[a], blocks.n[a]);
    let bone = |voxel: usize| f32::from(mask.as_slice()[voxel] != 0);
    means(mask.grid, blocks, std::array::from_fn(wide), bone)
}

/// Means of values over voxels `factor` times as long.
pub fn block_means(values: &Volume<f32>, factor: usize) -> Volume<f32> {
    let blocks = blocks(values.grid, factor);
    let of = |a: usize| shares(values.grid.n[a], blocks.n[a]);
    let value = |voxel: usize| values.as_slice()[voxel];
    means(values.grid, blocks, std::array::from_fn(of), value)
}

fn coarsened(mask: &Volume<u8>, factor: usize, value: impl Fn(usize) -> f32 + Sync) -> Volume<f32> {
    let blocks = blocks(mask.grid, factor);
    let of = |a: usize| shares(mask.grid.n[a], blocks.n[a]);
    let voxels = mask.as_slice();
    let bone = |voxel: usize| match voxels[voxel] {
        0 => 0.0,
        _ => value(voxel),
    };
    means(mask.grid, blocks, std::array::from_fn(of), bone)
}

/// Edges in mm of the voxels that [`coarsen`] and [`block_means`] make: `factor` voxels long, less where an axis is not a multiple.
pub fn block_edges_mm(fine: Grid, factor: usize) -> [f64; 3] {
    let (coarse, edges) = (blocks(fine, factor), fine.spacing_mm);
    std::array::from_fn(|a| match fine.n[a].is_multiple_of(factor) {
        true => edges[a] * factor as f64,
        false => coarse.spacing_mm[a],
    })
}

/// The grid of voxels `factor` times as long in the same box.
fn blocks(fine: Grid, factor: usize) -> Grid {
    let n: [usize; 3] = std::array::from_fn(|a| fine.n[a].div_ceil(factor));
    let size = fine.size_mm();
    Grid::new(n, std::array::from_fn(|a| size[a] / n[a] as f64))
}

/// Voxels of a fine axis and their weights, for each voxel of the coarse axis.
type Shares = Vec<Vec<(usize, f32)>>;

fn means(
    fine: Grid,
    blocks: Grid,
    shares: [Shares; 3],
    value: impl Fn(usize) -> f32 + Sync,
) -> Volume<f32> {
    let n = blocks.n;
    let mut coarse = vec![0f32; n.iter().product()];
    coarse
        .par_chunks_mut((n[0] * n[1]).max(1))
        .enumerate()
        .for_each(|(z, plane)| {
            for (i, out) in plane.iter_mut().enumerate() {
                for &(fz, wz) in &shares[2][z] {
                    for &(fy, wy) in &shares[1][i / n[0]] {
                        let start = (fz * fine.n[1] + fy) * fine.n[0];
                        let across = shares[0][i % n[0]].iter();
                        let sum: f32 = across.map(|s| s.1 * value(start + s.0)).sum();
                        *out += wz * wy * sum;
                    }
                }
            }
        });
    Volume::from_vec(blocks, coarse)
}

/// As [`shares`], over twice the length of each interval about its middle, as far as there are fine ones.
fn wide_shares(fine: usize, coarse: usize) -> Shares {
    let ratio = fine as f64 / coarse as f64;
    (0..coarse)
        .map(|c| {
            let (low, high) = ((c as f64 - 0.5) * ratio, (c as f64 + 1.5) * ratio);
            let from = low.max(0.0).floor() as usize;
            let to = (high.ceil() as usize).min(fine);
            let inside = high.min(fine as f64) - low.max(0.0);
            (from..to)
                .map(|f| {
                    let covered = high.min(f as f64 + 1.0) - low.max(f as f64);
                    (f, (covered / inside) as f32)
                })
                .collect()
        })
        .collect()
}

/// For each of `coarse` equal intervals, the `fine` ones it covers, with the share of its length that each has.
fn shares(fine: usize, coarse: usize) -> Shares {
    let ratio = fine as f64 / coarse as f64;
    (0..coarse)
        .map(|c| {
            let (low, high) = (c as f64 * ratio, (c + 1) as f64 * ratio);
            (low.floor() as usize..fine)
                .map(|f| {
                    let covered = high.min(f as f64 + 1.0) - low.max(f as f64);
                    (f, (covered / ratio) as f32)
                })
                // Rounding can leave nothing of the first.
                .skip_while(|s| s.1 <= 1e-6)
                .take_while(|s| s.1 > 1e-6)
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Volume<u8> {
        let grid = Grid::new([7, 6, 5], [0.01, 0.02, 0.03]);
        Volume::from_vec(grid, (0..210).map(|i| u8::from(i * i % 7 < 3)).collect())
    }

    #[test]
    fn solid_bone_stays_solid_at_any_size() {
        for n in 1..150 {
            for factor in 1..12 {
                let parts = shares(n, n.div_ceil(factor));
                let whole = |part: &Vec<(usize, f32)>| {
                    (part.iter().map(|s| s.1).sum::<f32>() - 1.0).abs() < 1e-5
                };
                assert!(parts.iter().all(whole), "{n} {factor}");
            }
        }
    }

    #[test]
    fn blocks_that_do_not_fill_a_side_are_shorter() {
        let edges = block_edges_mm(Grid::new([15, 16, 7], [0.02, 0.02, 0.03]), 2);
        assert_eq!(edges[1], 0.04);
        assert!((edges[0] - 0.0375).abs() < 1e-15 && (edges[2] - 0.0525).abs() < 1e-15);
    }

    #[test]
    fn bone_volume_is_kept_both_ways() {
        let mask = sample();
        let bone = mask.as_slice().iter().filter(|v| **v != 0).count() as f64;
        let volume = bone * mask.grid.voxel_mm3();
        let fine = refine(&mask, 3);
        let count = fine.as_slice().iter().filter(|v| **v != 0).count() as f64;
        assert!((count * fine.grid.voxel_mm3() / volume - 1.0).abs() < 1e-12);
        for factor in [1, 2, 3, 8] {
            let coarse = coarsen(&mask, factor);
            let sum: f64 = coarse.as_slice().iter().map(|v| f64::from(*v)).sum();
            // Shares are single precision.
            assert!((sum * coarse.grid.voxel_mm3() / volume - 1.0).abs() < 1e-5);
            let (a, b) = (coarse.grid.size_mm(), mask.grid.size_mm());
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-12));
        }
    }
}
