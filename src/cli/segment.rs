//! `segment`: which voxels are bone.

use super::settings::overrides::lay_over;
use super::{print_json, words};
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::format::calibration::GreyUnit;
use bonepd_ct::grid::Axis;
use bonepd_ct::image::array::headerless::Contents;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::segment::{Align, AlignBox, SegmentParams, Voi};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Find the bone in a scan: crop, turn, smooth, threshold, volume of interest, largest connected piece
///
/// Writes DIR/mask.nii.gz (1 where bone), DIR/segment.json (what is needed to repeat it, BV, TV, BV/TV),
/// DIR/segment.png (mid-slices with the mask's outline), DIR/bone.png (the bone in three dimensions) and DIR/view.html (to turn
/// it in a browser).
#[derive(Args)]
pub struct SegmentArgs {
    /// The scan: a file (.nii, .nii.gz, .tif, ...) or a folder of slices
    input: PathBuf,
    /// Folder for the results
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    settings: SegmentSettings,
}

/// The fields are the keys of `[segment]`.
#[derive(Args, Serialize)]
#[command(next_help_heading = "Segmentation")]
pub struct SegmentSettings {
    /// Voxel size in mm, one number or one per axis; overrides the file's. The axes x, y, z are those that `info`
    /// prints: patient or world axes where the file gives its orientation, else the stored ones
    #[arg(long = "spacing", value_name = "MM[,MM,MM]", value_parser = words::sizes)]
    spacing_mm: Option<[f64; 3]>,
    /// What is in a file of voxels without a header (.raw, .vol), as 512,512,300,uint16; add `be` for big-endian numbers
    /// (uint16be), and the bytes before the first voxel (512,512,300,uint16,1024)
    #[arg(long, value_name = "NX,NY,NZ,TYPE[,SKIP]")]
    raw: Option<Contents>,
    /// Unit of the grey values of Scanco files (AIM, ISQ), and so of the threshold: as stored (native), hu, or mgha (mg HA/cm³).
    /// hu fails if the file has no calibration; hu-where-known then keeps stored values [default: native, with a warning]
    #[arg(long, value_name = "UNIT", value_parser = words::choice::<GreyUnit>(&["native", "hu", "mgha", "hu-where-known"]))]
    units: Option<GreyUnit>,
    /// Lower threshold (inclusive), in grey values of the image, applied after smoothing
    #[arg(long, value_name = "V", value_parser = words::number, allow_negative_numbers = true)]
    lower: Option<f64>,
    /// Upper threshold (inclusive)
    #[arg(long, value_name = "V", value_parser = words::number, allow_negative_numbers = true)]
    upper: Option<f64>,
    /// Otsu's threshold instead of a window
    #[arg(long, conflicts_with_all = ["lower", "upper"])]
    otsu: bool,
    /// Values that are bone in a labelled scan, comma-separated (100,127); instead of a threshold
    #[arg(long, value_name = "VALUES", value_delimiter = ',', conflicts_with_all = ["lower", "upper", "otsu", "gaussian_voxels"])]
    labels: Vec<i32>,
    /// Smooth with a Gaussian of this σ in voxels before the threshold [default: off]
    #[arg(long = "gaussian", value_name = "VOXELS", value_parser = words::number)]
    gaussian_voxels: Option<f64>,
    /// Volume of interest: box, cylinder (the largest that fits), cylinder:D or cylinder:D,X,Y in mm, or a mask file
    /// on the scan's grid [default: box]
    // A mask's path need not be text, so it is no plain copy.
    #[arg(long, value_name = "VOI", value_parser = words::voi())]
    #[serde(skip)]
    voi: Option<Voi>,
    /// Keep voxels first:end along each axis (x, y, z as `info` prints them); the end is not included
    #[arg(long, value_name = "X0:X1,Y0:Y1,Z0:Z1", value_parser = words::crop)]
    crop: Option<[[usize; 2]; 3]>,
    /// Turn the scan so that this axis of it becomes z, the load axis; the other two follow [default: z]
    #[arg(long, value_name = "AXIS", value_parser = words::choice::<Axis>(&["x", "y", "z"]))]
    turn: Option<Axis>,
    /// Bring the scan to this voxel size in mm, one number or one per axis (after the turn)
    #[arg(long = "resample", value_name = "MM[,MM,MM]", value_parser = words::sizes)]
    resample_mm: Option<[f64; 3]>,
    /// Rotate the scan until this points along z: fabric (the longest mean intercept lengths), or X,Y,Z
    #[arg(long, value_name = "fabric|X,Y,Z", value_parser = words::align, allow_negative_numbers = true)]
    align: Option<Align>,
    /// Box of a rotated scan: inside (it lies within the old box), or whole (all of the scan, with pore around it)
    /// [default: inside]
    #[arg(long, value_name = "BOX", value_parser = words::choice::<AlignBox>(&["inside", "whole"]))]
    align_box: Option<AlignBox>,
    /// Cut uneven ends flat: each end is cut back until every tile of this width (mm) that contains bone reaches the plane
    #[arg(long = "plane-cut", value_name = "MM", value_parser = words::positive)]
    plane_cut_mm: Option<f64>,
    /// Keep every voxel, not only the largest connected piece
    #[arg(long)]
    keep_all: bool,
    /// Kept for old scripts: grey values are kept anyway
    #[arg(long, hide = true)]
    keep_grey: bool,
    /// Do not keep DIR/grey.nii.gz, the smoothed values of the scan, which `solve --refine`, `--error` and `--material` read
    #[arg(long, conflicts_with = "keep_grey")]
    no_grey: bool,
    /// Standard deviation of the scanner's blur in voxels, where it is known, without the smoothing: stated errors use it
    #[arg(long, value_name = "VOXELS", value_parser = words::number)]
    blur_voxels: Option<f64>,
    /// Also measure Tb.Th and Tb.Sp (sphere fitting), Conn.D, and DA by mean intercept lengths; takes longer
    #[arg(long)]
    morphometry: bool,
}

impl SegmentSettings {
    /// Options that were given override `params`. A threshold or labels replace what `params` find bone by.
    pub fn apply(&self, params: &mut SegmentParams) -> Result<()> {
        let window = self.lower.is_some() || self.upper.is_some();
        let labels = !self.labels.is_empty();
        if self.otsu || labels {
            (params.lower, params.upper) = (None, None);
        }
        if window || labels {
            params.otsu = false;
        }
        if window || self.otsu {
            params.labels.clear();
        }
        if labels {
            params.gaussian_voxels = 0.0;
        }
        lay_over(params, self)?;
        if let Some(voi) = &self.voi {
            params.voi = voi.clone();
        }
        params.check()
    }
}

pub fn run(args: &SegmentArgs, session: &Session, json: bool) -> Result<Outcome> {
    let mut params = SegmentParams::default();
    args.settings.apply(&mut params)?;
    bonepd_ct::cohort::scans::refuse_many(&args.input)?;
    let summary =
        bonepd_ct::command::segment::segment(&args.input, &args.out, None, &params, session)?;
    if json {
        print_json(&summary);
    }
    Ok(Outcome::Done)
}
