//! Owns masks and fields reduced by a whole factor, for pictures that need fewer voxels.

use crate::volume::Volume;
use rayon::prelude::*;
use std::ops::Range;

/// Bone fractions of cubes of voxels.
pub(super) struct Reduced {
    /// Cubes along x, y, z.
    pub(super) n: [usize; 3],
    /// Voxels of the mask a side of a cube.
    pub(super) factor: usize,
    /// 0 to 255, x fastest.
    pub(super) share: Vec<u8>,
    /// What a cube of bone has at least. As many have it as the mask has bone: thin struts do not fade away.
    pub(super) level: u8,
}

impl Reduced {
    /// By the smallest factor that `fits` says of the number of cubes along each axis.
    pub(super) fn new(bone: &Volume<u8>, fits: impl Fn([usize; 3]) -> bool) -> Reduced {
        let fewer = |factor: usize| bone.grid.n.map(|n| n.div_ceil(factor));
        let factor = (1..)
            .find(|&f| fewer(f) == [1; 3] || fits(fewer(f)))
            .unwrap_or(1);
        let all = bone.as_slice();
        let share = cubes(bone.grid.n, factor, |rows| {
            let bone_in = |row: Range<usize>| all[row].iter().filter(|&&b| b != 0).count();
            let (count, found) = rows.fold((0, 0), |(n, found), row| {
                (n + row.len(), found + bone_in(row))
            });
            (255 * found / count) as u8
        });
        Reduced {
            n: fewer(factor),
            factor,
            level: level(&share),
            share,
        }
    }

    /// The means of a field's values that are not 0, in the cubes, from 1 for `low` to 255 for `high`; 0 where there are none.
    pub(super) fn field(&self, values: &Volume<f32>, [low, high]: [f64; 2]) -> Vec<u8> {
        let all = values.as_slice();
        cubes(values.grid.n, self.factor, |rows| {
            let (mut sum, mut count) = (0.0, 0.0);
            for value in rows
                .flat_map(|row| &all[row])
                .filter(|v| **v != 0.0 && v.is_finite())
            {
                sum += f64::from(*value);
                count += 1.0;
            }
            match count > 0.0 {
                true => {
                    1 + (254.0 * ((sum / count - low) / (high - low)).clamp(0.0, 1.0)).round() as u8
                }
                false => 0,
            }
        })
    }
}

/// Half a cube, or less where thin bone would be lost with it.
fn level(share: &[u8]) -> u8 {
    let mut counts = [0_usize; 256];
    share.iter().for_each(|&v| counts[usize::from(v)] += 1);
    let bone: usize = counts.iter().enumerate().map(|(v, count)| v * count).sum();
    let (mut above, wanted) = (0, (bone / 255).max(1));
    let reached = (1..=255_u8).rev().find(|&v| {
        above += counts[usize::from(v)];
        above >= wanted
    });
    reached.unwrap_or(128).clamp(40, 128)
}

/// A value for each cube of `factor` voxels, of its rows in the whole array.
fn cubes<I>(n: [usize; 3], factor: usize, value: I) -> Vec<u8>
where
    I: Fn(&mut dyn Iterator<Item = Range<usize>>) -> u8 + Sync,
{
    let fewer = n.map(|n| n.div_ceil(factor));
    let mut all = vec![0; fewer.iter().product()];
    all.par_chunks_mut(fewer[0])
        .enumerate()
        .for_each(|(line, to)| {
            for (x, to) in to.iter_mut().enumerate() {
                let at = [x, line % fewer[1], line / fewer[1]];
                let [xs, ys, zs] =
                    std::array::from_fn(|a| at[a] * factor..((at[a] + 1) * factor).min(n[a]));
                let starts = zs.flat_map(|z| ys.clone().map(move |y| n[0] * (y + n[1] * z)));
                *to = value(&mut starts.map(|row| row + xs.start..row + xs.end));
            }
        });
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    #[test]
    fn thin_struts_do_not_fade_away() {
        // Struts of one voxel in cubes of two: a quarter of each cube.
        let grid = Grid::new([8, 8, 8], [1.0; 3]);
        let strut = |i: usize| i % 8 == 2 && i / 8 % 8 == 5;
        let bone = Volume::from_vec(grid, (0..512).map(|i| u8::from(strut(i))).collect());
        let reduced = Reduced::new(&bone, |n| n[0] <= 4);
        assert_eq!((reduced.factor, reduced.n), (2, [4; 3]));
        let kept = reduced
            .share
            .iter()
            .filter(|&&v| v >= reduced.level)
            .count();
        assert_eq!((kept, reduced.level), (4, 63));
    }

    #[test]
    fn a_reduced_field_is_the_mean_of_its_elements() {
        let grid = Grid::new([4, 2, 2], [1.0; 3]);
        let bone = Volume::from_vec(grid, vec![1; 16]);
        let reduced = Reduced::new(&bone, |n| n[0] <= 2);
        let values = (0..16).map(|i| {
            if i == 0 {
                2.0
            } else if i == 1 {
                4.0
            } else {
                0.0
            }
        });
        let field = reduced.field(&Volume::from_vec(grid, values.collect()), [0.0, 6.0]);
        assert_eq!(field, [1 + 127, 0]);
    }
}
