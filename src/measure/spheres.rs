//! Owns local thickness by sphere fitting (Hildebrand and Rüegsegger 1997).

use crate::measure::distance::squared_distance;
use crate::volume::Volume;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Mean and standard deviation over voxels, and the largest, in mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub mean_mm: f64,
    pub sd_mm: f64,
    pub max_mm: f64,
}

/// Thickness at each voxel is the diameter of the largest sphere that contains it and fits in the phase. Spheres stand on
/// voxel centres; a radius is the distance to the nearest centre of the other phase and a quarter of a voxel less on
/// either side: plates of an even and an odd number of voxels come out half a voxel thin and thick. `within` (non-zero)
/// restricts which voxels stand in the mean. None where the phase is empty.
pub fn local_thickness(
    mask: &Volume<u8>,
    bone: bool,
    within: Option<&Volume<u8>>,
) -> Option<Spread> {
    let local = thickness_map(mask, bone)?;
    let counted = |at: &usize| {
        (mask.as_slice()[*at] != 0) == bone && within.is_none_or(|w| w.as_slice()[*at] != 0)
    };
    spread(
        (0..local.len())
            .filter(counted)
            .map(|at| f64::from(local[at])),
    )
}

/// The thickness of every voxel of the phase in mm, 0 elsewhere.
fn thickness_map(mask: &Volume<u8>, bone: bool) -> Option<Vec<f32>> {
    let [nx, ny, nz] = mask.grid.n;
    let s = mask.grid.spacing_mm;
    let d2 = squared_distance(mask, bone);
    let inside = |at: usize| (mask.as_slice()[at] != 0) == bone;
    if !(0..d2.len()).any(inside) || d2.iter().any(|d| d.is_infinite()) {
        return None;
    }
    let ridge = Ridge::new(&d2, mask.grid.n, s);
    let mut centers: Vec<u32> = (0..d2.len())
        .into_par_iter()
        .filter(|&at| inside(at) && ridge.keeps(at))
        .map(|at| at as u32)
        .collect();
    centers
        .par_sort_unstable_by(|&a, &b| d2[b as usize].total_cmp(&d2[a as usize]).then(a.cmp(&b)));
    let quarter = s.iter().sum::<f64>() / 12.0;
    // Slabs of slices are painted independently.
    let slab = nz.div_ceil(4 * rayon::current_num_threads()).max(4);
    let mut local = vec![0f32; d2.len()];
    local
        .par_chunks_mut(slab * nx * ny)
        .enumerate()
        .for_each(|(n, out)| {
            let slices = n * slab..(n * slab + out.len() / (nx * ny));
            let mut canvas = Canvas::new(out, slices, [nx, ny], s);
            for &center in &centers {
                let at = center as usize;
                let radius = f64::from(d2[at]).sqrt();
                let center = [at % nx, at / nx % ny, at / (nx * ny)];
                canvas.paint(center, radius, (2.0 * (radius - quarter)) as f32);
            }
        });
    Some(local)
}

/// Which spheres are needed: those that lie within a neighbour's paint nothing new.
struct Ridge<'a> {
    d2: &'a [f32],
    n: [usize; 3],
    s: [f64; 3],
    /// For cubes: by squared radius in voxels, the squared radius from which a sphere at a neighbour that shares a face,
    /// an edge, a corner holds all its voxels (Remy and Thiel 2002). Empty for other voxels.
    holds: [Vec<u32>; 3],
}

impl<'a> Ridge<'a> {
    fn new(d2: &'a [f32], n: [usize; 3], s: [f64; 3]) -> Self {
        let cubes = (1..3).all(|a| (s[a] / s[0] - 1.0).abs() < 1e-9);
        let largest = d2.iter().copied().fold(0.0, f32::max);
        let most = (f64::from(largest) / (s[0] * s[0])).round();
        // Larger spheres than any bone has room for go without the table.
        let table = cubes && most < 250_000.0;
        let holds = [1, 2, 3].map(|axes| match table {
            true => holding(most as usize, axes),
            false => Vec::new(),
        });
        Ridge { d2, n, s, holds }
    }

    fn keeps(&self, at: usize) -> bool {
        let n = self.n;
        let p = [at % n[0], at / n[0] % n[1], at / (n[0] * n[1])];
        let near = |a: usize| p[a].saturating_sub(1)..(p[a] + 2).min(n[a]);
        near(2).all(|k| {
            near(1).all(|j| {
                near(0).all(|i| {
                    let q = [i, j, k];
                    let other = (k * n[1] + j) * n[0] + i;
                    other == at || !self.within(at, other, p, q)
                })
            })
        })
    }

    /// Whether the sphere of a voxel lies within that of a neighbour.
    fn within(&self, at: usize, other: usize, p: [usize; 3], q: [usize; 3]) -> bool {
        if self.holds[0].is_empty() {
            let apart: f64 = (0..3)
                .map(|a| ((q[a] as f64 - p[a] as f64) * self.s[a]).powi(2))
                .sum();
            let radius = |at: usize| f64::from(self.d2[at]).sqrt();
            return radius(other) >= radius(at) + apart.sqrt() * (1.0 - 1e-6);
        }
        let axes = (0..3).filter(|&a| p[a] != q[a]).count();
        let squared = |at: usize| (f64::from(self.d2[at]) / (self.s[0] * self.s[0])).round();
        squared(other) >= f64::from(self.holds[axes - 1][squared(at) as usize])
    }
}

/// `holding(most, axes)[a]`: one more than the largest `|v + δ|²` of voxels `v` with `|v|² < a`, where `δ` is one along
/// the first `axes` axes.
fn holding(most: usize, axes: usize) -> Vec<u32> {
    let mut farthest = vec![0u32; most + 1];
    let side = (most as f64).sqrt() as usize + 1;
    for x in 0..=side {
        for y in 0..=side {
            for z in 0..=side {
                let v = [x, y, z];
                let squared: usize = v.iter().map(|c| c * c).sum();
                if squared > most {
                    break;
                }
                let along: usize = v[..axes].iter().sum();
                let moved = (squared + 2 * along + axes) as u32;
                farthest[squared] = farthest[squared].max(moved);
            }
        }
    }
    // From the voxels on each sphere to those within it.
    let mut out = vec![0; most + 1];
    let mut most_so_far = 0;
    for a in 0..=most {
        out[a] = most_so_far + 1;
        most_so_far = most_so_far.max(farthest[a]);
    }
    out
}

/// A slab of voxels on which spheres are painted, largest first: a voxel keeps the first that covers it.
struct Canvas<'a> {
    out: &'a mut [f32],
    slices: Range<usize>,
    n: [usize; 2],
    s: [f64; 3],
    /// Of each place in a row, a later one before which all is painted; itself where it is not.
    next: Vec<u32>,
}

impl<'a> Canvas<'a> {
    fn new(out: &'a mut [f32], slices: Range<usize>, n: [usize; 2], s: [f64; 3]) -> Self {
        let row = 0..=n[0] as u32;
        let rows = out.len() / n[0];
        Canvas {
            out,
            slices,
            n,
            s,
            next: (0..rows).flat_map(|_| row.clone()).collect(),
        }
    }

    fn paint(&mut self, c: [usize; 3], radius: f64, thickness: f32) {
        let [nx, ny] = self.n;
        let reach = [0, 1, 2].map(|a| (radius / self.s[a]) as usize);
        let bounds = |a: usize| c[a].saturating_sub(reach[a])..c[a] + reach[a] + 1;
        let r2 = radius * radius * (1.0 - 1e-6);
        let zs = bounds(2);
        for k in zs.start.max(self.slices.start)..zs.end.min(self.slices.end) {
            let dz = (k as f64 - c[2] as f64) * self.s[2];
            for j in bounds(1).start..bounds(1).end.min(ny) {
                let dy = (j as f64 - c[1] as f64) * self.s[1];
                let left = r2 - dz * dz - dy * dy;
                if left > 0.0 {
                    let half = (left.sqrt() / self.s[0]) as usize;
                    let columns = c[0].saturating_sub(half)..(c[0] + half + 1).min(nx);
                    self.line((k - self.slices.start) * ny + j, columns, thickness);
                }
            }
        }
    }

    fn line(&mut self, row: usize, columns: Range<usize>, thickness: f32) {
        let nx = self.n[0];
        let next = &mut self.next[row * (nx + 1)..(row + 1) * (nx + 1)];
        let mut x = unpainted(next, columns.start);
        while x < columns.end {
            self.out[row * nx + x] = thickness;
            next[x] = x as u32 + 1;
            x = unpainted(next, x + 1);
        }
    }
}

/// The first unpainted place from `x` on; halves the way there for the next who asks.
fn unpainted(next: &mut [u32], mut x: usize) -> usize {
    while next[x] as usize != x {
        let ahead = next[next[x] as usize];
        next[x] = ahead;
        x = ahead as usize;
    }
    x
}

fn spread(values: impl Iterator<Item = f64>) -> Option<Spread> {
    let (mut n, mut sum, mut square, mut max) = (0.0, 0.0, 0.0, 0.0f64);
    for v in values {
        n += 1.0;
        sum += v;
        square += v * v;
        max = max.max(v);
    }
    let mean = sum / n;
    (n > 0.0).then(|| Spread {
        mean_mm: mean,
        sd_mm: (square / n - mean * mean).max(0.0).sqrt(),
        max_mm: max,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::specimens::mask;

    /// All spheres at all voxels, each voxel the largest that covers it.
    fn by_search(m: &Volume<u8>) -> Vec<f32> {
        let [nx, ny, _] = m.grid.n;
        let s = m.grid.spacing_mm;
        let d2 = squared_distance(m, true);
        let at = |i: usize| [i % nx, i / nx % ny, i / (nx * ny)];
        let quarter = s.iter().sum::<f64>() / 12.0;
        let largest = |v: usize| {
            let covers = |c: &usize| {
                let (p, q) = (at(v), at(*c));
                let apart: f64 = (0..3)
                    .map(|a| ((p[a] as f64 - q[a] as f64) * s[a]).powi(2))
                    .sum();
                apart < f64::from(d2[*c]) * (1.0 - 1e-6)
            };
            let best = (0..d2.len())
                .filter(covers)
                .map(|c| d2[c])
                .fold(0.0, f32::max);
            (2.0 * (f64::from(best).sqrt() - quarter)) as f32
        };
        let bone = |v: usize| m.as_slice()[v] != 0;
        (0..d2.len())
            .map(|v| if bone(v) { largest(v) } else { 0.0 })
            .collect()
    }

    #[test]
    fn thickness_is_that_of_a_search_over_all_spheres() {
        for spacing in [[0.1; 3], [0.1, 0.13, 0.2]] {
            for seed in 1..5usize {
                let m = mask([15, 13, 11], spacing, |[i, j, k]| {
                    let wave = ((i * seed) as f64 * 0.5).sin() + (j as f64 * 0.6).sin();
                    wave + (k as f64 * 0.7 + seed as f64).cos() < 0.9
                });
                assert_eq!(
                    thickness_map(&m, true).unwrap(),
                    by_search(&m),
                    "{spacing:?} {seed}"
                );
            }
        }
    }

    #[test]
    fn few_spheres_are_needed() {
        let ball = mask([41; 3], [0.01; 3], |p| {
            p.iter().map(|&x| (x as f64 - 20.0).powi(2)).sum::<f64>() < 15.0f64.powi(2)
        });
        let d2 = squared_distance(&ball, true);
        let ridge = Ridge::new(&d2, ball.grid.n, ball.grid.spacing_mm);
        let kept = (0..d2.len())
            .filter(|&at| d2[at] > 0.0 && ridge.keeps(at))
            .count();
        let all = d2.iter().filter(|&&d| d > 0.0).count();
        assert!(20 * kept < all, "{kept} of {all}");
    }

    #[test]
    fn plates_and_gaps_have_their_thickness() {
        // Plates of 6 voxels every 16, pores of 10 between them, plates at both ends.
        let m = mask([38, 12, 12], [0.02; 3], |[i, _, _]| i % 16 < 6);
        let inner = |v: f64, voxels: f64| (v / 0.02 - voxels).abs() < 0.51;
        let sp = local_thickness(&m, false, None).unwrap();
        assert!(inner(sp.mean_mm, 10.0) && sp.sd_mm < 1e-6, "{sp:?}");
        let m = mask([38, 12, 12], [0.02; 3], |[i, _, _]| i % 16 >= 6);
        let th = local_thickness(&m, true, None).unwrap();
        assert!(inner(th.mean_mm, 10.0) && th.sd_mm < 1e-6, "{th:?}");
        let ball = mask([41, 41, 41], [0.01; 3], |p| {
            p.iter().map(|&x| (x as f64 - 20.0).powi(2)).sum::<f64>() < 15.0f64.powi(2)
        });
        let th = local_thickness(&ball, true, None).unwrap();
        // Diameter 0.30 of a voxelised ball.
        assert!(
            (th.mean_mm / 0.3 - 1.0).abs() < 0.07 && (th.max_mm / 0.3 - 1.0).abs() < 0.05,
            "{th:?}"
        );
    }
}
