//! `man`: the manual page, from the words of `--help`.

use super::Cli;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::{Error, Result};
use clap::{Args, CommandFactory};
use std::path::PathBuf;

/// Write the manual pages, one for the program and one for each command
///
/// For example: bonepd-ct man ~/.local/share/man/man1; then `man bonepd-ct-solve`.
#[derive(Args)]
pub struct ManArgs {
    /// Folder to write them into; it is made if it does not exist
    #[arg(value_name = "FOLDER")]
    folder: PathBuf,
}

pub fn run(args: &ManArgs) -> Result<Outcome> {
    let written = std::fs::create_dir_all(&args.folder)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), &args.folder));
    written.map(|()| Outcome::Done).map_err(|e| {
        Error::file(
            &args.folder,
            format!("expected a folder to write manual pages into: {e}"),
            "name a folder that you may write to",
        )
        .caused_by(e)
    })
}
