//! Owns Gaussian smoothing, slab by slab: no second volume is ever held.
//!
//! The kernel is cut at 4 σ and edges are mirrored about the face (`d c b a | a b c d`), so that a constant stays one.
//! Sums run in `f64` and are kept as `f32`: a region of constant grey value keeps that value exactly, and a threshold
//! equal to it selects the region.

use crate::volume::Volume;
use rayon::prelude::*;
use std::ops::Range;

/// Half of a normalised, symmetric kernel: `[w0, w1, …, wR]` with `R = ⌊4σ + ½⌋`, `σ` in voxels.
pub fn kernel(sigma: f64) -> Vec<f64> {
    let radius = (4.0 * sigma + 0.5).floor() as usize;
    let weight = |i: usize| exp_minus(0.5 * (i as f64 / sigma) * (i as f64 / sigma));
    let raw: Vec<f64> = (0..=radius).map(weight).collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    raw.into_iter().map(|w| w / sum).collect()
}

/// `e^{-x}` for `x >= 0` from sums and products alone: the C library's differs in the last bit between machines, and
/// a voxel at the threshold would with it.
fn exp_minus(x: f64) -> f64 {
    // Taylor series on x / 2^10, squared ten times: relative error below 1e-12 for x <= 10.
    let small = -x / 1024.0;
    let mut term = 1.0;
    let mut sum = 1.0;
    for n in 1..12 {
        term *= small / f64::from(n);
        sum += term;
    }
    (0..10).fold(sum, |value, _| value * value)
}

/// Index `i` of a line of `n` values mirrored about its faces, any distance outside.
pub fn mirrored(i: isize, n: usize) -> usize {
    let period = 2 * n as isize;
    let i = i.rem_euclid(period) as usize;
    if i < n { i } else { 2 * n - 1 - i }
}

/// Slices per slab at least; a slab also smooths `2 R` neighbouring slices in plane, so few thick slabs are cheaper.
const SLAB: usize = 24;

/// Calls `visit(slices, values)` for slabs of whole slices of the smoothed volume, in parallel, and returns the results
/// in order. `sigma` (voxels) 0 is off. `clean` is applied to every stored value first.
///
/// The result of a voxel does not depend on the slabs.
pub fn map_slabs<R: Send>(
    volume: &Volume<f32>,
    sigma: f64,
    clean: impl Fn(f32) -> f32 + Sync,
    visit: impl Fn(Range<usize>, &[f32]) -> R + Sync,
) -> Vec<R> {
    let [nx, ny, nz] = volume.grid.n;
    let plane = nx * ny;
    let values = volume.as_slice();
    let kernel = if sigma > 0.0 {
        kernel(sigma)
    } else {
        vec![1.0]
    };
    let thickness = SLAB.max(4 * (kernel.len() - 1));
    (0..nz.div_ceil(thickness))
        .into_par_iter()
        .map(|s| {
            let slices = s * thickness..((s + 1) * thickness).min(nz);
            let slab = if kernel.len() == 1 {
                values[slices.start * plane..slices.end * plane]
                    .iter()
                    .map(|&v| clean(v))
                    .collect()
            } else {
                smooth_slab(values, [nx, ny, nz], &kernel, slices.clone(), &clean)
            };
            visit(slices, &slab)
        })
        .collect()
}

/// All of the volume smoothed.
pub fn smoothed(volume: &Volume<f32>, sigma: f64) -> Volume<f32> {
    let slabs = map_slabs(volume, sigma, |v| v, |_, part| part.to_vec());
    Volume::from_vec(volume.grid, slabs.concat())
}

fn smooth_slab(
    values: &[f32],
    [nx, ny, nz]: [usize; 3],
    kernel: &[f64],
    slices: Range<usize>,
    clean: &impl Fn(f32) -> f32,
) -> Vec<f32> {
    let (plane, radius) = (nx * ny, kernel.len() - 1);
    // Slices that the slab needs: its own and R on either side, each once even where the mirror folds them back.
    let first = slices.start.saturating_sub(radius);
    let last = (slices.end + radius).min(nz);
    let mut in_plane = vec![0.0f32; (last - first) * plane];
    let mut scratch = Scratch::new(nx, ny, radius);
    for (slot, k) in in_plane.chunks_exact_mut(plane).zip(first..last) {
        scratch.smooth_slice(&values[k * plane..(k + 1) * plane], slot, kernel, clean);
    }
    let slice = |k: isize| {
        let at = mirrored(k, nz) - first;
        &in_plane[at * plane..(at + 1) * plane]
    };
    let mut out = vec![0.0f32; slices.len() * plane];
    let mut sum = vec![0.0f64; plane];
    for (target, k) in out.chunks_exact_mut(plane).zip(slices) {
        let k = k as isize;
        weigh(&mut sum, slice(k), kernel[0]);
        for (r, &w) in kernel.iter().enumerate().skip(1) {
            add_pair(&mut sum, slice(k - r as isize), slice(k + r as isize), w);
        }
        store(target, &sum);
    }
    out
}

fn weigh(sum: &mut [f64], a: &[f32], w: f64) {
    for (s, &a) in sum.iter_mut().zip(a) {
        *s = w * f64::from(a);
    }
}

fn add_pair(sum: &mut [f64], a: &[f32], b: &[f32], w: f64) {
    for ((s, &a), &b) in sum.iter_mut().zip(a).zip(b) {
        *s += w * (f64::from(a) + f64::from(b));
    }
}

fn store(target: &mut [f32], sum: &[f64]) {
    for (t, &s) in target.iter_mut().zip(sum) {
        *t = s as f32;
    }
}

/// Buffers for one slice at a time.
struct Scratch {
    nx: usize,
    ny: usize,
    /// A row with its mirrored margins.
    row: Vec<f32>,
    along_x: Vec<f32>,
    sum: Vec<f64>,
}

impl Scratch {
    fn new(nx: usize, ny: usize, radius: usize) -> Self {
        Scratch {
            nx,
            ny,
            row: vec![0.0; nx + 2 * radius],
            along_x: vec![0.0; nx * ny],
            sum: vec![0.0; nx],
        }
    }

    fn smooth_slice(
        &mut self,
        from: &[f32],
        to: &mut [f32],
        kernel: &[f64],
        clean: &impl Fn(f32) -> f32,
    ) {
        let (nx, ny, radius) = (self.nx, self.ny, kernel.len() - 1);
        for (row, out) in from.chunks_exact(nx).zip(self.along_x.chunks_exact_mut(nx)) {
            for (at, slot) in self.row.iter_mut().enumerate() {
                *slot = clean(row[mirrored(at as isize - radius as isize, nx)]);
            }
            weigh(&mut self.sum, &self.row[radius..radius + nx], kernel[0]);
            for (r, &w) in kernel.iter().enumerate().skip(1) {
                let (low, high) = (radius - r, radius + r);
                add_pair(
                    &mut self.sum,
                    &self.row[low..low + nx],
                    &self.row[high..high + nx],
                    w,
                );
            }
            store(out, &self.sum);
        }
        let row = |j: isize| {
            let at = mirrored(j, ny) * nx;
            &self.along_x[at..at + nx]
        };
        for (j, out) in to.chunks_exact_mut(nx).enumerate() {
            let j = j as isize;
            weigh(&mut self.sum, row(j), kernel[0]);
            for (r, &w) in kernel.iter().enumerate().skip(1) {
                add_pair(&mut self.sum, row(j - r as isize), row(j + r as isize), w);
            }
            store(out, &self.sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn smoothed(n: [usize; 3], values: Vec<f32>, sigma: f64) -> Vec<f32> {
        let volume = Volume::from_vec(Grid::new(n, [1.0; 3]), values);
        map_slabs(&volume, sigma, |v| v, |_, s| s.to_vec()).concat()
    }

    /// The definition, one voxel at a time.
    fn direct(n: [usize; 3], values: &[f32], sigma: f64, at: [usize; 3]) -> f64 {
        let half = kernel(sigma);
        let r = half.len() as isize - 1;
        let mut sum = 0.0;
        for dk in -r..=r {
            for dj in -r..=r {
                for di in -r..=r {
                    let [i, j, k] = [[di, 0], [dj, 1], [dk, 2]]
                        .map(|[d, a]| mirrored(at[a as usize] as isize + d, n[a as usize]));
                    let w =
                        half[di.unsigned_abs()] * half[dj.unsigned_abs()] * half[dk.unsigned_abs()];
                    sum += w * f64::from(values[(k * n[1] + j) * n[0] + i]);
                }
            }
        }
        sum
    }

    #[test]
    fn slabs_agree_with_the_definition_also_across_their_borders_and_in_thin_volumes() {
        for n in [[5, 4, 60], [3, 2, 1], [1, 7, 3]] {
            let values: Vec<f32> = (0..n.iter().product())
                .map(|v| ((v * 7919) % 251) as f32)
                .collect();
            let got = smoothed(n, values.clone(), 1.3);
            for k in 0..n[2] {
                for j in 0..n[1] {
                    for i in 0..n[0] {
                        let expected = direct(n, &values, 1.3, [i, j, k]);
                        let got = f64::from(got[(k * n[1] + j) * n[0] + i]);
                        // f32 storage between passes: measured 1.5e-5 on values up to 250.
                        assert!((got - expected).abs() < 5e-5, "{n:?} {got} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_exactly_itself() {
        for value in [63.0f32, 200.0, -1000.0, 446.8] {
            let got = smoothed([9, 9, 30], vec![value; 9 * 9 * 30], 1.0);
            assert!(got.iter().all(|&v| v == value));
        }
    }

    #[test]
    fn the_exponential_is_one() {
        for i in 0..200 {
            let x = f64::from(i) * 0.05;
            assert!((exp_minus(x) / (-x).exp() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn edges_mirror_about_the_face() {
        let line: Vec<usize> = (-4..8).map(|i| mirrored(i, 4)).collect();
        assert_eq!(line, [3, 2, 1, 0, 0, 1, 2, 3, 3, 2, 1, 0]);
    }
}
