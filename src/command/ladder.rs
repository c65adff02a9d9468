//! Owns the models that `solve --error` climbs, from cheap to dear.

use crate::pipeline::apparent::{Method, SolveParams};

/// Elements a voxel along each axis, of interpolated grey values, after one element a voxel.
pub const REFINED: [usize; 2] = [2, 3];

/// Targets from here on stop after the first refinement where the image alone leaves more open. Smaller ones climb on, to the
/// least error that can be stated.
pub const ONE_REFINEMENT: f64 = 0.05;

/// Voxels an element along each axis, tried in turn where one element a voxel does not fit into memory.
pub const COARSENED: [usize; 3] = [2, 3, 4];

/// A stated error that one element a voxel meets on nearly every scan. Of smaller targets it may not, and finer elements follow.
const MET_BY_VOXELS: f64 = 0.3;

/// The most that `--error` can be expected to solve, the largest model last.
pub fn expected(target: f64, params: &SolveParams) -> Vec<SolveParams> {
    if params.plasticity.is_some() {
        return vec![split_voxels(params, 1), split_voxels(params, 2)];
    }
    let mut steps = vec![voxel_fe(params, 1, 1)];
    if target < MET_BY_VOXELS {
        steps.extend([smoothed_again(params), voxel_fe(params, 1, REFINED[0])]);
    }
    if target < ONE_REFINEMENT {
        steps.push(voxel_fe(params, 1, REFINED[1]));
    }
    steps
}

pub fn voxel_fe(params: &SolveParams, coarsen: usize, refine: usize) -> SolveParams {
    SolveParams {
        method: Method::VoxelFe,
        coarsen,
        refine,
        refine_mask: false,
        element_mm: None,
        surface: None,
        ..params.clone()
    }
}

/// Elements that are voxels, or parts of one.
pub fn split_voxels(params: &SolveParams, refine: usize) -> SolveParams {
    SolveParams {
        refine_mask: true,
        ..voxel_fe(params, 1, refine)
    }
}

/// One element a voxel of the grey values smoothed once more.
pub fn smoothed_again(params: &SolveParams) -> SolveParams {
    SolveParams {
        smoothed_again: true,
        ..voxel_fe(params, 1, 1)
    }
}
