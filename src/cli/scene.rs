//! `scene`: two-dimensional pair-potential scenes.

use bonepd_ct::error::Result;
use bonepd_ct::run::Outcome;
use bonepd_ct::run::session::Session;
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

pub fn run(args: &SceneArgs, session: &Session) -> Result<Outcome> {
    bonepd_ct::run::scene::scene(&args.scene, &args.out, session)
}
