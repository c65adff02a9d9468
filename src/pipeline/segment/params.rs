//! Owns the settings of segmentation, and which of them contradict each other.

use crate::error::{Error, Result};
use crate::format::calibration::GreyUnit;
use crate::grid::Axis;
use crate::image::array::headerless::Contents;
use serde::{Deserialize, Serialize, Serializer};
use std::path::{Path, PathBuf};

/// The volume of interest: which part of the scan is specimen, pores included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Voi {
    /// The whole scan.
    #[default]
    Box,
    /// A cylinder along z. None: the largest that fits, centred.
    Cylinder {
        /// None: the largest that fits.
        #[serde(default)]
        diameter_mm: Option<f64>,
        /// x and y from the corner of the whole scan. None: the middle of the crop.
        #[serde(default)]
        center_mm: Option<[f64; 2]>,
    },
    /// A mask image on the scan's grid; non-zero is inside.
    Mask(#[serde(serialize_with = "shown")] PathBuf),
}

/// A direction that is rotated to z, the load axis, by the shortest way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// That of the longest mean intercept lengths of the bone.
    Fabric,
    /// x, y, z of the scan after `turn`; of any length but 0.
    Direction([f64; 3]),
}

/// What becomes of the box of a scan that is rotated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum AlignBox {
    /// A box that lies wholly in the old one: bone that fills its scan.
    #[default]
    Inside,
    /// The box around it, with pore where there was no scan: an excised core in air.
    Whole,
}

/// Settings of `segment`. A voxel is bone when `lower <= value <= upper`, in the image's own units, after smoothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct SegmentParams {
    /// Overrides the file's voxel size.
    pub spacing_mm: Option<[f64; 3]>,
    /// What is in a file of voxels without a header (`.raw`, `.vol`).
    pub raw: Option<Contents>,
    /// Of a Scanco scan's grey values, and so of the window. None: as stored, with a warning where a window is given.
    pub units: Option<GreyUnit>,
    /// Lower end of the window. None: open.
    pub lower: Option<f64>,
    /// Upper end of the window. None: open.
    pub upper: Option<f64>,
    /// Otsu's threshold instead of a window.
    pub otsu: bool,
    /// Of a labelled scan: the values that are bone, instead of a window.
    pub labels: Vec<i32>,
    /// σ of a Gaussian in voxels (of the resampled scan); 0 is off.
    pub gaussian_voxels: f64,
    /// Which part of the scan is specimen.
    pub voi: Voi,
    /// First and past-the-last voxel along x, y, z.
    pub crop: Option<[[usize; 2]; 3]>,
    /// The scan's axis that becomes z, the load axis; the others follow in turn. After the crop.
    pub turn: Axis,
    /// Voxel size along x, y, z that the scan is brought to, after `turn`.
    pub resample_mm: Option<[f64; 3]>,
    /// What is rotated to z; voxels become cubes of their shortest edge.
    pub align: Option<Align>,
    /// What becomes of the box then.
    pub align_box: AlignBox,
    /// Cut both ends (along z) to planes with bone in every tile of this edge that holds any.
    pub plane_cut_mm: Option<f64>,
    /// Keep every voxel, not only the largest 6-connected component.
    pub keep_all: bool,
    /// Kept for old recipes: values are kept anyway.
    pub keep_grey: bool,
    /// Keep no grey values.
    pub no_grey: bool,
    /// σ of the scanner's blur in voxels, where it is known; without the smoothing.
    pub blur_voxels: Option<f64>,
    /// Also measure Tb.Th, Tb.Sp, Conn.D and DA of the mask.
    pub morphometry: bool,
}

/// Writes a path as text; what of it is no text is replaced.
pub fn shown<S: Serializer>(path: &Path, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.serialize_str(&path.to_string_lossy())
}

/// Integers from here on are rounded: values are kept in single precision.
pub(super) const MOST_LABEL: i32 = 1 << 24;

/// Wider smoothing than this removes any trabecula.
const MAX_SIGMA: f64 = 20.0;

impl SegmentParams {
    /// How bone is found, in a word.
    pub fn threshold(&self) -> &'static str {
        match self.labels.is_empty() {
            false => "labels",
            true if self.otsu => "otsu",
            true => "window",
        }
    }

    /// Whether a window, in the image's own units, decides what bone is.
    pub fn has_window(&self) -> bool {
        !self.otsu && (self.lower.is_some() || self.upper.is_some())
    }

    /// Whether the window or the labels that were given hold a value of `range`.
    pub fn takes_any(&self, [low, high]: [f32; 2]) -> bool {
        let (low, high) = (f64::from(low), f64::from(high));
        let labelled = |label: &i32| (low..=high).contains(&f64::from(*label));
        let (lower, upper) = (self.lower, self.upper);
        self.labels.iter().any(labelled)
            || self.has_window()
                && lower.is_none_or(|lower| lower <= high)
                && upper.is_none_or(|upper| upper >= low)
    }

    /// Whether grey values are kept with the mask.
    pub fn keeps_grey(&self) -> bool {
        self.keep_grey || !self.no_grey
    }

    /// σ of the scanner's blur and of the smoothing together, where the scanner's is known.
    pub fn all_blur_voxels(&self) -> Option<f64> {
        self.blur_voxels
            .map(|blur| blur.hypot(self.gaussian_voxels))
    }

    /// Refuses settings that contradict each other or cannot be used on any scan.
    pub fn check(&self) -> Result<()> {
        let refuse =
            |key: &str, found: String, advice: &str| Err(Error::setting(key, found, advice));
        if self.otsu && (self.lower.is_some() || self.upper.is_some()) {
            return refuse(
                "segment.otsu",
                "Otsu's threshold and a window (lower, upper) exclude each other".to_owned(),
                "give one of them",
            );
        }
        let threshold = self.otsu || self.lower.is_some() || self.upper.is_some();
        if !self.labels.is_empty() && (threshold || self.gaussian_voxels > 0.0) {
            return refuse(
                "segment.labels",
                "labels of a segmented scan go with no threshold and no smoothing".to_owned(),
                "leave out lower, upper, otsu and gaussian, or the labels",
            );
        }
        if let Some(label) = self
            .labels
            .iter()
            .find(|l| l.unsigned_abs() >= MOST_LABEL as u32)
        {
            return refuse(
                "segment.labels",
                format!(
                    "label {label} cannot be distinguished from its neighbours: values are kept in single precision, which rounds integers from {MOST_LABEL} on"
                ),
                "renumber the labels with smaller numbers",
            );
        }
        if let (Some(lower), Some(upper)) = (self.lower, self.upper)
            && lower > upper
        {
            return refuse(
                "segment.lower",
                format!("lower {lower} lies above upper {upper}, so nothing is bone"),
                "swap them",
            );
        }
        if !(0.0..=MAX_SIGMA).contains(&self.gaussian_voxels) {
            return refuse(
                "segment.gaussian_voxels",
                format!(
                    "expected a width of 0 to {MAX_SIGMA} voxels, found {}",
                    self.gaussian_voxels
                ),
                "0 is off; 0.5 to 1.2 is usual",
            );
        }
        if self.keep_grey && self.no_grey {
            return refuse(
                "segment.no_grey",
                "keep_grey and no_grey exclude each other".to_owned(),
                "leave one of them out",
            );
        }
        if let Some(blur) = self.blur_voxels
            && !(0.0..=MAX_SIGMA).contains(&blur)
        {
            return refuse(
                "segment.blur_voxels",
                format!("expected a width of 0 to {MAX_SIGMA} voxels, found {blur}"),
                "give σ of the scanner's point spread in voxels, 0.5 to 1 is usual",
            );
        }
        if let Some(spacing) = self.spacing_mm
            && spacing.iter().any(|h| !(*h > 0.0 && h.is_finite()))
        {
            return refuse(
                "segment.spacing_mm",
                format!("expected voxel sizes in mm above 0, found {spacing:?}"),
                "give one number, or one per axis",
            );
        }
        if let Some(crop) = self.crop
            && let Some([first, end]) = crop.iter().find(|[first, end]| first >= end)
        {
            return refuse(
                "segment.crop",
                format!("expected first < end, found {first}:{end}"),
                "the end is not included: 0:100 keeps 100 voxels",
            );
        }
        self.check_place()
    }

    fn check_place(&self) -> Result<()> {
        let refuse = |key: &str, found: String, advice: &str| {
            Err(Error::setting(format!("segment.{key}"), found, advice))
        };
        let length = |v: &f64| *v > 0.0 && v.is_finite();
        if let Some(sizes) = self.resample_mm
            && !sizes.iter().all(length)
        {
            let found = format!("expected voxel sizes in mm above 0, found {sizes:?}");
            return refuse("resample_mm", found, "give one number, or one per axis");
        }
        if let Some(Align::Direction(d)) = self.align {
            let squared: f64 = d.iter().map(|v| v * v).sum();
            if !length(&squared) {
                let found = format!("expected a direction X,Y,Z, found {d:?}");
                return refuse("align", found, "0,0,1 changes nothing; or say fabric");
            }
        }
        if let Some(edge) = self.plane_cut_mm
            && !length(&edge)
        {
            let found = format!("expected the edge of a tile in mm above 0, found {edge}");
            return refuse("plane_cut_mm", found, "1 is wider than most pores are");
        }
        Ok(())
    }
}
