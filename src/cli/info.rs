//! `info`: what is known of a scan.

use super::print_json;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use clap::Args;
use std::path::PathBuf;

/// Print what is known of a scan: size, voxel size, values, calibration, orientation, what to threshold by
#[derive(Args)]
pub struct InfoArgs {
    /// The scan: a file or a folder of slices
    file: PathBuf,
}

pub fn run(args: &InfoArgs, json: bool) -> Result<Outcome> {
    let info = bonepd_ct::command::info::info(&args.file)?;
    if json {
        print_json(&info);
    } else {
        info.lines.iter().for_each(|line| println!("{line}"));
    }
    Ok(Outcome::Done)
}
