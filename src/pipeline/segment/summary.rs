//! Owns the results of segmentation as plain numbers, and what they warn of.

use super::Rotation;
use crate::measure::morphometry::Morphometry;
use serde::{Deserialize, Serialize};

/// What segmentation found, as plain numbers; the results part of `segment.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SegmentSummary {
    pub voxels: [usize; 3],
    pub spacing_mm: [f64; 3],
    /// The window in use, in the image's units; Otsu's threshold is a lower bound.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    /// `window`, `otsu` or `labels`.
    pub threshold: String,
    /// What is known of the surface within a voxel.
    #[serde(default)]
    pub surface: Surface,
    /// σ in voxels of all blur of the grey values, smoothing included: as given, or read off the edges.
    #[serde(default)]
    pub blur_voxels: Option<f64>,
    /// Range of the finite grey values before smoothing.
    pub grey_min: f64,
    pub grey_max: f64,
    /// NaN and infinite voxels; they are pore.
    pub non_finite_voxels: u64,
    /// Voxels in the window, before the volume of interest and connectivity.
    pub selected_voxels: u64,
    pub outside_voi_voxels: u64,
    /// 6-connected components inside the volume of interest.
    pub components: u64,
    /// Voxels of all but the largest component; 0 with `keep_all`.
    pub removed_voxels: u64,
    /// In the end, after a plane cut.
    pub bone_voxels: u64,
    /// What a plane cut took off the lower and the upper end.
    #[serde(default)]
    pub plane_cut_mm: Option<[f64; 2]>,
    #[serde(default)]
    pub rotation: Option<Rotation>,
    pub tv_definition: String,
    pub tv_mm3: f64,
    pub bv_mm3: f64,
    pub bv_tv: f64,
    /// 2 BV / BS, see `measure::thickness`.
    pub mean_thickness_mm: Option<f64>,
    /// On request only.
    #[serde(default)]
    pub morphometry: Option<Morphometry>,
    pub warnings: Vec<String>,
}

/// What a scan says of the bone's surface within a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Surface {
    /// Grey values say where it lies.
    Grey,
    /// A mask or labels: it is a guess.
    #[default]
    Mask,
}

/// Two mean intercept lengths nearer than this could as well be the other way round.
const CLEAR_RATIO: f64 = 1.05;

pub(super) fn warnings(s: &SegmentSummary) -> Vec<String> {
    let mut found = Vec::new();
    if s.non_finite_voxels > 0 {
        found.push(format!(
            "{} voxels are NaN or infinite: taken as pore",
            s.non_finite_voxels
        ));
    }
    if let Some(t) = s.mean_thickness_mm {
        let voxels = t / s.spacing_mm.iter().copied().fold(0.0, f64::max);
        if voxels < 3.0 {
            found.push(format!(
                "struts are {voxels:.1} voxels thick on average (2 BV/BS = {t:.3} mm); under 3 voxels moduli are unreliable"
            ));
        }
    }
    if s.removed_voxels > s.bone_voxels / 10 {
        found.push(format!(
            "{} voxels in {} smaller components were removed, {:.0} % of what was selected: check the threshold",
            s.removed_voxels,
            s.components - 1,
            100.0 * s.removed_voxels as f64 / (s.removed_voxels + s.bone_voxels) as f64
        ));
    }
    if s.bv_tv > 0.95 {
        found.push(format!(
            "BV/TV is {:.3}: nearly everything was selected",
            s.bv_tv
        ));
    }
    if s.rotation
        .and_then(|r| r.mil_ratio)
        .is_some_and(|ratio| ratio < CLEAR_RATIO)
    {
        found.push(format!(
            "the fabric has no clear main direction: its two longest mean intercept lengths differ by less than {:.0} %",
            100.0 * (CLEAR_RATIO - 1.0)
        ));
    }
    if let Some([low, high]) = s.plane_cut_mm {
        let length = s.voxels[2] as f64 * s.spacing_mm[2];
        if low + high > 0.2 * (low + high + length) {
            found.push(format!(
                "the plane cut took {:.0} % of the length: check it against the picture",
                100.0 * (low + high) / (low + high + length)
            ));
        }
    }
    found
}
