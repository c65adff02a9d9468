//! `scene`: two-dimensional pair-potential scenes.

use super::print_json;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use clap::Args;
use std::path::PathBuf;

/// Run a two-dimensional pair-potential scene: remodelling, anisotropic elasticity, fracture, conduction
#[derive(Args)]
pub struct SceneArgs {
    /// Scene file (TOML); `pipelines/` has examples
    scene: PathBuf,
    /// Folder for the results
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
}

pub fn run(args: &SceneArgs, session: &Session, json: bool) -> Result<Outcome> {
    let (outcome, record) = bonepd_ct::command::scene::scene(&args.scene, &args.out, session)?;
    if let Some(record) = record.filter(|_| json) {
        print_json(&record);
    }
    Ok(outcome)
}
