//! Specimens that several subjects make, voxel by voxel.

use bonepd_ct::grid::Grid;
use bonepd_ct::volume::{Specimen, Volume};

/// `n` voxels of edges `h` (mm), bone where `bone` says so of a voxel's indices; no grey values.
pub fn specimen(n: [usize; 3], h: [f64; 3], bone: impl Fn([usize; 3]) -> bool) -> Specimen {
    let grid = Grid::new(n, h);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let voxels = (0..grid.len()).map(|i| u8::from(bone(at(i)))).collect();
    Specimen {
        name: "made".into(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, voxels),
        tv_definition: "box".into(),
        grey: None,
        threshold: None,
    }
}
