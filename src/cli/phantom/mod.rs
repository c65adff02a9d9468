//! `phantom`: a synthetic scan.

mod body;

use super::{print_json, words};
use body::BodyArgs;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::phantom::PhantomParams;
use clap::Args;
use std::path::PathBuf;

/// Make a synthetic trabecular scan with known truth, the same on every machine for the same settings
///
/// Perforated plates and rods of one thickness along the level set of a random field, in HU with blur, noise and floating
/// debris. Bone and background lie evenly about 200 HU: segment with --lower 200. The same seed at another voxel size is
/// the same specimen. --body makes an analytic body instead, seen by partial volumes: without blur and noise unless asked
/// for, never with debris.
#[derive(Args)]
pub struct PhantomArgs {
    /// The image to write (.nii.gz, .nii), or a folder for TIFF slices
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Also write the clean mask, without debris (.nii.gz)
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// Edge lengths in mm, one number or one per axis
    #[arg(long, value_name = "X[,Y,Z]", value_parser = words::sizes)]
    size_mm: [f64; 3],
    /// Voxel size in mm
    #[arg(long, value_name = "H", value_parser = words::positive)]
    spacing_mm: f64,
    /// Bone volume over total volume of the bone that one piece holds, between 0.02 and 0.7; what is printed counts all bone
    #[arg(long, value_name = "F", value_parser = words::positive)]
    bvtv: f64,
    /// Another seed, another specimen
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    shape: Shape,
    #[command(flatten)]
    body: BodyArgs,
    #[command(flatten)]
    image: Image,
}

#[derive(Args)]
#[command(next_help_heading = "Shape")]
struct Shape {
    /// Thickness of plates and rods [default: 0.15]
    #[arg(long, value_name = "MM", value_parser = words::positive, conflicts_with_all = ["separation_mm", "body"])]
    thickness_mm: Option<f64>,
    /// Mean width of the pores instead; the thickness follows
    #[arg(long, value_name = "MM", value_parser = words::positive, conflicts_with = "body")]
    separation_mm: Option<f64>,
    /// How much longer than wide the pores are along z; 1 is isotropic [default: 1.4]
    #[arg(long, value_name = "RATIO", value_parser = words::positive, conflicts_with = "body")]
    anisotropy: Option<f64>,
    /// Share of the plates cut away as holes; more makes rods [default: falls with BV/TV]
    #[arg(long, value_name = "F", value_parser = words::number, conflicts_with = "body")]
    perforation: Option<f64>,
    /// Leave the middle empty over this height, so that the faces are not connected [default: 0]
    #[arg(long, value_name = "MM", value_parser = words::positive, conflicts_with = "body")]
    gap_mm: Option<f64>,
}

#[derive(Args)]
#[command(next_help_heading = "Image")]
struct Image {
    /// Grey value of bone [default: 1400]
    #[arg(long, value_name = "HU", value_parser = words::number, allow_negative_numbers = true)]
    bone_hu: Option<f64>,
    /// Grey value around it [default: -1000]
    #[arg(long, value_name = "HU", value_parser = words::number, allow_negative_numbers = true)]
    background_hu: Option<f64>,
    /// Standard deviation of the noise [default: 120, of a body 0]
    #[arg(long, value_name = "HU", value_parser = words::number)]
    noise_hu: Option<f64>,
    /// σ of the blur in voxels [default: 0.7, of a body 0]
    #[arg(long, value_name = "VOXELS", value_parser = words::number)]
    blur: Option<f64>,
    /// Specks of bone per mm³ that float in the pores [default: 1]
    #[arg(long, value_name = "N", value_parser = words::number, conflicts_with = "body")]
    debris: Option<f64>,
}

impl PhantomArgs {
    // One literal, which the compiler holds complete. `lay_over` saves no line here: seeds (u64) are no integers of TOML, and five
    // options are no plain copies.
    fn params(&self) -> PhantomParams {
        let default = PhantomParams::default();
        let (shape, image) = (&self.shape, &self.image);
        let body = self.body.params(self.spacing_mm);
        // A body is seen as it is unless blur and noise are asked for.
        let seen = |field: f64| if body.is_some() { 0.0 } else { field };
        let mut params = PhantomParams {
            size_mm: self.size_mm,
            spacing_mm: self.spacing_mm,
            bvtv: self.bvtv,
            seed: self.seed,
            thickness_mm: shape.thickness_mm.unwrap_or(default.thickness_mm),
            anisotropy: shape.anisotropy.unwrap_or(default.anisotropy),
            perforation: shape.perforation,
            bone_hu: image.bone_hu.unwrap_or(default.bone_hu),
            background_hu: image.background_hu.unwrap_or(default.background_hu),
            noise_hu: image.noise_hu.unwrap_or(seen(default.noise_hu)),
            blur_voxels: image.blur.unwrap_or(seen(default.blur_voxels)),
            debris_per_mm3: image.debris.unwrap_or(seen(default.debris_per_mm3)),
            gap_mm: shape.gap_mm.unwrap_or(default.gap_mm),
            body,
        };
        if let Some(separation) = shape.separation_mm {
            params.thickness_mm = params.thickness_for_separation(separation);
        }
        params
    }
}

pub fn run(args: &PhantomArgs, session: &Session, json: bool) -> Result<Outcome> {
    let params = args.params();
    let mask = args.mask.as_deref();
    let summary = bonepd_ct::command::phantom::phantom(&args.out, mask, &params, session)?;
    if json {
        print_json(&summary);
    }
    Ok(Outcome::Done)
}
