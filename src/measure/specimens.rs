//! Owns the masks that unit tests of measures make.

use crate::grid::Grid;
use crate::volume::Volume;

/// 1 at the voxels for whose indices along x, y, z `bone` holds.
pub fn mask(n: [usize; 3], spacing_mm: [f64; 3], bone: impl Fn([usize; 3]) -> bool) -> Volume<u8> {
    let grid = Grid::new(n, spacing_mm);
    let voxels =
        (0..grid.len()).map(|at| u8::from(bone([at % n[0], at / n[0] % n[1], at / (n[0] * n[1])])));
    Volume::from_vec(grid, voxels.collect())
}
