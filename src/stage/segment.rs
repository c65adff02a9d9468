//! Owns segmentation: crop, smooth, threshold, volume of interest, connectivity, in that order.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The volume of interest: which part of the scan is specimen, pores included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Voi {
    #[default]
    Box,
    /// A cylinder along z. None: the largest that fits, centred.
    Cylinder {
        #[serde(default)]
        diameter_mm: Option<f64>,
        #[serde(default)]
        center_mm: Option<[f64; 2]>,
    },
    /// A mask image on the scan's grid; non-zero is inside.
    Mask(PathBuf),
}

/// Settings of `segment`. A voxel is bone when `lower <= value <= upper`, in the image's own units, after smoothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct SegmentParams {
    /// Overrides the file's voxel size.
    pub spacing_mm: Option<[f64; 3]>,
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    /// Otsu's threshold instead of a window.
    pub otsu: bool,
    /// σ of a Gaussian in voxels; 0 is off.
    pub gaussian_voxels: f64,
    pub voi: Voi,
    /// First and past-the-last voxel along x, y, z.
    pub crop: Option<[[usize; 2]; 3]>,
    /// Keep every voxel, not only the largest 6-connected component.
    pub keep_all: bool,
}
