//! Owns the surface between voxels: grey values interpolated on a finer grid and thresholded again.
//!
//! A voxel's value is the mean over its cell, so interpolation of voxel values as if they were samples at centres blurs the
//! image by one voxel's box. The kernel here first takes that blur back to second order, `u − h²/24 u″` (from the cell mean
//! to the value at the centre), then interpolates by cubics (Keys 1981, a = −½), along each axis in turn.

use crate::grid::Grid;
use crate::volume::Volume;
use rayon::prelude::*;

/// Voxels that one interpolated value is made of, along one axis.
const TAPS: usize = 6;

/// Weights of the voxels `first..first + TAPS` of a coarse axis, for one place of the fine axis.
struct Weights {
    first: isize,
    of: [f32; TAPS],
}

/// Keys' cubic kernel, a = −½, at distance `x` in voxels.
fn keys(x: f64) -> f64 {
    let x = x.abs();
    if x < 1.0 {
        (1.5 * x - 2.5) * x * x + 1.0
    } else if x < 2.0 {
        ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0
    } else {
        0.0
    }
}

/// From a cell's mean to the value at its centre: `u − u″/24`, in voxels.
const FROM_MEANS: f64 = 1.0 / 24.0;

/// For each of the `factor` places in a voxel.
fn weights(factor: usize) -> Vec<Weights> {
    (0..factor)
        .map(|k| {
            let at = (k as f64 + 0.5) / factor as f64 - 0.5;
            let first = at.floor() as isize - 2;
            let of = std::array::from_fn(|t| {
                let x = at - (first + t as isize) as f64;
                // Interpolating u − u″/24 is interpolating u by this kernel.
                let beside = keys(x - 1.0) + keys(x + 1.0);
                ((1.0 + 2.0 * FROM_MEANS) * keys(x) - FROM_MEANS * beside) as f32
            });
            Weights { first, of }
        })
        .collect()
}

/// The six lines (planes, rows, values) that a place of the fine axis needs, repeated at the ends.
fn taps(weights: &Weights, coarse: usize, n: usize) -> [usize; TAPS] {
    std::array::from_fn(|t| {
        let at = coarse as isize + weights.first + t as isize;
        at.clamp(0, n as isize - 1) as usize
    })
}

/// Adds up `TAPS` lines of equal length by their weights.
fn blend(out: &mut [f32], weights: &Weights, lines: [&[f32]; TAPS]) {
    out.fill(0.0);
    for (line, &w) in lines.into_iter().zip(&weights.of) {
        out.iter_mut().zip(line).for_each(|(o, v)| *o += w * v);
    }
}

/// Bone on a grid `factor` times as fine: 1 where the interpolated value lies in `lower..=upper`.
///
/// Values at the ends are repeated beyond them.
pub fn select_between(grey: &Volume<f32>, factor: usize, (lower, upper): (f32, f32)) -> Volume<u8> {
    let [nx, ny, nz] = grey.grid.n;
    let fine = grey.grid.n.map(|n| n * factor);
    let weights = weights(factor);
    let values = grey.as_slice();
    let mut bone = vec![0u8; fine.iter().product()];
    bone.par_chunks_mut((fine[0] * fine[1]).max(1))
        .enumerate()
        .for_each_init(
            || (vec![0f32; nx * ny], vec![0f32; nx]),
            |(plane, row), (z, out)| {
                let w = &weights[z % factor];
                let sources = taps(w, z / factor, nz);
                let part = |t: usize| &values[sources[t] * nx * ny..][..nx * ny];
                blend(plane, w, std::array::from_fn(part));
                for (y, line) in out.chunks_exact_mut(fine[0]).enumerate() {
                    let w = &weights[y % factor];
                    let sources = taps(w, y / factor, ny);
                    let part = |t: usize| &plane[sources[t] * nx..][..nx];
                    blend(row, w, std::array::from_fn(part));
                    for (x, v) in line.iter_mut().enumerate() {
                        let w = &weights[x % factor];
                        let sources = taps(w, x / factor, nx);
                        let value: f32 = sources.iter().zip(&w.of).map(|(&s, w)| w * row[s]).sum();
                        *v = u8::from(value >= lower && value <= upper);
                    }
                }
            },
        );
    let spacing = grey.grid.spacing_mm.map(|h| h / factor as f64);
    Volume::from_vec(Grid::new(fine, spacing), bone)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means over voxels of a polynomial of degree 2, along x.
    fn means(n: usize, a: [f64; 3]) -> Volume<f32> {
        let mean = |i: usize| {
            let (l, h) = (i as f64, i as f64 + 1.0);
            let term = |p: i32| (h.powi(p + 1) - l.powi(p + 1)) / f64::from(p + 1);
            (a[0] * term(0) + a[1] * term(1) + a[2] * term(2)) as f32
        };
        let grid = Grid::new([n, 5, 4], [1.0; 3]);
        Volume::from_vec(grid, (0..n * 20).map(|i| mean(i % n)).collect())
    }

    #[test]
    fn weights_add_up_to_one() {
        for factor in 1..6 {
            for w in weights(factor) {
                assert!((w.of.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            }
        }
    }

    /// From voxel means of a parabola its values come out exactly, so its surface lies where it is.
    #[test]
    fn a_parabola_is_thresholded_where_it_is() {
        let a = [-20.0, 9.0, -0.45];
        let grey = means(20, a);
        for factor in [2, 3, 5] {
            let fine = select_between(&grey, factor, (0.0, f32::INFINITY));
            let n = 20 * factor;
            for x in 3 * factor..n - 3 * factor {
                let at = (x as f64 + 0.5) / factor as f64;
                let value = a[0] + a[1] * at + a[2] * at * at;
                if value.abs() > 1e-3 {
                    assert_eq!(
                        fine.as_slice()[x],
                        u8::from(value > 0.0),
                        "{factor} {x} {value}"
                    );
                }
            }
        }
    }
}
