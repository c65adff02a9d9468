//! Owns the window of grey values: from a smoothed scan to its selected voxels.

use super::SegmentParams;
use crate::error::{Error, Result};
use crate::mask::{gaussian, threshold};
use crate::volume::Volume;
use rayon::prelude::*;

/// Range of the finite grey values.
pub(super) struct Grey {
    pub min: f32,
    pub max: f32,
    /// NaN and infinite voxels.
    pub non_finite: u64,
}

pub(super) fn grey_range(scan: &Volume<f32>) -> Result<Grey> {
    let grey = scan
        .as_slice()
        .par_chunks(1 << 16)
        .map(|values| {
            let mut grey = Grey {
                min: f32::INFINITY,
                max: f32::NEG_INFINITY,
                non_finite: 0,
            };
            for &v in values {
                if v.is_finite() {
                    grey.min = grey.min.min(v);
                    grey.max = grey.max.max(v);
                } else {
                    grey.non_finite += 1;
                }
            }
            grey
        })
        .reduce(
            || Grey {
                min: f32::INFINITY,
                max: f32::NEG_INFINITY,
                non_finite: 0,
            },
            |a, b| Grey {
                min: a.min.min(b.min),
                max: a.max.max(b.max),
                non_finite: a.non_finite + b.non_finite,
            },
        );
    if grey.min > grey.max {
        return Err(Error::specimen(
            "no voxel has a finite grey value",
            "check how the scan was exported",
        ));
    }
    Ok(grey)
}

/// NaN and infinities count as the darkest grey value while smoothing.
fn clean(grey: &Grey) -> impl Fn(f32) -> f32 + Sync {
    let darkest = grey.min;
    move |v| if v.is_finite() { v } else { darkest }
}

pub(super) fn window(
    scan: &Volume<f32>,
    params: &SegmentParams,
    grey: &Grey,
) -> Result<(Option<f64>, Option<f64>)> {
    if !params.otsu {
        return Ok((params.lower, params.upper));
    }
    let (min, max) = (grey.min, grey.max);
    let slabs = gaussian::map_slabs(scan, params.gaussian_voxels, clean(grey), |_, values| {
        threshold::histogram(values, min, max)
    });
    let mut counts = vec![0; threshold::BINS];
    for slab in slabs {
        counts.iter_mut().zip(slab).for_each(|(sum, c)| *sum += c);
    }
    threshold::otsu(&counts, f64::from(min), f64::from(max))
        .map(|t| (Some(t), None))
        .ok_or_else(|| {
            Error::specimen(
                format!("all grey values are {min}: there is nothing to threshold"),
                "check how the scan was exported",
            )
        })
}

/// The voxels that are bone by the window or the labels, in a scan whose values and window are known.
pub(super) fn bone_of(
    scan: &Volume<f32>,
    params: &SegmentParams,
    grey: &Grey,
    (lower, upper): (Option<f64>, Option<f64>),
) -> Volume<u8> {
    match params.labels.is_empty() {
        true => select(scan, params.gaussian_voxels, grey, lower, upper),
        false => labelled(scan, &params.labels),
    }
}

fn select(
    scan: &Volume<f32>,
    sigma: f64,
    grey: &Grey,
    lower: Option<f64>,
    upper: Option<f64>,
) -> Volume<u8> {
    let (lower, upper) = (
        lower.unwrap_or(f64::NEG_INFINITY),
        upper.unwrap_or(f64::INFINITY),
    );
    let plane = scan.grid.n[0] * scan.grid.n[1];
    let raw = scan.as_slice();
    let slabs = gaussian::map_slabs(scan, sigma, clean(grey), |slices, values| {
        let raw = &raw[slices.start * plane..slices.end * plane];
        let bone = |(&v, &raw): (&f32, &f32)| {
            let v = f64::from(v);
            u8::from(raw.is_finite() && v >= lower && v <= upper)
        };
        values.iter().zip(raw).map(bone).collect::<Vec<u8>>()
    });
    let mut bone = Volume::from_vec(scan.grid, slabs.concat());
    bone.affine = scan.affine;
    bone
}

pub(super) fn count(bone: &Volume<u8>) -> u64 {
    bone.as_slice()
        .par_chunks(1 << 16)
        .map(|c| c.iter().map(|&v| u64::from(v)).sum::<u64>())
        .sum()
}

pub(super) fn nothing_selected(lower: Option<f64>, upper: Option<f64>, grey: &Grey) -> Error {
    let side = |v: Option<f64>| v.map_or("…".into(), |v| v.to_string());
    Error::specimen(
        format!(
            "no voxel lies between {} and {}: the scan's grey values run from {} to {}",
            side(lower),
            side(upper),
            grey.min,
            grey.max
        ),
        match (grey.min, grey.max) {
            (0.0, 1.0) => {
                "values of 0 and 1 are a mask: give --labels 1 (in a recipe labels = [1] and no lower, upper)"
            }
            _ => "choose a window inside that range (image's own units), or --otsu",
        },
    )
}

/// 1 where the value is one of the labels.
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

/// The scan's values where there is bone, 0 elsewhere.
pub(super) fn of_bone(scan: &Volume<f32>, bone: &Volume<u8>) -> Volume<f32> {
    let voxels = scan.as_slice().par_iter().zip(bone.as_slice());
    let values = voxels
        .map(|(&v, &b)| if b == 0 { 0.0 } else { v })
        .collect();
    let mut grey = Volume::from_vec(scan.grid, values);
    grey.affine = scan.affine;
    grey
}
