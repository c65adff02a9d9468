//! Owns the resolutions that `solve --error` tries, and which of them a specimen is expected to need.

use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::{Method, SolveParams};
use crate::result::extrapolate::expected_of_pair;
use crate::volume::Volume;

/// The finer of each pair of voxel-FE solves: voxels per element, elements per voxel.
pub const PAIRS: [(usize, usize); 4] = [(2, 1), (1, 1), (1, 2), (1, 4)];

/// A pair is worth a try where its expected error is at most this many targets.
pub const MARGIN: f64 = 1.2;

/// Edge of the finer elements of a pair.
pub fn element_mm(bone: &Volume<u8>, (coarsen, refine): (usize, usize)) -> f64 {
    bone.grid.voxel_mm3().cbrt() * coarsen as f64 / refine as f64
}

/// Whether a pair is worth a try.
pub fn suffices(bone: &Volume<u8>, pair: (usize, usize), thickness: f64, target: f64) -> bool {
    expected_of_pair(element_mm(bone, pair), thickness) <= MARGIN * target
}

/// What [`solve_to`] can be expected to come to for a specimen, if lattices do not suffice: the finer voxel-FE solve of the
/// first pair that should.
pub fn expected(bone: &Volume<u8>, target: f64, params: &SolveParams) -> SolveParams {
    let first = |thickness| {
        PAIRS
            .into_iter()
            .find(|pair| suffices(bone, *pair, thickness, target))
    };
    let (coarsen, refine) = plate_thickness_mm(bone).and_then(first).unwrap_or((1, 1));
    voxel_fe(params, coarsen, refine)
}

pub fn voxel_fe(params: &SolveParams, coarsen: usize, refine: usize) -> SolveParams {
    SolveParams {
        method: Method::VoxelFe,
        coarsen,
        refine,
        ..params.clone()
    }
}
