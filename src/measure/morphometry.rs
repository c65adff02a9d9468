//! Owns morphometry of a mask: thickness and separation by sphere fitting, and connectivity.

use crate::volume::Volume;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Mean and standard deviation over voxels, and the largest, in mm.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub mean_mm: f64,
    pub sd_mm: f64,
    pub max_mm: f64,
}

/// What is measured of a mask beside BV/TV.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Morphometry {
    /// Local thickness of bone (Tb.Th); None without bone.
    pub tb_th: Option<Spread>,
    /// Local thickness of the pores (Tb.Sp).
    pub tb_sp: Option<Spread>,
    /// Connectivity density in 1/mm³ (Conn.D).
    pub conn_d_per_mm3: f64,
}

/// Measures `bone` within its box. Spacing may differ along the axes.
pub fn morphometry(bone: &Volume<u8>) -> Morphometry {
    Morphometry {
        tb_th: local_thickness(bone, true),
        tb_sp: local_thickness(bone, false),
        conn_d_per_mm3: connectivity_density(bone),
    }
}

/// Squared distance in mm² from every voxel of the phase to the nearest voxel centre of the other, by the lower envelope
/// of parabolas along each axis in turn (Felzenszwalb and Huttenlocher 2012). Exact, also for unequal spacing.
fn squared_distance(mask: &Volume<u8>, bone: bool) -> Vec<f32> {
    let [nx, ny, nz] = mask.grid.n;
    let [sx, sy, sz] = mask.grid.spacing_mm;
    let mut d: Vec<f32> = mask
        .as_slice()
        .par_iter()
        .map(|&v| if (v != 0) == bone { f32::INFINITY } else { 0.0 })
        .collect();
    d.par_chunks_mut(nx)
        .for_each_init(|| Envelope::new(nx), |e, line| e.transform(line, sx));
    d.par_chunks_mut(nx * ny).for_each_init(
        || (Envelope::new(ny), vec![0f32; ny]),
        |(e, line), slice| {
            for i in 0..nx {
                (0..ny).for_each(|j| line[j] = slice[j * nx + i]);
                e.transform(line, sy);
                (0..ny).for_each(|j| slice[j * nx + i] = line[j]);
            }
        },
    );
    // Lines along z: rows of y are gathered, transformed and put back.
    let columns: Vec<Vec<f32>> = (0..ny)
        .into_par_iter()
        .map_init(
            || (Envelope::new(nz), vec![0f32; nz]),
            |(e, line), j| {
                let mut out = vec![0f32; nx * nz];
                for i in 0..nx {
                    (0..nz).for_each(|k| line[k] = d[(k * ny + j) * nx + i]);
                    e.transform(line, sz);
                    (0..nz).for_each(|k| out[k * nx + i] = line[k]);
                }
                out
            },
        )
        .collect();
    d.par_chunks_mut(nx).enumerate().for_each(|(row, out)| {
        let (j, k) = (row % ny, row / ny);
        out.copy_from_slice(&columns[j][k * nx..(k + 1) * nx]);
    });
    d
}

/// Scratch for one line.
struct Envelope {
    /// Values of the line as it came.
    f: Vec<f32>,
    vertex: Vec<usize>,
    /// Where each parabola begins to be lowest, in voxels.
    from: Vec<f64>,
}

impl Envelope {
    fn new(n: usize) -> Self {
        Envelope {
            f: vec![0.0; n],
            vertex: vec![0; n],
            from: vec![0.0; n + 1],
        }
    }

    /// `line[i] = min_j (s (i − j))² + line[j]`.
    fn transform(&mut self, line: &mut [f32], s: f64) {
        self.f.copy_from_slice(line);
        let f = |q: usize| f64::from(self.f[q]) / (s * s);
        let mut count = 0;
        for q in (0..line.len()).filter(|&q| self.f[q].is_finite()) {
            let height = f(q) + (q * q) as f64;
            let mut start = f64::NEG_INFINITY;
            while count > 0 {
                let v = self.vertex[count - 1];
                start = (height - f(v) - (v * v) as f64) / (2.0 * (q - v) as f64);
                if start > self.from[count - 1] {
                    break;
                }
                count -= 1;
                start = f64::NEG_INFINITY;
            }
            self.vertex[count] = q;
            self.from[count] = start;
            count += 1;
        }
        if count == 0 {
            return;
        }
        let mut at = 0;
        for (i, out) in line.iter_mut().enumerate() {
            while at + 1 < count && self.from[at + 1] <= i as f64 {
                at += 1;
            }
            let v = self.vertex[at];
            let step = (i as f64 - v as f64) * s;
            *out = (step * step) as f32 + self.f[v];
        }
    }
}

/// Thickness at each voxel is the diameter of the largest sphere that contains it and fits in the phase (Hildebrand and
/// Rüegsegger 1997). Spheres stand on voxel centres; a radius is the distance to the nearest centre of the other phase
/// and a quarter of a voxel less on either side: plates of an even and an odd number of voxels come out half a voxel
/// thin and thick. None where the phase is empty.
pub fn local_thickness(mask: &Volume<u8>, bone: bool) -> Option<Spread> {
    let [nx, ny, nz] = mask.grid.n;
    let s = mask.grid.spacing_mm;
    let quarter = s.iter().sum::<f64>() / 12.0;
    let d2 = squared_distance(mask, bone);
    let inside = |at: usize| (mask.as_slice()[at] != 0) == bone;
    if !(0..d2.len()).any(inside) || d2.iter().any(|d| d.is_infinite()) {
        return None;
    }
    let mut centers: Vec<u32> = (0..d2.len())
        .filter(|&at| inside(at) && is_ridge(&d2, at, [nx, ny, nz], s))
        .map(|at| at as u32)
        .collect();
    centers.sort_unstable_by(|&a, &b| d2[b as usize].total_cmp(&d2[a as usize]).then(a.cmp(&b)));
    // Largest first: a voxel keeps the first sphere that covers it. Slabs of slices are painted independently.
    let slab = nz.div_ceil(4 * rayon::current_num_threads()).max(4);
    let mut local = vec![0f32; d2.len()];
    local
        .par_chunks_mut(slab * nx * ny)
        .enumerate()
        .for_each(|(n, out)| {
            let slices = n * slab..(n * slab + out.len() / (nx * ny));
            for &center in &centers {
                let at = center as usize;
                let c = [at % nx, at / nx % ny, at / (nx * ny)];
                let radius = f64::from(d2[at]).sqrt();
                paint(
                    out,
                    &slices,
                    c,
                    radius,
                    2.0 * (radius - quarter),
                    [nx, ny, nz],
                    s,
                );
            }
        });
    Some(spread(
        (0..local.len())
            .filter(|&at| inside(at))
            .map(|at| f64::from(local[at])),
    ))
}

/// Spheres that lie within a neighbour's are left out: they paint nothing new.
fn is_ridge(d2: &[f32], at: usize, n: [usize; 3], s: [f64; 3]) -> bool {
    let p = [at % n[0], at / n[0] % n[1], at / (n[0] * n[1])];
    let radius = f64::from(d2[at]).sqrt();
    let near = |a: usize| p[a].saturating_sub(1)..(p[a] + 2).min(n[a]);
    near(2).all(|k| {
        near(1).all(|j| {
            near(0).all(|i| {
                let q = [i, j, k];
                let apart: f64 = (0..3)
                    .map(|a| ((q[a] as f64 - p[a] as f64) * s[a]).powi(2))
                    .sum();
                let other = f64::from(d2[(k * n[1] + j) * n[0] + i]).sqrt();
                apart == 0.0 || other < radius + apart.sqrt() * (1.0 - 1e-6)
            })
        })
    })
}

fn paint(
    out: &mut [f32],
    slices: &std::ops::Range<usize>,
    c: [usize; 3],
    radius: f64,
    thickness: f64,
    [nx, ny, _]: [usize; 3],
    s: [f64; 3],
) {
    let reach = |a: usize| (radius / s[a]) as usize;
    let bounds = |a: usize, n: usize| c[a].saturating_sub(reach(a))..(c[a] + reach(a) + 1).min(n);
    let zs = bounds(2, usize::MAX);
    let r2 = radius * radius * (1.0 - 1e-6);
    for k in zs.start.max(slices.start)..zs.end.min(slices.end) {
        let dz = (k as f64 - c[2] as f64) * s[2];
        for j in bounds(1, ny) {
            let dy = (j as f64 - c[1] as f64) * s[1];
            let left = r2 - dz * dz - dy * dy;
            if left <= 0.0 {
                continue;
            }
            let half = (left.sqrt() / s[0]) as usize;
            let row = ((k - slices.start) * ny + j) * nx;
            let line = &mut out[row + c[0].saturating_sub(half)..row + (c[0] + half + 1).min(nx)];
            for v in line.iter_mut().filter(|v| **v == 0.0) {
                *v = thickness as f32;
            }
        }
    }
}

fn spread(values: impl Iterator<Item = f64>) -> Spread {
    let (mut n, mut sum, mut square, mut max) = (0.0, 0.0, 0.0, 0.0f64);
    for v in values {
        n += 1.0;
        sum += v;
        square += v * v;
        max = max.max(v);
    }
    let mean = sum / n;
    Spread {
        mean_mm: mean,
        sd_mm: (square / n - mean * mean).max(0.0).sqrt(),
        max_mm: max,
    }
}

/// `(1 − χ) / TV` with Euler's number χ of the bone joined through voxel faces, counted from vertices, edges, faces and
/// voxels (Odgaard and Gundersen 1993): for a body of one piece without cavities, the struts that can be cut before it
/// falls apart. Bone that meets in an edge or corner only is not joined: voxels' duals are counted.
pub fn connectivity_density(bone: &Volume<u8>) -> f64 {
    let tv: f64 = bone.grid.size_mm().iter().product();
    (1 - euler(bone)) as f64 / tv
}

/// Euler's number for 6-connected bone: voxels − joined pairs + full squares − full cubes.
pub fn euler(bone: &Volume<u8>) -> i64 {
    let [nx, ny, nz] = bone.grid.n;
    let voxels = bone.as_slice();
    let at = |i: usize, j: usize, k: usize| {
        i < nx && j < ny && k < nz && voxels[(k * ny + j) * nx + i] != 0
    };
    (0..nz)
        .into_par_iter()
        .map(|k| {
            let mut sum = 0i64;
            for j in 0..ny {
                for i in (0..nx).filter(|&i| at(i, j, k)) {
                    let [x, y, z] = [at(i + 1, j, k), at(i, j + 1, k), at(i, j, k + 1)];
                    let xy = x && y && at(i + 1, j + 1, k);
                    let xz = x && z && at(i + 1, j, k + 1);
                    let yz = y && z && at(i, j + 1, k + 1);
                    let xyz = xy && xz && yz && at(i + 1, j + 1, k + 1);
                    let pairs = i64::from(x) + i64::from(y) + i64::from(z);
                    let squares = i64::from(xy) + i64::from(xz) + i64::from(yz);
                    sum += 1 - pairs + squares - i64::from(xyz);
                }
            }
            sum
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    fn mask(n: [usize; 3], spacing: [f64; 3], bone: impl Fn([usize; 3]) -> bool) -> Volume<u8> {
        let grid = Grid::new(n, spacing);
        let voxels = (0..grid.len())
            .map(|at| u8::from(bone([at % n[0], at / n[0] % n[1], at / (n[0] * n[1])])));
        Volume::from_vec(grid, voxels.collect())
    }

    #[test]
    fn distances_are_those_of_a_search_also_for_unequal_spacing() {
        let m = mask([9, 7, 8], [0.1, 0.2, 0.15], |[i, j, k]| {
            (i * 7 + j * 5 + k * 3) % 11 > 1
        });
        let d = squared_distance(&m, true);
        let place = |at: usize| [at % 9, at / 9 % 7, at / 63];
        for (at, found) in d.iter().enumerate() {
            let expected = (0..d.len())
                .filter(|&o| m.as_slice()[o] == 0)
                .map(|o| {
                    let (p, q) = (place(at), place(o));
                    (0..3)
                        .map(|a| ((p[a] as f64 - q[a] as f64) * m.grid.spacing_mm[a]).powi(2))
                        .sum::<f64>()
                })
                .fold(f64::INFINITY, f64::min);
            let expected = if m.as_slice()[at] == 0 { 0.0 } else { expected };
            assert!(
                (f64::from(*found) - expected).abs() < 1e-6,
                "{at}: {found} {expected}"
            );
        }
    }

    #[test]
    fn plates_and_gaps_have_their_thickness() {
        // Plates of 6 voxels every 16, pores of 10 between them, plates at both ends.
        let m = mask([38, 12, 12], [0.02; 3], |[i, _, _]| i % 16 < 6);
        let inner = |v: f64, voxels: f64| (v / 0.02 - voxels).abs() < 0.51;
        let sp = local_thickness(&m, false).unwrap();
        assert!(inner(sp.mean_mm, 10.0) && sp.sd_mm < 1e-6, "{sp:?}");
        let m = mask([38, 12, 12], [0.02; 3], |[i, _, _]| i % 16 >= 6);
        let th = local_thickness(&m, true).unwrap();
        assert!(inner(th.mean_mm, 10.0) && th.sd_mm < 1e-6, "{th:?}");
        let ball = mask([41, 41, 41], [0.01; 3], |p| {
            p.iter().map(|&x| (x as f64 - 20.0).powi(2)).sum::<f64>() < 15.0f64.powi(2)
        });
        let th = local_thickness(&ball, true).unwrap();
        // Diameter 0.30 of a voxelised ball.
        assert!(
            (th.mean_mm / 0.3 - 1.0).abs() < 0.07 && (th.max_mm / 0.3 - 1.0).abs() < 0.05,
            "{th:?}"
        );
    }

    #[test]
    fn euler_numbers_of_known_bodies() {
        let block = |p: [usize; 3]| p.iter().all(|x| (1..6).contains(x));
        let n = [7; 3];
        assert_eq!(euler(&mask(n, [1.0; 3], block)), 1);
        // A tunnel: a ring.
        assert_eq!(
            euler(&mask(n, [1.0; 3], |p| block(p) && !(p[0] == 3 && p[1] == 3))),
            0
        );
        // A cavity: a hollow shell.
        assert_eq!(euler(&mask(n, [1.0; 3], |p| block(p) && p != [3; 3])), 2);
        // Two voxels that meet in an edge are two pieces.
        assert_eq!(
            euler(&mask(n, [1.0; 3], |p| p == [1, 1, 1] || p == [2, 2, 1])),
            2
        );
        // Two tunnels that cross in the middle: genus 3.
        let cross =
            |p: [usize; 3]| block(p) && !(p[0] == 3 && p[1] == 3) && !(p[0] == 3 && p[2] == 3);
        assert_eq!(euler(&mask(n, [1.0; 3], cross)), -2);
    }
}
