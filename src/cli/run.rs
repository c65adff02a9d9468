//! `run`: a recipe on scans.

use super::lattice::LatticeSettings;
use super::segment::SegmentSettings;
use super::solve::SolveSettings;
use bonepd_ct::error::Result;
use bonepd_ct::recipe::Recipe;
use bonepd_ct::run::Outcome;
use bonepd_ct::run::session::Session;
use clap::Args;
use std::path::PathBuf;

/// Take scans through all steps of a recipe: segment, lattice, solve, report
///
/// Each scan stands alone: one that fails is named at the end (exit code 1) and the others finish. Results are in
/// OUT/<scan>/, all rows together in OUT/results.csv, tables and figures in OUT/report/. A setting given here wins over
/// the recipe's.
#[derive(Args)]
pub struct RunArgs {
    /// Recipe file (TOML); `pipelines/` has examples
    recipe: PathBuf,
    /// Scans, or folders of scans; a folder of slices is one scan
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
    #[command(flatten)]
    segment: SegmentSettings,
    #[command(flatten)]
    lattice: LatticeSettings,
    #[command(flatten)]
    solve: SolveSettings,
}

pub fn run(args: &RunArgs, session: &Session, _json: bool) -> Result<Outcome> {
    let mut recipe = Recipe::read(&args.recipe)?;
    args.segment.apply(&mut recipe.segment)?;
    args.lattice.apply(&mut recipe.lattice)?;
    args.solve.apply(&mut recipe.solve)?;
    bonepd_ct::run::cohort::cohort(&recipe, &args.inputs, &args.out, session)
}
