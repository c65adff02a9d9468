//! Owns the voxel grid: indices, spacing and positions in millimetres.

use serde::{Deserialize, Serialize};

/// One of the three axes of a volume. The load axis of the papers is `z`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along a row of voxels: the fastest index.
    X,
    /// From row to row.
    Y,
    /// From slice to slice.
    #[default]
    Z,
}

impl Axis {
    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// `x`, `y` or `z`.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self.index()]
    }
}

/// `n` voxels of size `spacing_mm` along x, y, z; the first voxel's outer corner is the origin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Voxels along x, y, z.
    pub n: [usize; 3],
    /// Edges of a voxel along x, y, z.
    pub spacing_mm: [f64; 3],
}

impl Grid {
    /// From the number of voxels and their edges along x, y, z.
    pub fn new(n: [usize; 3], spacing_mm: [f64; 3]) -> Self {
        Grid { n, spacing_mm }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.n.iter().product()
    }

    /// Whether there are no voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of voxel `(i, j, k)` in a flat array, x fastest.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.n[1] + j) * self.n[0] + i
    }

    /// Edge lengths of the whole box in mm.
    pub fn size_mm(&self) -> [f64; 3] {
        std::array::from_fn(|a| self.n[a] as f64 * self.spacing_mm[a])
    }

    /// Volume of one voxel in mm³.
    pub fn voxel_mm3(&self) -> f64 {
        self.spacing_mm.iter().product()
    }

    /// The voxel that contains a position (mm). Half-open: a position on a voxel face belongs to the higher voxel,
    /// one on or beyond the outer faces to the nearest voxel. `1e-9` voxel absorbs rounding of exact multiples.
    pub fn voxel_at(&self, position_mm: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|a| {
            let v = (position_mm[a] / self.spacing_mm[a] + 1e-9).floor();
            (v.max(0.0) as usize).min(self.n[a] - 1)
        })
    }
}
