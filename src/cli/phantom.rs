//! `phantom`: a synthetic scan.

use super::words;
use bonepd_ct::error::Result;
use bonepd_ct::run::Outcome;
use bonepd_ct::run::phantom::PhantomParams;
use bonepd_ct::run::session::Session;
use clap::Args;
use std::path::PathBuf;

/// Make a synthetic trabecular scan, the same for the same seed
#[derive(Args)]
pub struct PhantomArgs {
    /// The image to write (.nii.gz), or a folder for TIFF slices
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
    /// Edge lengths in mm, one number or one per axis
    #[arg(long, value_name = "X[,Y,Z]", value_parser = words::sizes)]
    size_mm: [f64; 3],
    /// Voxel size in mm
    #[arg(long, value_name = "H", value_parser = words::positive)]
    spacing_mm: f64,
    /// Bone volume over total volume, between 0 and 1
    #[arg(long, value_name = "F", value_parser = words::positive)]
    bvtv: f64,
    /// Another seed, another specimen
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

pub fn run(args: &PhantomArgs, session: &Session) -> Result<Outcome> {
    let params = PhantomParams {
        size_mm: args.size_mm,
        spacing_mm: args.spacing_mm,
        bvtv: args.bvtv,
        seed: args.seed,
    };
    bonepd_ct::run::phantom::phantom(&args.out, &params, session)?;
    Ok(Outcome::Done)
}
