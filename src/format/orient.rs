//! Owns the turn from a file's stored axes to the canonical ones: x to the patient's right, y to the front, z to the
//! head (NIfTI's RAS+). Axes are permuted and flipped, never resampled; an oblique scan keeps its small angle and says so.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::volume::Volume;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::path::Path;

/// Rows of a voxel-to-world affine: world mm = `a[r][0..3] · (i, j, k) + a[r][3]`, voxel centres.
pub type Affine = [[f64; 4]; 3];

/// ITK and DICOM count to the patient's left and back: the first two world axes change sign.
pub fn from_lps([x, y, z]: Affine) -> Affine {
    [x.map(|v| -v), y.map(|v| -v), z]
}

/// Which stored axis becomes each canonical one, and whether it is reversed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Turn {
    pub from: [usize; 3],
    pub reversed: [bool; 3],
}

impl Default for Turn {
    fn default() -> Self {
        Turn {
            from: [0, 1, 2],
            reversed: [false; 3],
        }
    }
}

impl Turn {
    /// The turn that brings the stored axes closest to the world's: of all assignments of axes, the one with the
    /// largest sum of |cosines|. None if a column of the affine is zero or not finite.
    pub fn of(affine: &Affine) -> Option<Turn> {
        let cos = cosines(affine)?;
        let closeness = |p: &[usize; 3]| (0..3).map(|r| cos[r][p[r]].abs()).sum::<f64>();
        // On ties (45°) the earlier permutation stays: stored order is kept.
        let best = PERMUTATIONS.into_iter().fold([0, 1, 2], |best, p| {
            if closeness(&p) > closeness(&best) + 1e-9 {
                p
            } else {
                best
            }
        });
        Some(Turn {
            from: best,
            reversed: std::array::from_fn(|r| cos[r][best[r]] < 0.0),
        })
    }

    pub fn is_identity(&self) -> bool {
        *self == Turn::default()
    }

    /// The turn back to the stored axes.
    pub fn inverse(&self) -> Turn {
        let mut back = Turn::default();
        for (r, a) in self.from.into_iter().enumerate() {
            back.from[a] = r;
            back.reversed[a] = self.reversed[r];
        }
        back
    }

    /// This turn and then `next`, as one.
    pub fn then(&self, next: &Turn) -> Turn {
        Turn {
            from: next.from.map(|r| self.from[r]),
            reversed: std::array::from_fn(|r| self.reversed[next.from[r]] != next.reversed[r]),
        }
    }

    /// In words, as `+y, -x, +z`: the stored axis and sense that became x, y and z.
    pub fn words(&self) -> String {
        let names = ["i", "j", "k"];
        let part = |r: usize| {
            let sign = if self.reversed[r] { "-" } else { "+" };
            format!("{} = {sign}{}", ["x", "y", "z"][r], names[self.from[r]])
        };
        [part(0), part(1), part(2)].join(", ")
    }
}

const PERMUTATIONS: [[usize; 3]; 6] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
];

/// Cosines between world axes (rows) and stored axes (columns).
fn cosines(affine: &Affine) -> Option<[[f64; 3]; 3]> {
    let norm = column_norms(affine);
    if norm.iter().any(|n| !n.is_finite() || *n <= 0.0) {
        return None;
    }
    Some(std::array::from_fn(|r| {
        std::array::from_fn(|c| affine[r][c] / norm[c])
    }))
}

/// Lengths of the affine's columns: the spacing along the stored axes.
pub fn column_norms(affine: &Affine) -> [f64; 3] {
    std::array::from_fn(|c| (0..3).map(|r| affine[r][c].powi(2)).sum::<f64>().sqrt())
}

/// Directions (columns) times the spacing along the stored axes.
pub fn scaled(directions: &Affine, spacing_mm: [f64; 3]) -> Affine {
    directions.map(|[x, y, z, origin]| {
        [
            x * spacing_mm[0],
            y * spacing_mm[1],
            z * spacing_mm[2],
            origin,
        ]
    })
}

/// The largest angle in degrees between a stored axis and the world axis it stands for.
pub fn obliquity_deg(affine: &Affine, turn: &Turn) -> f64 {
    let Some(cos) = cosines(affine) else {
        return 0.0;
    };
    (0..3)
        .map(|r| cos[r][turn.from[r]].abs().min(1.0).acos().to_degrees())
        .fold(0.0, f64::max)
}

/// The largest angle in degrees by which two stored axes miss a right angle.
pub fn shear_deg(affine: &Affine) -> f64 {
    let Some(cos) = cosines(affine) else {
        return 0.0;
    };
    let between = |a: usize, b: usize| (0..3).map(|r| cos[r][a] * cos[r][b]).sum::<f64>();
    [(0, 1), (0, 2), (1, 2)]
        .map(|(a, b)| between(a, b).abs().min(1.0).asin().to_degrees())
        .into_iter()
        .fold(0.0, f64::max)
}

/// Angles below this (degrees) are rounding: over 500 voxels they move less than one.
pub const SMALLEST_ANGLE_DEG: f64 = 0.1;

/// Whether voxels on `affine` are boxes: a sheared one is refused, an oblique one is noted.
pub fn check(path: &Path, affine: &Affine, notes: &mut Vec<String>) -> Result<()> {
    let shear = shear_deg(affine);
    if shear > SMALLEST_ANGLE_DEG {
        return Err(sheared(path, shear));
    }
    let oblique = Turn::of(affine).map_or(0.0, |turn| obliquity_deg(affine, &turn));
    if oblique > SMALLEST_ANGLE_DEG {
        notes.push(format!(
            "oblique scan: its axes lie up to {oblique:.1}° off the world's; the nearest axes are used, nothing is resampled"
        ));
    }
    Ok(())
}

pub fn sheared(path: &Path, angle_deg: f64) -> Error {
    Error::file(
        path,
        format!(
            "is sheared: its axes miss a right angle by {angle_deg:.2}° (a tilted gantry, or a registration), so its voxels are no boxes"
        ),
        "resample it to a grid of right angles (dcm2niix corrects a tilted gantry; 3D Slicer: Resample Scalar/Vector/DWI Volume)",
    )
}

/// Values as stored (x fastest) brought to the canonical axes, and the turn. Notes say what was done.
pub fn canonical(
    stored: Grid,
    values: Vec<f32>,
    affine: Affine,
    notes: &mut Vec<String>,
) -> (Volume<f32>, Turn) {
    let volume = Volume::from_vec(stored, values);
    let Some(turn) = Turn::of(&affine) else {
        notes.push("the orientation in the header is unusable: axes are kept as stored".into());
        return (volume, Turn::default());
    };
    if !turn.is_identity() {
        notes.push(format!(
            "axes turned to the file's orientation: {}",
            turn.words()
        ));
    }
    let placed = Volume {
        affine: Some(affine),
        ..volume
    };
    (turned(placed, &turn), turn)
}

/// A volume with its axes permuted and reversed, at its place in the world.
pub fn turned<T: Copy + Send + Sync>(volume: Volume<T>, turn: &Turn) -> Volume<T> {
    if turn.is_identity() {
        return volume;
    }
    let n = volume.grid.n;
    let grid = Grid::new(
        turn.from.map(|a| n[a]),
        turn.from.map(|a| volume.grid.spacing_mm[a]),
    );
    // Array axes are (z, y, x): canonical axis r is array axis 2 - r.
    let order = [2 - turn.from[2], 2 - turn.from[1], 2 - turn.from[0]];
    let mut values = volume.values.permuted_axes(order);
    for r in 0..3 {
        if turn.reversed[r] {
            values.invert_axis(ndarray::Axis(2 - r));
        }
    }
    Volume {
        grid,
        values: values.as_standard_layout().into_owned(),
        affine: volume.affine.map(|affine| turned_affine(&affine, turn, n)),
    }
}

/// The same of a volume that is kept; copied only where there is something to turn.
pub fn turned_copy<'a, T: Copy + Send + Sync>(
    volume: &'a Volume<T>,
    turn: &Turn,
) -> Cow<'a, Volume<T>> {
    match turn.is_identity() {
        true => Cow::Borrowed(volume),
        false => Cow::Owned(turned(volume.clone(), turn)),
    }
}

/// The affine that belongs to the turned voxels.
fn turned_affine(affine: &Affine, turn: &Turn, n: [usize; 3]) -> Affine {
    std::array::from_fn(|w| {
        let mut row = [0.0; 4];
        row[3] = affine[w][3];
        for r in 0..3 {
            let column = affine[w][turn.from[r]];
            if turn.reversed[r] {
                row[r] = -column;
                row[3] += column * (n[turn.from[r]] as f64 - 1.0);
            } else {
                row[r] = column;
            }
        }
        row
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every voxel keeps its place in the world, whatever the stored order.
    #[test]
    fn voxels_keep_their_world_positions() {
        let affine = [
            [0.0, 0.0, -0.3, 5.0],
            [0.1, 0.0, 0.0, -1.0],
            [0.0, -0.2, 0.0, 2.0],
        ];
        let n = [2, 3, 4];
        let grid = Grid::new(n, [0.1, 0.2, 0.3]);
        let values: Vec<f32> = (0..24).map(|v| v as f32).collect();
        let mut notes = Vec::new();
        let (v, turn) = canonical(grid, values.clone(), affine, &mut notes);
        assert_eq!(v.grid.n, [4, 2, 3]);
        assert_eq!(v.grid.spacing_mm, [0.3, 0.1, 0.2]);
        let world = |a: &Affine, p: [usize; 3]| -> [f64; 3] {
            std::array::from_fn(|r| (0..3).map(|c| a[r][c] * p[c] as f64).sum::<f64>() + a[r][3])
        };
        let new = v.affine.unwrap();
        for k in 0..n[2] {
            for j in 0..n[1] {
                for i in 0..n[0] {
                    let stored = values[grid.index([i, j, k])];
                    let at = v.as_slice().iter().position(|&x| x == stored).unwrap();
                    let p = [at % 4, at / 4 % 2, at / 8];
                    let (a, b) = (world(&affine, [i, j, k]), world(&new, p));
                    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12));
                }
            }
        }
        let diagonal = [new[0][0], new[1][1], new[2][2]];
        assert!(
            diagonal.iter().all(|&d| d > 0.0),
            "canonical axes point the world's way"
        );
        assert!(notes[0].contains("x = -k, y = +i, z = -j"), "{notes:?}");
        let back = turned(v, &turn.inverse());
        assert_eq!(back.as_slice(), values);
        assert_eq!(back.grid, grid);
        let rows = back.affine.unwrap().into_iter().flatten();
        assert!(
            rows.zip(affine.into_iter().flatten())
                .all(|(a, b)| (a - b).abs() < 1e-12)
        );
    }

    #[test]
    fn oblique_scans_are_said() {
        let (s, c) = 10f64.to_radians().sin_cos();
        let affine = [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let mut notes = Vec::new();
        check(Path::new("x"), &affine, &mut notes).unwrap();
        assert!(notes[0].contains("10.0°"), "{notes:?}");
    }

    #[test]
    fn sheared_scans_are_refused_whatever_their_obliquity() {
        for (degrees, refused) in [(20f64, true), (0.2, true), (0.05, false)] {
            let drift = degrees.to_radians().sin();
            let affine = [
                [0.0, 0.02 * drift, 0.02, 0.0],
                [-0.03, 0.0, 0.0, 0.0],
                [0.0, 0.02 * (1.0 - drift * drift).sqrt(), 0.0, 0.0],
            ];
            let found = check(Path::new("x"), &affine, &mut Vec::new());
            assert_eq!(found.is_err(), refused, "{degrees}");
            assert!((shear_deg(&affine) - degrees).abs() < 1e-6);
        }
    }

    #[test]
    fn turns_follow_each_other() {
        let values: Vec<f32> = (0..24).map(|v| v as f32).collect();
        let v = || Volume::from_vec(Grid::new([2, 3, 4], [1.0; 3]), values.clone());
        let a = Turn {
            from: [2, 0, 1],
            reversed: [true, false, true],
        };
        let b = Turn {
            from: [1, 0, 2],
            reversed: [false, true, true],
        };
        let both = turned(turned(v(), &a), &b);
        assert_eq!(both.as_slice(), turned(v(), &a.then(&b)).as_slice());
        assert!(a.then(&a.inverse()).is_identity());
    }
}
