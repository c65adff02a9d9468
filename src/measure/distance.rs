//! Owns the exact distance transform of a mask.

use crate::volume::Volume;
use rayon::prelude::*;

/// Squared distance in mm² from every voxel of the phase to the nearest voxel centre of the other, by the lower envelope
/// of parabolas along each axis in turn (Felzenszwalb and Huttenlocher 2012). Exact, also for unequal spacing.
pub fn squared_distance(mask: &Volume<u8>, bone: bool) -> Vec<f32> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::specimens::mask;

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
}
