//! Owns the surface between voxels: grey values interpolated on a finer grid and thresholded again.
//!
//! Cubic interpolation along each axis in turn (Keys 1981, doi 10.1109/TASSP.1981.1163711, a = −½). Beyond the ends of the
//! grid values go on in a straight line.

use crate::grid::Grid;
use crate::volume::Volume;
use rayon::prelude::*;

/// Voxels that one interpolated value is made of along an axis, and their weights.
type Taps = [(usize, f32); 4];

/// Keys' cubic kernel at distance `x` in voxels.
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

/// For every place of an axis of `n` voxels that is `factor` times as fine.
fn taps(n: usize, factor: usize) -> Vec<Taps> {
    (0..n * factor)
        .map(|fine| {
            let at = (fine as f64 + 0.5) / factor as f64 - 0.5;
            let first = at.floor() as isize - 1;
            let last = n as isize - 1;
            let start = first.clamp(0, (last - 3).max(0));
            let mut weights = [0.0; 4];
            let mut add = |voxel: isize, w: f64| weights[(voxel - start) as usize] += w;
            for voxel in first..first + 4 {
                let w = keys(at - voxel as f64);
                let (end, beyond, inner) = match voxel {
                    v if v < 0 => (0, -v, 1.min(last)),
                    v if v > last => (last, v - last, (last - 1).max(0)),
                    v => (v, 0, v),
                };
                add(end, w * (1 + beyond) as f64);
                add(inner, -w * beyond as f64);
            }
            std::array::from_fn(|t| {
                let voxel = (start + t as isize).min(last) as usize;
                (voxel, weights[t] as f32)
            })
        })
        .collect()
}

/// Adds up four lines of equal length by their weights.
fn blend(out: &mut [f32], lines: [(&[f32], f32); 4]) {
    let [(a, wa), (b, wb), (c, wc), (d, wd)] = lines;
    let lines = a.iter().zip(b).zip(c.iter().zip(d));
    for (out, ((a, b), (c, d))) in out.iter_mut().zip(lines) {
        *out = wa * a + wb * b + (wc * c + wd * d);
    }
}

/// How much of a voxel's second differences is taken off: for the box of a voxel and the cubics' own blur together. Against
/// bodies of known modulus, 1/6 left 2.2 % RMS where none left 3.4 % (`reports/truth-set.csv`).
const SHARPENING: f32 = 1.0 / 6.0;

/// Values less a sixth of the sum of their second differences, for images whose only blur is the voxel's own box.
pub fn sharpened(grey: &Volume<f32>) -> Volume<f32> {
    let [nx, ny, nz] = grey.grid.n;
    let values = grey.as_slice();
    // Straight on beyond the ends: no second difference there.
    let second = |at: usize, i: usize, n: usize, stride: usize| match i > 0 && i + 1 < n {
        true => values[at - stride] - 2.0 * values[at] + values[at + stride],
        false => 0.0,
    };
    let mut sharp = vec![0f32; values.len()];
    sharp
        .par_chunks_mut((nx * ny).max(1))
        .enumerate()
        .for_each(|(z, plane)| {
            for (i, v) in plane.iter_mut().enumerate() {
                let at = z * nx * ny + i;
                let sum = second(at, i % nx, nx, 1)
                    + second(at, i / nx, ny, nx)
                    + second(at, z, nz, nx * ny);
                *v = values[at] - SHARPENING * sum;
            }
        });
    let mut sharp = Volume::from_vec(grey.grid, sharp);
    sharp.affine = grey.affine;
    sharp
}

/// Bone on a grid `factor` times as fine: 1 where the interpolated value lies in `lower..=upper`.
pub fn select_between(grey: &Volume<f32>, factor: usize, (lower, upper): (f32, f32)) -> Volume<u8> {
    let [nx, ny, nz] = grey.grid.n;
    let fine = grey.grid.n.map(|n| n * factor);
    let [along_x, along_y, along_z] = grey.grid.n.map(|n| taps(n, factor));
    let plane_of = |z: usize| &grey.as_slice()[z * nx * ny..][..nx * ny];
    debug_assert_eq!(along_z.len(), nz * factor);
    let mut bone = vec![0u8; fine.iter().product()];
    bone.par_chunks_mut((fine[0] * fine[1]).max(1))
        .zip(&along_z)
        .for_each_init(
            || (vec![0f32; nx * ny], vec![0f32; nx]),
            |(plane, row), (out, taps)| {
                blend(plane, taps.map(|(z, w)| (plane_of(z), w)));
                for (line, taps) in out.chunks_exact_mut(fine[0]).zip(&along_y) {
                    blend(row, taps.map(|(y, w)| (&plane[y * nx..][..nx], w)));
                    for (v, taps) in line.iter_mut().zip(&along_x) {
                        let value: f32 = taps.iter().map(|&(x, w)| w * row[x]).sum();
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

    fn along_x(n: usize, f: impl Fn(f64) -> f64) -> Volume<f32> {
        let grid = Grid::new([n, 5, 4], [1.0; 3]);
        let value = |i: usize| f((i % n) as f64 + 0.5) as f32;
        Volume::from_vec(grid, (0..n * 20).map(value).collect())
    }

    #[test]
    fn weights_add_up_to_one_for_any_number_of_voxels() {
        for n in 1..9 {
            for factor in 1..6 {
                for taps in taps(n, factor) {
                    let sum: f32 = taps.iter().map(|t| t.1).sum();
                    assert!((sum - 1.0).abs() < 1e-5 && taps.iter().all(|t| t.0 < n));
                }
            }
        }
    }

    /// Keys' cubics reproduce parabolas inside; straight lines come out exactly up to the ends.
    #[test]
    fn parabolas_and_lines_are_thresholded_where_they_are() {
        let inside = 3.0..17.0;
        let parabola = |x: f64| -20.0 + 9.0 * x - 0.45 * x * x;
        for factor in [2, 3, 5] {
            let fine = select_between(&along_x(20, parabola), factor, (0.0, f32::INFINITY));
            for i in 0..20 * factor {
                let x = (i as f64 + 0.5) / factor as f64;
                if parabola(x).abs() > 1e-3 && inside.contains(&x) {
                    assert_eq!(
                        fine.as_slice()[i],
                        u8::from(parabola(x) > 0.0),
                        "{factor} {x}"
                    );
                }
            }
            let line = |x: f64| x - 0.3;
            let fine = select_between(&along_x(20, line), factor, (0.0, f32::INFINITY));
            for i in 0..20 * factor {
                let x = (i as f64 + 0.5) / factor as f64;
                assert!(line(x).abs() < 1e-3 || fine.as_slice()[i] == u8::from(line(x) > 0.0));
            }
        }
    }

    #[test]
    fn one_place_a_voxel_is_the_threshold() {
        let grid = Grid::new([5, 4, 3], [0.1, 0.2, 0.3]);
        let values: Vec<f32> = (0..60).map(|i| ((i * 37) % 60) as f32).collect();
        let expected: Vec<u8> = values
            .iter()
            .map(|v| u8::from((20.0..=40.0).contains(v)))
            .collect();
        let same = select_between(&Volume::from_vec(grid, values), 1, (20.0, 40.0));
        assert_eq!(same.as_slice(), expected);
    }
}
