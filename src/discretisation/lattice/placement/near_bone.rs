//! Owns the firm rule: a site exists if a bone voxel's centre lies within 1.1 first-neighbour distances of it, one at exactly
//! that distance included.
//!
//! Bone is packed to a bit a voxel, and what rows of voxels a ball reaches, and how far along x, is the same for all
//! candidates of a row: asking a row of voxels is then a shift and a mask.

use super::Frame;
use crate::discretisation::lattice::stencil::Structure;
use crate::volume::Volume;
use rayon::prelude::*;

/// Reach of the firm rule in first-neighbour distances (Zojaji et al. 2024).
const REACH: f64 = 1.1;

/// Lattice parameters that are multiples of the voxel put centres at exactly this distance: a part in a billion keeps rounding
/// from losing them, as it does in [`crate::grid::Grid::voxel_at`]. All that decides a tie takes the distance from here.
const ROUNDING: f64 = 1e-9;

/// How far a site of the firm rule may be from the nearest centre of a bone voxel.
pub(super) fn radius_mm(structure: Structure, lp_mm: f64) -> f64 {
    REACH * structure.first_neighbour() * lp_mm * (1.0 + ROUNDING)
}

/// 1 where a site exists, for every candidate.
pub fn site_weights(frame: &Frame, bone: &Volume<u8>) -> Vec<f32> {
    let bits = Bits::of(bone);
    let radius = radius_mm(frame.structure, frame.lp_mm);
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
    let squared = radius * radius;
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

    /// More steps beyond the frame of a lattice without an offset than any bone reaches.
    const BEYOND: i32 = 9;

    /// Every place of the infinite lattice, between the loaded faces, has a site where the definition says.
    fn check_definition(bone: &Volume<u8>, structure: Structure, registration_mm: [f64; 3]) {
        const LP_MM: f64 = 0.07;
        let grid = &bone.grid;
        let frame = |boundary| {
            Frame::new(grid, structure, LP_MM, boundary, Axis::Z, registration_mm).unwrap()
        };
        let (padded, proper) = (frame(Boundary::Firm), frame(Boundary::Floppy));
        let weights = site_weights(&padded, bone);
        let centre = |i: usize| {
            let [nx, ny, _] = grid.n;
            let at = [i % nx, i / nx % ny, i / (nx * ny)];
            [0, 1, 2].map(|a| (at[a] as f64 + 0.5) * grid.spacing_mm[a])
        };
        let all = 0..grid.len();
        let bones: Vec<[f64; 3]> = all
            .filter(|&i| bone.as_slice()[i] != 0)
            .map(centre)
            .collect();
        let radius = 1.1 * structure.first_neighbour() * LP_MM;
        let range = |a: usize| match a {
            2 => 0..proper.n[2] as i32,
            _ => -BEYOND..proper.n[a] as i32 + BEYOND,
        };
        let (mut exist, mut none) = (0, 0);
        for k in range(2) {
            for (j, i) in range(1).flat_map(|j| range(0).map(move |i| (j, i))) {
                let at = [i, j, k];
                let p = proper.position_mm(at);
                let squared = |b: &[f64; 3]| (0..3).map(|a| (b[a] - p[a]).powi(2)).sum::<f64>();
                let nearest = bones
                    .iter()
                    .map(squared)
                    .fold(f64::INFINITY, f64::min)
                    .sqrt();
                assert!(
                    (nearest / radius - 1.0).abs() > 1e-8,
                    "no tie is decided here"
                );
                let expected = structure.allows(at) && nearest < radius;
                let found = padded.candidate(at).is_some_and(|c| weights[c] == 1.0);
                assert_eq!(found, expected, "{structure:?} {registration_mm:?} {at:?}");
                (exist, none) = match found {
                    true => (exist + 1, none),
                    false => (exist, none + 1),
                };
            }
        }
        assert!(exist > 50 && none > 50);
    }

    #[test]
    fn a_site_exists_where_the_definition_says() {
        // Longer than two words along x, spacings that differ, sparse bone; the second is solid, so that its sides count.
        let grids = [
            Grid::new([150, 12, 9], [0.02, 0.03, 0.025]),
            Grid::new([12, 11, 9], [0.02, 0.023, 0.025]),
        ];
        let of = |grid: Grid, is_bone: fn(usize) -> bool| {
            let values = (0..grid.len()).map(|i| u8::from(is_bone(i)));
            Volume::from_vec(grid, values.collect())
        };
        let sparse = of(grids[0], |i| (i * 7919 + i / 13) % 211 == 0);
        let solid = of(grids[1], |_| true);
        for structure in Structure::ALL {
            check_definition(&sparse, structure, [0.01, 0.0, 0.003]);
            // Parts of a lattice parameter, to either side, and more than a whole one.
            for shift in [0.0, 0.4, 0.5, 0.75, 1.3] {
                let mm = shift * 0.07 + 1e-4;
                check_definition(&solid, structure, [mm, -mm, 0.0]);
                check_definition(&solid, structure, [-mm, mm, 0.011]);
            }
        }
    }

    #[test]
    fn a_voxel_at_exactly_the_distance_counts_wherever_it_is() {
        // In units of 0.01 mm: sites at 5, 15, ... sideways and 0, 10, ... along z, centres at odd numbers, reach 11.
        let grid = Grid::new([30, 30, 60], [0.02; 3]);
        let frame = Frame::new(&grid, Structure::Sc, 0.1, Boundary::Firm, Axis::Z, [0.0; 3]);
        let frame = frame.unwrap();
        let mut ties = 0;
        for voxel in (0..grid.len()).step_by(37) {
            let mut bone = Volume::from_vec(grid, vec![0; grid.len()]);
            bone.values.as_slice_mut().unwrap()[voxel] = 1;
            let centre = [voxel % 30, voxel / 30 % 30, voxel / 900].map(|v| 2 * v as i32 + 1);
            for (c, weight) in site_weights(&frame, &bone).into_iter().enumerate() {
                let [i, j, k] = frame.indices(c);
                let site = [5 + 10 * i, 5 + 10 * j, 10 * k];
                let squared: i32 = (0..3).map(|a| (site[a] - centre[a]).pow(2)).sum();
                ties += i32::from(squared == 121);
                assert_eq!(weight == 1.0, squared <= 121, "{site:?} {centre:?}");
            }
        }
        assert!(ties > 100, "{ties}");
    }
}
