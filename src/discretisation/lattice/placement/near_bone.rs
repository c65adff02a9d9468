//! Owns the firm rule: a site exists if a bone voxel's centre lies within 1.1 first-neighbour distances of it.
//!
//! Bone is packed to a bit a voxel, and what rows of voxels a ball reaches, and how far along x, is the same for all
//! candidates of a row: asking a row of voxels is then a shift and a mask.

use super::Frame;
use crate::volume::Volume;
use rayon::prelude::*;

/// Reach of the firm rule in first-neighbour distances (Zojaji et al. 2024).
const REACH: f64 = 1.1;

/// 1 where a site exists, for every candidate.
pub fn site_weights(frame: &Frame, bone: &Volume<u8>) -> Vec<f32> {
    let bits = Bits::of(bone);
    let radius = REACH * frame.structure.first_neighbour() * frame.lp_mm;
    let mut weights = vec![0.0; frame.candidates()];
    let rows = weights.par_chunks_mut(frame.n[0]).enumerate();
    rows.for_each_init(Vec::new, |reached, (row, weights)| {
        let first = frame.indices(row * frame.n[0]);
        rows_within(bone, frame.position_mm(first), radius, reached);
        for (i, weight) in (0i32..).zip(weights) {
            let at = [first[0] + i, first[1], first[2]];
            let x = frame.position_mm(at)[0];
            let near = || reached.iter().any(|r| bits.any_within(bone, x, r));
            *weight = f32::from(u8::from(frame.structure.allows(at) && near()));
        }
    });
    weights
}

/// A row of voxels that a ball reaches.
struct Reached {
    row: usize,
    /// From the ball's centre, across x, squared.
    distance: f64,
    /// Of the ball along x.
    half_width: f64,
}

/// Rows whose centre line is within `radius`, nearest first: near ones decide most often.
fn rows_within(bone: &Volume<u8>, position_mm: [f64; 3], radius: f64, found: &mut Vec<Reached>) {
    let grid = &bone.grid;
    let [_, ny, nz] = grid.n;
    let squared = radius * radius * (1.0 + 1e-12);
    found.clear();
    let (k0, k1) = centres_within(position_mm[2], radius, grid.spacing_mm[2], nz);
    for k in k0..k1 {
        let dz = (k as f64 + 0.5) * grid.spacing_mm[2] - position_mm[2];
        let left = squared - dz * dz;
        if left < 0.0 {
            continue;
        }
        let (j0, j1) = centres_within(position_mm[1], left.sqrt(), grid.spacing_mm[1], ny);
        for j in j0..j1 {
            let dy = (j as f64 + 0.5) * grid.spacing_mm[1] - position_mm[1];
            let left = left - dy * dy;
            if left >= 0.0 {
                found.push(Reached {
                    row: k * ny + j,
                    distance: squared - left,
                    half_width: left.sqrt(),
                });
            }
        }
    }
    found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
}

/// Voxels `first..past` along one axis whose centres lie within `radius` of `x`.
pub(in crate::discretisation) fn centres_within(
    x: f64,
    radius: f64,
    h: f64,
    n: usize,
) -> (usize, usize) {
    let (low, high) = ((x - radius) / h - 0.5, (x + radius) / h - 0.5);
    if high < 0.0 {
        return (0, 0);
    }
    // Conversions cut towards zero, without the call that `ceil` and `floor` are on old processors.
    let cut = low.max(0.0) as usize;
    let first = cut + usize::from((cut as f64) < low);
    (first, (high as usize + 1).min(n))
}

/// Bone, one bit a voxel; rows begin at words.
struct Bits {
    words: Vec<u64>,
    per_row: usize,
}

impl Bits {
    fn of(bone: &Volume<u8>) -> Self {
        let nx = bone.grid.n[0];
        let per_row = nx.div_ceil(64);
        let rows = bone.as_slice().par_chunks(nx);
        let pack = |row: &[u8]| -> Vec<u64> {
            let word = |part: &[u8]| {
                let bits = part.iter().enumerate();
                bits.fold(0, |word, (i, &b)| word | u64::from(b != 0) << i)
            };
            row.chunks(64).map(word).collect()
        };
        Bits {
            words: rows.flat_map_iter(pack).collect(),
            per_row,
        }
    }

    /// Whether the row holds bone within its half width of `x`.
    fn any_within(&self, bone: &Volume<u8>, x: f64, r: &Reached) -> bool {
        let grid = &bone.grid;
        let (first, past) = centres_within(x, r.half_width, grid.spacing_mm[0], grid.n[0]);
        first < past && self.any(r.row, first, past)
    }

    fn any(&self, row: usize, first: usize, past: usize) -> bool {
        let words = &self.words[row * self.per_row..(row + 1) * self.per_row];
        let (a, b) = (first / 64, (past - 1) / 64);
        let low = u64::MAX << (first % 64);
        let high = u64::MAX >> (63 - (past - 1) % 64);
        if a == b {
            return words[a] & low & high != 0;
        }
        words[a] & low != 0 || words[a + 1..b].iter().any(|&w| w != 0) || words[b] & high != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::lattice::placement::{Boundary, Frame};
    use crate::discretisation::lattice::stencil::Structure;
    use crate::grid::{Axis, Grid};

    #[test]
    fn a_site_exists_where_the_definition_says() {
        // Longer than two words along x, spacings that differ, sparse bone.
        let grid = Grid::new([150, 12, 9], [0.02, 0.03, 0.025]);
        let values = (0..grid.len()).map(|i| u8::from((i * 7919 + i / 13) % 211 == 0));
        let bone = Volume::from_vec(grid, values.collect());
        for structure in Structure::ALL {
            let frame = Frame::new(
                &grid,
                structure,
                0.07,
                Boundary::Firm,
                Axis::Z,
                [0.01, 0.0, 0.003],
            )
            .unwrap();
            let radius = REACH * structure.first_neighbour() * 0.07;
            let centre = |i: usize| {
                let [nx, ny, _] = grid.n;
                let at = [i % nx, i / nx % ny, i / (nx * ny)];
                [0, 1, 2].map(|a| (at[a] as f64 + 0.5) * grid.spacing_mm[a])
            };
            let bones: Vec<[f64; 3]> = (0..grid.len())
                .filter(|&i| bone.as_slice()[i] != 0)
                .map(centre)
                .collect();
            let weights = site_weights(&frame, &bone);
            let mut exist = 0;
            for (c, &weight) in weights.iter().enumerate() {
                let at = frame.indices(c);
                let p = frame.position_mm(at);
                let squared = |b: &[f64; 3]| (0..3).map(|a| (b[a] - p[a]).powi(2)).sum::<f64>();
                let near = bones
                    .iter()
                    .any(|b| squared(b).sqrt() <= radius * (1.0 + 1e-9));
                let far = bones
                    .iter()
                    .all(|b| squared(b).sqrt() > radius * (1.0 - 1e-9));
                assert!(near != far);
                assert_eq!(weight == 1.0, near && structure.allows(at), "{at:?}");
                exist += usize::from(weight == 1.0);
            }
            assert!(exist > 100 && exist < weights.len());
        }
    }
}
