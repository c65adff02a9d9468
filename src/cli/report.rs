//! `report`: tables and figures from solved scans.

use super::print_json;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use clap::Args;
use std::path::PathBuf;

/// Turn the results of any number of solved scans into tables, figures and pages
#[derive(Args)]
pub struct ReportArgs {
    /// Folders of solved scans, or the output folder of a run
    #[arg(required = true, value_name = "DIR")]
    dirs: Vec<PathBuf>,
    /// Folder for the report
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
}

pub fn run(args: &ReportArgs, session: &Session, json: bool) -> Result<Outcome> {
    let written = bonepd_ct::command::report::report(&args.dirs, &args.out, session)?;
    if json {
        print_json(&written);
    }
    Ok(Outcome::Done)
}
