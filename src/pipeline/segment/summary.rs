//! Owns the results of segmentation as plain numbers, and what they warn of.

use super::Rotation;
use crate::error::{Error, Result};
use crate::mask::unmeasured::Hidden;
use crate::measure::morphometry::Morphometry;
use serde::{Deserialize, Serialize};

/// What segmentation found, as plain numbers; the results part of `segment.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SegmentSummary {
    /// Of the mask, along x, y, z.
    pub voxels: [usize; 3],
    /// Edges of its voxels along x, y, z.
    pub spacing_mm: [f64; 3],
    /// The window in use, in the image's units; Otsu's threshold is a lower bound.
    pub lower: Option<f64>,
    /// None where there is none.
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
    /// The upper end of that range.
    pub grey_max: f64,
    /// NaN and infinite voxels; they are pore.
    pub non_finite_voxels: u64,
    /// Voxels in the window, before the volume of interest and connectivity.
    pub selected_voxels: u64,
    /// Voxels in the window that lie outside the volume of interest.
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
    /// How the scan was rotated; None where it was not.
    #[serde(default)]
    pub rotation: Option<Rotation>,
    /// What TV is, in words: box, cylinder, mask.
    pub tv_definition: String,
    /// Volume of interest, pores included.
    pub tv_mm3: f64,
    /// Bone volume.
    pub bv_mm3: f64,
    /// Bone volume over TV, 0 to 1.
    pub bv_tv: f64,
    /// 2 BV / BS, see `measure::thickness`.
    pub mean_thickness_mm: Option<f64>,
    /// On request only.
    #[serde(default)]
    pub morphometry: Option<Morphometry>,
    /// How the threshold was chosen, where that is not plain.
    #[serde(default)]
    pub notes: Vec<String>,
    /// What may be wrong with the scan or its settings.
    pub warnings: Vec<String>,
}

impl SegmentSummary {
    /// Says what became of voxels that the file marks as no measurement. `is_asked_for`: the window or the labels hold some
    /// of their values.
    pub(super) fn say_hidden(&mut self, hidden: &Hidden, is_asked_for: bool) {
        let words = format!(
            "{:.1} % of the voxels hold {}, which the file marks as padding (no measurement)",
            100.0 * hidden.share(),
            hidden.values()
        );
        match is_asked_for {
            false => self.notes.push(format!(
                "{words}: taken as pore, and left out of Otsu's threshold"
            )),
            true => self.warnings.push(format!(
                "{words}: taken as pore, though the window or the labels take such values"
            )),
        }
    }
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
                "struts are {voxels:.2} voxels thick on average (2 BV/BS = {t:.3} mm); under 3 voxels moduli are unreliable"
            ));
        }
    }
    if 10 * s.removed_voxels > s.removed_voxels + s.bone_voxels {
        found.push(format!(
            "{} voxels in {} smaller components were removed, {:.0} % of what was selected: check the threshold",
            s.removed_voxels,
            s.components - 1,
            100.0 * s.removed_voxels as f64 / (s.removed_voxels + s.bone_voxels) as f64
        ));
    }
    found.extend(implausible_bv_tv(s));
    found.extend(implausible_voxels(s.spacing_mm));
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

/// BV/TV of trabecular bone lies between about 5 and 50 %.
fn implausible_bv_tv(s: &SegmentSummary) -> Option<String> {
    let slip = match s.threshold.as_str() {
        "labels" => "check the labels and the volume of interest",
        _ => "check the threshold and its unit (bonepd-ct info), and the volume of interest",
    };
    let percent = 100.0 * s.bv_tv;
    match s.bv_tv {
        v if v > 0.95 => Some(format!(
            "BV/TV is {v:.3}: nearly everything was selected; {slip}"
        )),
        v if v > 0.7 => Some(format!(
            "BV/TV is {percent:.0} %, more than trabecular bone has (2 to 70 %): {slip}"
        )),
        v if v < 0.02 => Some(format!(
            "BV/TV is {percent:.2} %, less than trabecular bone has (2 to 70 %): {slip}"
        )),
        _ => None,
    }
}

/// Edges of voxels that a scan of trabecular bone may have.
const VOXEL_MM: [f64; 2] = [0.001, 0.5];
/// A voxel longer than this times its width is no cube by far.
const LONG: f64 = 3.0;

/// Warns of voxel sizes that no scan of trabecular bone has, with the likely slip.
pub fn implausible_voxels(spacing_mm: [f64; 3]) -> Vec<String> {
    let [low, high] = VOXEL_MM;
    let mut found = Vec::new();
    if let Some(edge) = spacing_mm.into_iter().find(|h| !(low..=high).contains(h)) {
        // A slip of the unit is one of all axes.
        let all = spacing_mm.into_iter().all(|h| !(low..=high).contains(&h));
        let meant = likely(edge).filter(|_| all);
        let slip = meant.map_or(".".into(), |mm| format!(": {mm} mm instead of {edge}?"));
        found.push(format!(
            "voxels of {edge} mm are outside {low} to {high} mm{slip} Give --spacing if the file is wrong"
        ));
    }
    let [least, largest] =
        [f64::min, f64::max].map(|f| spacing_mm.into_iter().reduce(f).unwrap_or(1.0));
    if largest > LONG * least {
        let [x, y, z] = spacing_mm;
        found.push(format!(
            "voxels of {x} × {y} × {z} mm are {:.1} times as long as wide: check the distance of the slices (--spacing). Struts are not resolved along the long edge, and solves take long; --resample makes cubes",
            largest / least
        ));
    }
    found
}

/// The size that was likely meant: of micrometres or metres written as millimetres.
fn likely(edge_mm: f64) -> Option<f64> {
    let [low, high] = VOXEL_MM;
    let rounded = |mm: f64| (mm * 1e9).round() / 1e9;
    [1e-3, 1e3, 1e6]
        .map(|factor| rounded(edge_mm * factor))
        .into_iter()
        .find(|mm| (low..=high).contains(mm))
}

/// Refuses voxels whose volumes are beyond any scan's by more than a thousand times.
///
/// # Errors
/// With the size that was likely meant.
pub fn refuse_impossible_voxels(spacing_mm: [f64; 3]) -> Result<()> {
    let volume: f64 = spacing_mm.iter().product();
    let [low, high] = VOXEL_MM.map(|h: f64| h.powi(3));
    if volume < 1000.0 * high && volume > low / 1000.0 {
        return Ok(());
    }
    let meant = spacing_mm.map(likely);
    let slip = match meant {
        [Some(x), Some(y), Some(z)] if x == y && y == z => {
            format!("{x} mm instead of {}? ", spacing_mm[0])
        }
        [Some(x), Some(y), Some(z)] => format!("{x} × {y} × {z} mm? "),
        _ => String::new(),
    };
    Err(Error::setting(
        "spacing",
        format!(
            "voxels of {} × {} × {} mm do not fit a scan of trabecular bone (0.001 to 0.5 mm): volumes would be wrong by more than a thousand times. {slip}",
            spacing_mm[0], spacing_mm[1], spacing_mm[2]
        ),
        "give the size in millimetres with --spacing (for example --spacing 0.0195)",
    ))
}
