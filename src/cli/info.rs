//! `info`: what is known of a scan.

use super::print_json;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::image::array::headerless::Contents;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;

/// Print what is known of a scan: size, voxel size, values, calibration, orientation, suggested threshold
#[derive(Args)]
pub struct InfoArgs {
    /// The scan: a file or a folder of slices
    file: PathBuf,
    /// What is in a file of voxels without a header (.raw, .vol), as 512,512,300,uint16; add `be` for big-endian numbers
    /// (uint16be), and the bytes before the first voxel (512,512,300,uint16,1024)
    #[arg(long, value_name = "NX,NY,NZ,TYPE[,SKIP]")]
    raw: Option<Contents>,
}

pub fn run(args: &InfoArgs, json: bool) -> Result<Outcome> {
    let info = bonepd_ct::command::info::info_of(&args.file, args.raw)?;
    if json {
        print_json(&info);
    } else {
        let mut out = std::io::stdout().lock();
        for line in &info.lines {
            // A closed pipe is the reader's choice, not an error.
            let _ = writeln!(out, "{line}");
        }
    }
    Ok(Outcome::Done)
}
