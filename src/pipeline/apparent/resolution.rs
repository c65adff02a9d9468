//! Owns the specimen at the resolution of its elements: coarser by block means, finer by interpolated grey values.

use crate::error::{Error, Result};
use crate::mask::components::Components;
use crate::mask::voi::Inside;
use crate::mask::{gaussian, resample, upsample};
use crate::pipeline::apparent::{CoarsenBy, Method, SolveParams};
use crate::result::settings::Elements;
use crate::result::shape::{AGAIN_VOXELS, BLURRED_VOXELS, Image};
use crate::volume::{Specimen, Threshold, Volume};

/// Bone fraction of a block of voxels from which on it is bone.
const HALF: f32 = 0.5;

/// Bone fractions are sums of shares in single precision.
const ROUNDING: f32 = 1e-5;

/// A specimen whose voxels are the elements that the settings ask for, where that is another mask than its own; None where
/// the elements follow from its voxels alone (as they are, split, or weighted by bone fractions).
///
/// # Errors
/// A finer or coarser copy without bone.
pub fn resolved(specimen: &Specimen, params: &SolveParams) -> Result<Option<Specimen>> {
    if params.method != Method::VoxelFe || params.material.is_some() {
        return Ok(None);
    }
    let bone = if params.smoothed_again {
        match (&specimen.grey, &specimen.threshold) {
            (Some(grey), Some(threshold)) => smoothed(grey, threshold),
            _ => return Ok(None),
        }
    } else if params.refine > 1 && !params.refine_mask {
        match (&specimen.grey, &specimen.threshold) {
            (Some(grey), Some(threshold)) => match image(specimen) {
                Image::Grey { blur_voxels } if blur_voxels < BLURRED_VOXELS => {
                    interpolated(&upsample::sharpened(grey), threshold, params.refine)
                }
                _ => interpolated(grey, threshold, params.refine),
            },
            _ => return Ok(None),
        }
    } else if params.coarsen > 1 && params.coarsen_by == CoarsenBy::Threshold {
        coarsened(specimen, params.coarsen)
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

/// What a specimen's image says of the surface within a voxel.
pub fn image(specimen: &Specimen) -> Image {
    match (&specimen.grey, &specimen.threshold) {
        (Some(_), Some(threshold)) => Image::Grey {
            blur_voxels: threshold.blur_voxels.unwrap_or(0.0),
        },
        _ => Image::Mask,
    }
}

/// What the elements follow from.
pub fn elements(specimen: &Specimen, params: &SolveParams) -> Elements {
    let resolved = params.material.is_none();
    let grey = specimen.grey.is_some() && specimen.threshold.is_some();
    match (params.refine, params.coarsen, params.coarsen_by) {
        (1, 1, _) if params.smoothed_again && grey => Elements::SmoothedGrey,
        (1, 1, _) => Elements::Voxels,
        (1, _, CoarsenBy::Threshold) if resolved => Elements::BlockMeans,
        (1, _, _) => Elements::BoneFractions,
        _ if resolved && grey && !params.refine_mask => Elements::InterpolatedGrey,
        _ => Elements::SplitVoxels,
    }
}

/// The same settings for a specimen that is at its elements' resolution.
pub fn one_element_a_voxel(params: &SolveParams) -> SolveParams {
    SolveParams {
        refine: 1,
        coarsen: 1,
        smoothed_again: false,
        ..params.clone()
    }
}

/// Bone where the mean of a block of `factor`³ voxels lies in the window: of grey values where they are known, else of the
/// mask. A block of the mask that is bone to exactly one half is what the block twice as wide around it is.
fn coarsened(specimen: &Specimen, factor: usize) -> Volume<u8> {
    if let (Some(grey), Some(threshold)) = (&specimen.grey, &specimen.threshold) {
        let means = resample::block_means(grey, factor);
        let is_bone = |v: &f32| u8::from(*v >= threshold.lower && *v <= threshold.upper);
        let voxels = means.as_slice().iter().map(is_bone).collect();
        let bone = Volume::from_vec(means.grid, voxels);
        let inside = threshold.inside.as_ref();
        let inside = inside.map(|mask| at_least_half(mask, factor));
        return kept(bone, inside.as_ref(), threshold.keep_all);
    }
    at_least_half(&specimen.bone, factor)
}

fn at_least_half(mask: &Volume<u8>, factor: usize) -> Volume<u8> {
    let fractions = resample::coarsen(mask, factor);
    let wider = resample::coarsen_wide(mask, factor);
    let is_bone = |(f, wide): (&f32, &f32)| match (f - HALF).abs() < ROUNDING {
        true => u8::from(*wide >= HALF),
        false => u8::from(*f > HALF),
    };
    let voxels = fractions.as_slice().iter().zip(wider.as_slice());
    Volume::from_vec(fractions.grid, voxels.map(is_bone).collect())
}

/// Grey values smoothed once more and thresholded again.
fn smoothed(grey: &Volume<f32>, threshold: &Threshold) -> Volume<u8> {
    let window = threshold.lower..=threshold.upper;
    let slabs = gaussian::map_slabs(
        grey,
        AGAIN_VOXELS,
        |v| v,
        |_, values| {
            let bone = values.iter().map(|v| u8::from(window.contains(v)));
            bone.collect::<Vec<u8>>()
        },
    );
    let bone = Volume::from_vec(grey.grid, slabs.concat());
    kept(bone, threshold.inside.as_ref(), threshold.keep_all)
}

/// Grey values interpolated `factor` times as fine and thresholded again, inside the volume of interest, connected as the
/// scan's own mask is.
fn interpolated(grey: &Volume<f32>, threshold: &Threshold, factor: usize) -> Volume<u8> {
    let window = (threshold.lower, threshold.upper);
    let bone = upsample::select_between(grey, factor, window);
    let inside = threshold.inside.as_ref();
    let inside = inside.map(|mask| resample::refine(mask, factor));
    kept(bone, inside.as_ref(), threshold.keep_all)
}

/// Bone inside the volume of interest; unless all is kept, its largest 6-connected component.
fn kept(mut bone: Volume<u8>, inside: Option<&Volume<u8>>, keep_all: bool) -> Volume<u8> {
    if let Some(inside) = inside {
        Inside::Mask(inside).clear_outside(&mut bone);
    }
    if !keep_all {
        let components = Components::of(&bone);
        if let Some(largest) = components.largest() {
            components.keep_only(largest, &mut bone);
        }
    }
    bone
}
