//! Owns the reading of a volume on another grid: axes reordered, voxels resampled.

use crate::grid::{Axis, Grid};
use crate::volume::Volume;
use rayon::prelude::*;

/// How values between voxel centres are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Between {
    /// Means over coarser voxels, straight lines between the centres of finer ones: grey values.
    Means,
    /// The value of the voxel there: labels and masks.
    Nearest,
}

/// Axes reordered in turn so that `axis` becomes z: x goes to z as (x, y, z) = (y, z, x). Nothing is mirrored, and every
/// voxel keeps its place in the world.
pub fn turned<T: Copy>(volume: &Volume<T>, axis: Axis) -> Volume<T> {
    let from: [usize; 3] = std::array::from_fn(|a| (axis.index() + 1 + a) % 3);
    let grid = Grid::new(
        from.map(|a| volume.grid.n[a]),
        from.map(|a| volume.grid.spacing_mm[a]),
    );
    // Array axes are (z, y, x).
    let order = [2 - from[2], 2 - from[1], 2 - from[0]];
    let values = volume.values.view().permuted_axes(order);
    Volume {
        grid,
        values: values.as_standard_layout().into_owned(),
        affine: volume
            .affine
            .map(|rows| rows.map(|row| [row[from[0]], row[from[1]], row[from[2]], row[3]])),
    }
}

/// The same box in voxels of `spacing_mm`, centred: less than a voxel is lost along each axis where they do not fill it.
pub fn resampled(volume: &Volume<f32>, spacing_mm: [f64; 3], between: Between) -> Volume<f32> {
    let (old, size) = (volume.grid, volume.grid.size_mm());
    let n = std::array::from_fn(|a| ((size[a] / spacing_mm[a] + 1e-6) as usize).max(1));
    let first: [f64; 3] = std::array::from_fn(|a| 0.5 * (size[a] - n[a] as f64 * spacing_mm[a]));
    let mut values = volume.as_slice().to_vec();
    let mut shape = old.n;
    for a in 0..3 {
        // In voxels of the old grid.
        let (start, step) = (
            first[a] / old.spacing_mm[a],
            spacing_mm[a] / old.spacing_mm[a],
        );
        let shares: Vec<Vec<(usize, f64)>> = (0..n[a])
            .map(|i| {
                let low = start + i as f64 * step;
                match between {
                    Between::Nearest => vec![(voxel(low + 0.5 * step, old.n[a]), 1.0)],
                    Between::Means if step < 1.0 => line(low + 0.5 * step, old.n[a]).to_vec(),
                    Between::Means => means(low, low + step, old.n[a]),
                }
            })
            .collect();
        values = along(a, &values, shape, &shares);
        shape[a] = n[a];
    }
    let mut out = Volume::from_vec(Grid::new(n, spacing_mm), values);
    let corner = std::array::from_fn(|a| first[a] + 0.5 * spacing_mm[a]);
    out.affine = laid(volume, corner, spacing_mm, &IDENTITY);
    out
}

const IDENTITY: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

pub(super) fn voxel(at: f64, n: usize) -> usize {
    (at.max(0.0) as usize).min(n - 1)
}

/// The two centres around a position (in voxels from the face), with their shares; the outer halves are constant.
pub(super) fn line(at: f64, n: usize) -> [(usize, f64); 2] {
    let t = (at - 0.5).clamp(0.0, (n - 1) as f64);
    let low = t as usize;
    let high = (low + 1).min(n - 1);
    [(low, 1.0 - (t - low as f64)), (high, t - low as f64)]
}

/// The voxels that an interval covers, with the share of it that each has.
fn means(low: f64, high: f64, n: usize) -> Vec<(usize, f64)> {
    let (low, high) = (low.clamp(0.0, n as f64), high.clamp(0.0, n as f64));
    (low as usize..n)
        .map(|v| (v, high.min(v as f64 + 1.0) - low.max(v as f64)))
        // Rounding can leave nothing of the first.
        .skip_while(|share| share.1 <= 1e-9)
        .take_while(|share| share.1 > 1e-9)
        .map(|(v, share)| (v, share / (high - low)))
        .collect()
}

/// Weighted sums along one axis.
fn along(axis: usize, values: &[f32], n: [usize; 3], shares: &[Vec<(usize, f64)>]) -> Vec<f32> {
    let mut to = n;
    to[axis] = shares.len();
    let stride = [1, n[0], n[0] * n[1]];
    let mut out = vec![0f32; to.iter().product()];
    out.par_chunks_mut(to[0].max(1))
        .enumerate()
        .for_each(|(row, out)| {
            let at = [0, row % to[1], row / to[1]];
            for (i, value) in out.iter_mut().enumerate() {
                let mut p = [i, at[1], at[2]];
                let line = &shares[p[axis]];
                p[axis] = 0;
                let start = p[0] + p[1] * stride[1] + p[2] * stride[2];
                // A share of nothing must not spread what is not finite.
                let parts = line.iter().filter(|share| share.1 != 0.0);
                let sum: f64 = parts
                    .map(|&(v, w)| w * f64::from(values[start + v * stride[axis]]))
                    .sum();
                *value = sum as f32;
            }
        });
    out
}

/// The affine of a grid in a volume's box: its first voxel's centre (mm from the corner), spacing and axes.
pub(super) fn laid(
    volume: &Volume<f32>,
    first_mm: [f64; 3],
    spacing_mm: [f64; 3],
    axes: &[[f64; 3]; 3],
) -> Option<[[f64; 4]; 3]> {
    let s = volume.grid.spacing_mm;
    volume.affine.map(|rows| {
        rows.map(|row| {
            let unit: [f64; 3] = std::array::from_fn(|a| row[a] / s[a]);
            let along = |r: usize| -> f64 {
                spacing_mm[r] * (0..3).map(|a| unit[a] * axes[r][a]).sum::<f64>()
            };
            let offset: f64 = (0..3).map(|a| unit[a] * (first_mm[a] - 0.5 * s[a])).sum();
            [along(0), along(1), along(2), row[3] + offset]
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(n: [usize; 3], spacing_mm: [f64; 3]) -> Volume<f32> {
        let grid = Grid::new(n, spacing_mm);
        let mut v = Volume::from_vec(grid, (0..grid.len()).map(|i| i as f32).collect());
        v.affine = Some([
            [spacing_mm[0], 0.0, 0.0, 5.0],
            [0.0, spacing_mm[1], 0.0, -1.0],
            [0.0, 0.0, spacing_mm[2], 2.0],
        ]);
        v
    }

    fn world(v: &Volume<f32>, p: [usize; 3]) -> [f64; 3] {
        let rows = v.affine.unwrap();
        rows.map(|r| (0..3).map(|c| r[c] * p[c] as f64).sum::<f64>() + r[3])
    }

    #[test]
    fn a_turn_reorders_sizes_and_leaves_every_voxel_in_its_place() {
        let v = numbered([2, 3, 4], [0.1, 0.2, 0.3]);
        for (axis, n) in [
            (Axis::X, [3, 4, 2]),
            (Axis::Y, [4, 2, 3]),
            (Axis::Z, [2, 3, 4]),
        ] {
            let t = turned(&v, axis);
            assert_eq!(t.grid.n, n);
            assert_eq!(t.grid.spacing_mm[2], v.grid.spacing_mm[axis.index()]);
            for (at, value) in t.as_slice().iter().enumerate() {
                let p = [at % n[0], at / n[0] % n[1], at / (n[0] * n[1])];
                let old = *value as usize;
                let q = [old % 2, old / 2 % 3, old / 6];
                let (a, b) = (world(&t, p), world(&v, q));
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn a_constant_stays_one_at_any_voxel_size() {
        let grid = Grid::new([70, 60, 80], [0.02, 0.02, 0.03]);
        let v = Volume::from_vec(grid, vec![1.0; grid.len()]);
        for edge in (8..100).map(|i| f64::from(i) * 0.001) {
            let r = resampled(&v, [edge.max(0.018); 3], Between::Means);
            let off = |x: &&f32| (*x - 1.0).abs() > 1e-6;
            assert_eq!(r.as_slice().iter().find(off), None, "{edge}");
        }
    }

    #[test]
    fn resampling_keeps_the_mean_and_the_box() {
        let grid = Grid::new([12, 8, 6], [0.02, 0.03, 0.04]);
        let values = (0..grid.len()).map(|i| (i * i % 97) as f32).collect();
        let v = Volume::from_vec(grid, values);
        let mean = |v: &Volume<f32>| {
            v.as_slice().iter().map(|&x| f64::from(x)).sum::<f64>() / v.grid.len() as f64
        };
        for (edge, n) in [(0.04, [6, 6, 6]), (0.08, [3, 3, 3]), (0.01, [24, 24, 24])] {
            let r = resampled(&v, [edge; 3], Between::Means);
            assert_eq!(r.grid, Grid::new(n, [edge; 3]));
            assert!((mean(&r) / mean(&v) - 1.0).abs() < 1e-6, "{edge}");
        }
        // Labels stay labels.
        let r = resampled(&v, [0.05; 3], Between::Nearest);
        assert_eq!(r.grid.n, [4, 4, 4]);
        assert!(r.as_slice().iter().all(|x| v.as_slice().contains(x)));
    }
}
