//! Owns the specimen at the resolution of its elements: coarser by block means, finer by interpolated grey values.

use crate::error::{Error, Result};
use crate::mask::components::Components;
use crate::mask::{resample, upsample};
use crate::pipeline::apparent::{CoarsenBy, Method, SolveParams};
use crate::volume::{Specimen, Threshold, Volume};

/// Bone fraction of a block of voxels from which on it is bone.
const HALF: f32 = 0.5;

/// A specimen whose voxels are the elements that the settings ask for, where that is another mask than its own; None where
/// the elements follow from its voxels alone (as they are, split, or weighted by bone fractions).
///
/// # Errors
/// A finer or coarser copy without bone.
pub fn resolved(specimen: &Specimen, params: &SolveParams) -> Result<Option<Specimen>> {
    if params.method != Method::VoxelFe || params.material.is_some() {
        return Ok(None);
    }
    let bone = if params.refine > 1 && !params.refine_mask {
        match (&specimen.grey, &specimen.threshold) {
            (Some(grey), Some(threshold)) => interpolated(grey, threshold, params.refine),
            _ => return Ok(None),
        }
    } else if params.coarsen > 1 && params.coarsen_by == CoarsenBy::Threshold {
        coarsened(&specimen.bone, params.coarsen)
    } else {
        return Ok(None);
    };
    if bone.as_slice().iter().all(|b| *b == 0) {
        return Err(Error::specimen(
            format!("{}: no bone is left at this element size", specimen.name),
            "take elements nearer the voxel size",
        ));
    }
    Ok(Some(Specimen {
        name: specimen.name.clone(),
        bone,
        tv_mm3: specimen.tv_mm3,
        tv_definition: specimen.tv_definition.clone(),
        grey: None,
        threshold: None,
    }))
}

/// The same settings for a specimen that is at its elements' resolution.
pub fn one_element_a_voxel(params: &SolveParams) -> SolveParams {
    SolveParams {
        refine: 1,
        coarsen: 1,
        ..params.clone()
    }
}

/// Bone where at least half of a block of `factor`³ voxels is bone.
fn coarsened(bone: &Volume<u8>, factor: usize) -> Volume<u8> {
    let fractions = resample::coarsen(bone, factor);
    // Shares are single precision: half of a block may miss by rounding.
    let is_bone = |f: &f32| u8::from(*f >= HALF - 1e-5);
    let voxels = fractions.as_slice().iter().map(is_bone).collect();
    Volume::from_vec(fractions.grid, voxels)
}

/// Grey values interpolated `factor` times as fine and thresholded again, inside the volume of interest, connected as the
/// scan's own mask is.
fn interpolated(grey: &Volume<f32>, threshold: &Threshold, factor: usize) -> Volume<u8> {
    let window = (threshold.lower, threshold.upper);
    let mut bone = upsample::select_between(grey, factor, window);
    if let Some(inside) = &threshold.inside {
        let fine = resample::refine(inside, factor);
        let outside = fine.as_slice().iter().map(|i| *i == 0);
        let voxels = bone.values.iter_mut().zip(outside);
        voxels.filter(|(_, out)| *out).for_each(|(b, _)| *b = 0);
    }
    if !threshold.keep_all {
        let components = Components::of(&bone);
        if let Some(largest) = components.largest() {
            components.keep_only(largest, &mut bone);
        }
    }
    bone
}
