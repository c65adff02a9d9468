//! Owns segmentation: place, smooth, threshold, volume of interest, connectivity, flat ends, in that order.

#[doc(hidden)]
pub mod laid;
mod params;
mod place;
mod region;
mod summary;
mod window;

pub use crate::format::calibration::GreyUnit;
pub use crate::image::array::headerless::Contents;
pub use crate::measure::morphometry::Morphometry;
pub use params::{Align, AlignBox, SegmentParams, Voi, shown};
pub use place::Rotation;
pub use summary::{SegmentSummary, Surface, implausible_voxels, refuse_impossible_voxels};

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mask::components::Components;
use crate::mask::ends;
use crate::mask::unmeasured::Hidden;
use crate::mask::voi::Inside;
use crate::measure::edge_blur::edge_blur_voxels;
use crate::measure::morphometry::morphometry;
use crate::measure::thickness::plate_thickness_mm;
use crate::volume::{Specimen, Threshold, Volume};
use place::{Placed, place};
use region::inside;
use std::borrow::Cow;
use window::{
    bone_of, count, has_grey_values, has_more_values_than, no_label, nothing_selected, smoothed,
    takes_padding,
};

/// A labelled scan has fewer values.
const MOST_LABELS: usize = 64;

/// A segmented scan with its numbers.
#[derive(Debug, Clone)]
pub struct Segmented<'a> {
    /// Mask, TV and, where they are kept, grey values.
    pub specimen: Specimen,
    /// Its numbers and warnings.
    pub summary: SegmentSummary,
    /// Grey values on the specimen's grid: the scan as it was cropped, turned, resampled and rotated.
    pub scan: Cow<'a, Volume<f32>>,
}

/// Segments `scan`. `voi_mask` is the volume that `Voi::Mask` names, on the scan's grid (before the crop).
pub fn segment<'a>(
    name: &str,
    scan: &'a Volume<f32>,
    params: &SegmentParams,
    voi_mask: Option<&'a Volume<u8>>,
) -> Result<Segmented<'a>> {
    segment_measured(name, scan, params, voi_mask, None)
}

/// The same for a scan in which voxels that are no measurement were hidden.
#[doc(hidden)]
pub fn segment_measured<'a>(
    name: &str,
    scan: &'a Volume<f32>,
    params: &SegmentParams,
    voi_mask: Option<&'a Volume<u8>>,
    hidden: Option<&Hidden>,
) -> Result<Segmented<'a>> {
    params.check()?;
    let threshold = params.otsu || params.lower.is_some() || params.upper.is_some();
    if !threshold && params.labels.is_empty() {
        return Err(Error::setting(
            "lower",
            "no threshold given",
            "give --lower (and --upper), --otsu, or the --labels of a segmented scan",
        ));
    }
    let mut placed = place(scan, params, voi_mask)?;
    let mut found = find(&placed, params)?;
    let plane_cut_mm = match params.plane_cut_mm {
        Some(tile_mm) => Some(cut(&mut placed, &mut found, params, tile_mm)?),
        None => None,
    };
    let grid = placed.scan.grid;
    let (inside, tv_definition) = inside(
        &params.voi,
        grid,
        placed.voi_mask.as_deref(),
        placed.corner_mm,
    )?;
    let tv_mm3 = inside.tv_mm3(&grid);
    let mut specimen = Specimen {
        name: name.into(),
        threshold: threshold_of(&placed, params, &inside, grid),
        grey: params
            .keeps_grey()
            .then(|| smoothed(&placed.scan, params.gaussian_voxels, &placed.grey)),
        bone: found.bone,
        tv_mm3,
        tv_definition,
    };
    if let (Some(grey), Some(threshold)) = (&specimen.grey, &mut specimen.threshold) {
        let measured = || edge_blur_voxels(grey, &specimen.bone);
        threshold.blur_voxels = params.all_blur_voxels().or_else(measured);
    }
    let mut summary = SegmentSummary {
        voxels: grid.n,
        spacing_mm: grid.spacing_mm,
        lower: placed.window.lower,
        upper: placed.window.upper,
        threshold: params.threshold().into(),
        surface: match specimen.threshold {
            Some(_) => Surface::Grey,
            None => Surface::Mask,
        },
        blur_voxels: specimen.threshold.as_ref().and_then(|t| t.blur_voxels),
        grey_min: f64::from(placed.grey.min),
        grey_max: f64::from(placed.grey.max),
        // Hidden voxels are not broken ones.
        non_finite_voxels: hidden.map_or(placed.grey.non_finite, |h| h.non_finite),
        selected_voxels: found.selected,
        outside_voi_voxels: found.outside,
        components: found.components,
        removed_voxels: found.removed,
        bone_voxels: count(&specimen.bone),
        plane_cut_mm,
        rotation: placed.rotation,
        tv_definition: specimen.tv_definition.clone(),
        tv_mm3,
        bv_mm3: specimen.bv_mm3(),
        bv_tv: specimen.bv_tv(),
        mean_thickness_mm: plate_thickness_mm(&specimen.bone),
        morphometry: params.morphometry.then(|| {
            let within = inside.mask(grid);
            morphometry(&specimen.bone, within.as_ref(), tv_mm3)
        }),
        notes: placed.window.notes.clone(),
        warnings: Vec::new(),
    };
    summary.warnings = summary::warnings(&summary);
    if !params.labels.is_empty() && has_more_values_than(MOST_LABELS, &placed.scan) {
        summary.warnings.push(format!(
            "the image holds more than {MOST_LABELS} values: it looks like a grey scan, where --labels selects single grey values. Take --lower or --otsu, or the segmentation of the scan"
        ));
    }
    if params.has_window() {
        let voxels = grid.len() as u64;
        let padded = takes_padding(&placed.window, &placed.grey, voxels);
        summary.warnings.extend(padded);
    }
    if let Some(hidden) = hidden {
        summary.say_hidden(hidden, params.takes_any(hidden.range));
    }
    Ok(Segmented {
        specimen,
        summary,
        scan: placed.scan,
    })
}

/// Labels on the scan's grid, brought to the specimen's as the scan was: cropped, turned, resampled, rotated, its ends cut.
///
/// # Errors
/// Labels on another grid than the scan's.
#[doc(hidden)]
pub fn labels_like(
    labels: &Volume<f32>,
    params: &SegmentParams,
    summary: &SegmentSummary,
) -> Result<Volume<f32>> {
    let followed = SegmentParams {
        labels: vec![1],
        otsu: false,
        lower: None,
        upper: None,
        voi: Voi::Box,
        align: summary.rotation.map(|r| Align::Direction(r.direction)),
        ..params.clone()
    };
    let placed = place(labels, &followed, None)?;
    let Some(cut_mm) = summary.plane_cut_mm else {
        return Ok(placed.scan.into_owned());
    };
    let Grid { n, spacing_mm } = placed.scan.grid;
    let [first, last] = cut_mm.map(|mm| (mm / spacing_mm[2]).round() as usize);
    Ok(placed
        .scan
        .cropped(&[[0, n[0]], [0, n[1]], [first, n[2] - last]]))
}

/// Bone in the volume of interest, and what was left out.
struct Found {
    bone: Volume<u8>,
    selected: u64,
    outside: u64,
    components: u64,
    removed: u64,
}

fn find(placed: &Placed, params: &SegmentParams) -> Result<Found> {
    let (scan, grey, window) = (&*placed.scan, &placed.grey, &placed.window);
    let voi_mask = placed.voi_mask.as_deref();
    let (inside, tv_definition) = inside(&params.voi, scan.grid, voi_mask, placed.corner_mm)?;
    let mut bone = bone_of(scan, params, grey, window);
    let selected = count(&bone);
    if selected == 0 && !params.labels.is_empty() {
        return Err(no_label(scan, &params.labels));
    }
    if selected == 0 {
        return Err(nothing_selected(window, grey));
    }
    let outside = inside.clear_outside(&mut bone);
    let Some((components, removed)) = join(&mut bone, params.keep_all) else {
        return Err(Error::specimen(
            format!(
                "all {selected} voxels in the window lie outside the volume of interest ({tv_definition})"
            ),
            "check the volume of interest against the picture of the scan",
        ));
    };
    Ok(Found {
        bone,
        selected,
        outside,
        components,
        removed,
    })
}

/// How bone follows from the kept values; None for labels and masks, whose surface within a voxel is a guess.
fn threshold_of(
    placed: &Placed,
    params: &SegmentParams,
    inside: &Inside,
    grid: Grid,
) -> Option<Threshold> {
    if !params.labels.is_empty() || !has_grey_values(&placed.scan) {
        return None;
    }
    let (lower, upper) = (placed.window.lower, placed.window.upper);
    Some(Threshold {
        lower: lower.map_or(f32::NEG_INFINITY, |v| v as f32),
        upper: upper.map_or(f32::INFINITY, |v| v as f32),
        inside: inside.mask(grid),
        keep_all: params.keep_all,
        blur_voxels: None,
        is_blur_given: params.blur_voxels.is_some(),
    })
}

/// Keeps the largest component, if asked to: how many there were, and voxels of the others. None without bone.
fn join(bone: &mut Volume<u8>, keep_all: bool) -> Option<(u64, u64)> {
    let components = Components::of(bone);
    let largest = components.largest()?;
    let mut removed = 0;
    if !keep_all {
        removed = components.voxels.iter().sum::<u64>() - components.voxels[largest as usize];
        components.keep_only(largest, bone);
    }
    Some((components.voxels.len() as u64, removed))
}

/// Cuts both ends flat and finds the connected bone again: what was joined by the ends alone goes with them. Returns what was cut off in mm.
fn cut(
    placed: &mut Placed,
    found: &mut Found,
    params: &SegmentParams,
    tile_mm: f64,
) -> Result<[f64; 2]> {
    let Grid { n, spacing_mm } = found.bone.grid;
    let nothing = || {
        Error::setting(
            "segment.plane_cut_mm",
            format!("no slice has bone above and below it in every tile of {tile_mm} mm"),
            "give wider tiles, crop by hand, or align the specimen first",
        )
    };
    let [first, end] = ends::flat(&found.bone, tile_mm).ok_or_else(nothing)?;
    let keep = [[0, n[0]], [0, n[1]], [first, end]];
    found.bone = found.bone.cropped(&keep);
    placed.scan = Cow::Owned(placed.scan.cropped(&keep));
    let mask = placed.voi_mask.take();
    placed.voi_mask = mask.map(|mask| Cow::Owned(mask.cropped(&keep)));
    let (components, removed) = join(&mut found.bone, params.keep_all).ok_or_else(nothing)?;
    found.components += components - 1;
    found.removed += removed;
    Ok([first, n[2] - end].map(|slices| slices as f64 * spacing_mm[2]))
}

#[cfg(test)]
mod tests;
