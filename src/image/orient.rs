//! Owns the turn from a file's stored axes to the canonical ones: x to the patient's right, y to the front, z to the
//! head (NIfTI's RAS+). Axes are permuted and flipped, never resampled; an oblique scan keeps its small angle and says so.

use crate::grid::Grid;
use crate::volume::Volume;

/// Rows of a voxel-to-world affine: world mm = `a[r][0..3] · (i, j, k) + a[r][3]`, voxel centres.
pub type Affine = [[f64; 4]; 3];

/// ITK and DICOM count to the patient's left and back: the first two world axes change sign.
pub fn from_lps([x, y, z]: Affine) -> Affine {
    [x.map(|v| -v), y.map(|v| -v), z]
}

/// Which stored axis becomes each canonical one, and whether it is reversed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    pub from: [usize; 3],
    pub reversed: [bool; 3],
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
        self.from == [0, 1, 2] && self.reversed == [false; 3]
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

/// The largest angle in degrees between a stored axis and the world axis it stands for.
pub fn obliquity_deg(affine: &Affine, turn: &Turn) -> f64 {
    let Some(cos) = cosines(affine) else {
        return 0.0;
    };
    (0..3)
        .map(|r| cos[r][turn.from[r]].abs().min(1.0).acos().to_degrees())
        .fold(0.0, f64::max)
}

/// Values as stored (x fastest) brought to the canonical axes. Notes say what was done.
pub fn canonical(
    stored: Grid,
    values: Vec<f32>,
    affine: Affine,
    notes: &mut Vec<String>,
) -> Volume<f32> {
    let Some(turn) = Turn::of(&affine) else {
        notes.push("the orientation in the header is unusable: axes are kept as stored".into());
        return Volume::from_vec(stored, values);
    };
    let oblique = obliquity_deg(&affine, &turn);
    if oblique > 0.1 {
        notes.push(format!(
            "oblique scan: its axes lie up to {oblique:.1}° off the world's; the nearest axes are used, nothing is resampled"
        ));
    }
    let mut volume = Volume::from_vec(stored, values);
    if !turn.is_identity() {
        notes.push(format!(
            "axes turned to the file's orientation: {}",
            turn.words()
        ));
        volume = turned(volume, &turn);
    }
    volume.affine = Some(turned_affine(&affine, &turn, stored.n));
    volume
}

/// A volume with its axes permuted and reversed. The affine is left out.
pub fn turned<T: Copy + Send + Sync>(volume: Volume<T>, turn: &Turn) -> Volume<T> {
    let grid = Grid::new(
        turn.from.map(|a| volume.grid.n[a]),
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
        affine: None,
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
        let v = canonical(grid, values.clone(), affine, &mut notes);
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
    }

    #[test]
    fn oblique_scans_are_said() {
        let (s, c) = 10f64.to_radians().sin_cos();
        let affine = [[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        let mut notes = Vec::new();
        canonical(Grid::new([1; 3], [1.0; 3]), vec![0.0], affine, &mut notes);
        assert!(notes[0].contains("10.0°"), "{notes:?}");
    }
}
