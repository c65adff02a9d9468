//! Owns how lattice sites take up tissue that differs from voxel to voxel.
//!
//! A site's modulus is the mean over the bone in its cell. A bond then has the arithmetic mean of its two ends', because
//! each end owns the half of the bond in its own cell and the energies of both halves add up: stretched together (the
//! energy's exact answer for tissues side by side along the load). The harmonic mean would be exact for tissues one
//! after the other, soften everything else, and spoil the volumetric term, whose weight is the site's.

use crate::discretisation::lattice::placement::near_bone::centres_within;
use crate::discretisation::lattice::placement::{Frame, overlaps};
use crate::volume::Volume;
use rayon::prelude::*;

/// Multiplies every candidate's weight by the relative modulus of its tissue: the mean over the bone in its cell or,
/// for a padded site without bone there, that of the nearest bone voxel.
pub fn scale_by_tissue(frame: &Frame, bone: &Volume<u8>, tissue: &[f32], weights: &mut [f32]) {
    let edge = frame.lp_mm * frame.structure.cell_volume().cbrt();
    weights.par_iter_mut().enumerate().for_each(|(c, weight)| {
        if *weight > 0.0 {
            let at = frame.position_mm(frame.indices(c));
            let own = mean(bone, tissue, at, edge);
            *weight *= own.unwrap_or_else(|| nearest(bone, tissue, at, 2.0 * frame.lp_mm));
        }
    });
}

/// Mean over the bone in the cube of edge `edge` around a position.
fn mean(bone: &Volume<u8>, tissue: &[f32], position_mm: [f64; 3], edge: f64) -> Option<f32> {
    let (grid, voxels) = (&bone.grid, bone.as_slice());
    let spans: [Vec<(usize, f64)>; 3] =
        std::array::from_fn(|a| overlaps(position_mm[a], edge, grid.spacing_mm[a], grid.n[a]));
    let (mut sum, mut volume) = (0.0, 0.0);
    for &(k, wz) in &spans[2] {
        for &(j, wy) in &spans[1] {
            let row = grid.index([0, j, k]);
            for &(i, wx) in spans[0].iter().filter(|s| voxels[row + s.0] != 0) {
                volume += wx * wy * wz;
                sum += wx * wy * wz * f64::from(tissue[row + i]);
            }
        }
    }
    (volume > 0.0).then(|| (sum / volume) as f32)
}

/// The bone voxel whose centre is nearest, within `radius`; the tissue's mean where there is none.
fn nearest(bone: &Volume<u8>, tissue: &[f32], position_mm: [f64; 3], radius: f64) -> f32 {
    let (grid, voxels) = (&bone.grid, bone.as_slice());
    let [x, y, z] = [0, 1, 2]
        .map(|a| centres_within(position_mm[a], radius, grid.spacing_mm[a], grid.n[a]))
        .map(|(first, past)| first..past);
    let squared = |at: [usize; 3]| -> f64 {
        (0..3)
            .map(|a| ((at[a] as f64 + 0.5) * grid.spacing_mm[a] - position_mm[a]).powi(2))
            .sum()
    };
    let mut best = (f64::INFINITY, 1.0);
    for k in z {
        for j in y.clone() {
            for i in x.clone() {
                let at = grid.index([i, j, k]);
                if voxels[at] != 0 {
                    let d = squared([i, j, k]);
                    if d < best.0 {
                        best = (d, tissue[at]);
                    }
                }
            }
        }
    }
    best.1
}
