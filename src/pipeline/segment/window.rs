//! Owns the window of grey values: from a smoothed scan to its selected voxels.

use super::SegmentParams;
use crate::error::{Error, Result};
use crate::mask::usable::{self, Padding};
use crate::mask::{gaussian, threshold};
use crate::volume::Volume;
use rayon::prelude::*;

/// The finite grey values of a scan, and which of them are measurements.
pub(super) struct Grey {
    pub min: f32,
    pub max: f32,
    /// NaN and infinite voxels.
    pub non_finite: u64,
    pub padding: Vec<Padding>,
    /// Of the values that are no padding.
    pub measured: [f32; 2],
}

pub(super) fn grey_range(scan: &Volume<f32>) -> Result<Grey> {
    let values = scan.as_slice();
    let Some(ends) = usable::extremes(values) else {
        return Err(Error::specimen(
            "no voxel has a grey value that is a finite number and a measurement",
            "check how the scan was exported, and its padding value (PixelPaddingValue)",
        ));
    };
    let (padding, measured) = usable::padding(values, &ends);
    Ok(Grey {
        min: ends.min,
        max: ends.max,
        non_finite: ends.non_finite,
        padding,
        measured,
    })
}

/// NaN and infinities count as the darkest grey value while smoothing.
fn clean(grey: &Grey) -> impl Fn(f32) -> f32 + Sync {
    let darkest = grey.min;
    move |v| if v.is_finite() { v } else { darkest }
}

/// A window of grey values, and what is to be said of how it was chosen.
pub(super) struct Window {
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    pub notes: Vec<String>,
}

pub(super) fn window(scan: &Volume<f32>, params: &SegmentParams, grey: &Grey) -> Result<Window> {
    if !params.otsu {
        return Ok(Window {
            lower: params.lower,
            upper: params.upper,
            notes: Vec::new(),
        });
    }
    let voxels = scan.grid.len() as u64;
    let (range, outliers) =
        usable::without_outliers(scan.as_slice(), grey.measured, voxels - grey.non_finite);
    let [low, high] = range;
    let plane = scan.grid.n[0] * scan.grid.n[1];
    let raw = scan.as_slice();
    let slabs = gaussian::map_slabs(
        scan,
        params.gaussian_voxels,
        clean(grey),
        |slices, values| {
            let raw = &raw[slices.start * plane..slices.end * plane];
            let measured = |(&v, &raw): (&f32, &f32)| match (low..=high).contains(&raw) {
                true => v,
                false => f32::NAN,
            };
            let values: Vec<f32> = values.iter().zip(raw).map(measured).collect();
            threshold::histogram(&values, low, high)
        },
    );
    let mut counts = vec![0; threshold::BINS];
    for slab in slabs {
        counts.iter_mut().zip(slab).for_each(|(sum, c)| *sum += c);
    }
    let found = threshold::otsu(&counts, f64::from(low), f64::from(high));
    let lower = found.ok_or_else(|| {
        Error::specimen(
            format!("all grey values are {low}: there is nothing to threshold"),
            "check how the scan was exported",
        )
    })?;
    Ok(Window {
        lower: Some(lower),
        upper: None,
        notes: usable::left_out(&grey.padding, range, outliers, voxels),
    })
}

/// What a window says of padding that it takes for bone.
pub(super) fn takes_padding(window: &Window, grey: &Grey, voxels: u64) -> Option<String> {
    let (lower, upper) = (
        window.lower.unwrap_or(f64::NEG_INFINITY),
        window.upper.unwrap_or(f64::INFINITY),
    );
    let taken = |p: &&Padding| (lower..=upper).contains(&f64::from(p.value));
    let p = grey.padding.iter().find(taken)?;
    Some(format!(
        "the window takes {:.1} % of the voxels, which hold {}: padding, as it is far from all other values. Give --lower and --upper that leave it out",
        100.0 * p.voxels as f64 / voxels.max(1) as f64,
        p.value
    ))
}

/// The voxels that are bone by the window or the labels, in a scan whose values and window are known.
pub(super) fn bone_of(
    scan: &Volume<f32>,
    params: &SegmentParams,
    grey: &Grey,
    window: &Window,
) -> Volume<u8> {
    match params.labels.is_empty() {
        true => select(scan, params.gaussian_voxels, grey, window),
        false => labelled(scan, &params.labels),
    }
}

fn select(scan: &Volume<f32>, sigma: f64, grey: &Grey, window: &Window) -> Volume<u8> {
    // Voxels are of single precision, and so is the bound that one of them is to meet: 0.7 takes a voxel of 0.7.
    let lower = window.lower.map_or(f32::NEG_INFINITY, |v| v as f32);
    let upper = window.upper.map_or(f32::INFINITY, |v| v as f32);
    let plane = scan.grid.n[0] * scan.grid.n[1];
    let raw = scan.as_slice();
    let slabs = gaussian::map_slabs(scan, sigma, clean(grey), |slices, values| {
        let raw = &raw[slices.start * plane..slices.end * plane];
        let bone = |(&v, &raw): (&f32, &f32)| u8::from(raw.is_finite() && v >= lower && v <= upper);
        values.iter().zip(raw).map(bone).collect::<Vec<u8>>()
    });
    let mut bone = Volume::from_vec(scan.grid, slabs.concat());
    bone.affine = scan.affine;
    bone
}

/// The smoothed values of every voxel, on the scan's grid.
pub(super) fn smoothed(scan: &Volume<f32>, sigma: f64, grey: &Grey) -> Volume<f32> {
    if sigma == 0.0 && grey.non_finite == 0 {
        return scan.clone();
    }
    let slabs = gaussian::map_slabs(scan, sigma, clean(grey), |_, values| values.to_vec());
    let mut smooth = Volume::from_vec(scan.grid, slabs.concat());
    smooth.affine = scan.affine;
    smooth
}

/// Most values that a segmented image has: pore, and a few labels.
const LABELS: usize = 4;

/// Whether an image holds grey values, and not a mask or a few labels.
pub(super) fn has_grey_values(scan: &Volume<f32>) -> bool {
    has_more_values_than(LABELS, scan)
}

/// Whether an image holds more than `most` values.
pub(super) fn has_more_values_than(most: usize, scan: &Volume<f32>) -> bool {
    let mut found: Vec<f32> = Vec::with_capacity(most + 1);
    for &v in scan.as_slice().iter().filter(|v| v.is_finite()) {
        if !found.contains(&v) {
            found.push(v);
        }
        if found.len() > most {
            return true;
        }
    }
    false
}

pub(super) fn count(bone: &Volume<u8>) -> u64 {
    bone.as_slice()
        .par_chunks(1 << 16)
        .map(|c| c.iter().map(|&v| u64::from(v)).sum::<u64>())
        .sum()
}

pub(super) fn nothing_selected(window: &Window, grey: &Grey) -> Error {
    let side = |v: Option<f64>| v.map_or("…".into(), |v| v.to_string());
    Error::specimen(
        format!(
            "no voxel lies between {} and {}: the scan's grey values run from {} to {}",
            side(window.lower),
            side(window.upper),
            grey.min,
            grey.max
        ),
        match (grey.min, grey.max) {
            (0.0, 1.0) => {
                "values of 0 and 1 are a mask: give --labels 1 (in a recipe labels = [1] and no lower, upper)"
            }
            _ => {
                "choose a window inside that range (image's own units; smoothing narrows it), or --otsu"
            }
        },
    )
}

/// 1 where the value is one of the labels, which are smaller than [`super::params::MOST_LABEL`].
fn labelled(scan: &Volume<f32>, labels: &[i32]) -> Volume<u8> {
    let labels: Vec<f32> = labels.iter().map(|&l| l as f32).collect();
    let voxels = scan.as_slice().par_iter();
    let bone = voxels.map(|v| u8::from(labels.contains(v))).collect();
    let mut mask = Volume::from_vec(scan.grid, bone);
    mask.affine = scan.affine;
    mask
}

pub(super) fn no_label(scan: &Volume<f32>, labels: &[i32]) -> Error {
    let mut found: Vec<f32> = Vec::new();
    for &v in scan.as_slice() {
        if found.len() < 9 && v.is_finite() && !found.contains(&v) {
            found.push(v);
        }
    }
    found.sort_by(f32::total_cmp);
    let words: Vec<String> = found.iter().take(8).map(f32::to_string).collect();
    Error::specimen(
        format!(
            "no voxel has one of the labels {labels:?}; values found: {}{}",
            words.join(", "),
            if found.len() > 8 { ", …" } else { "" }
        ),
        "check the labels, or give a threshold if the scan holds grey values",
    )
}
