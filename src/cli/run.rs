//! `run`: a recipe on scans.

use super::segment::SegmentSettings;
use super::settings::LatticeSettings;
use super::solve::SolveSettings;
use super::{print_json, words};
use bonepd_ct::cohort::scans::Selection;
use bonepd_ct::cohort::{Resources, cohort};
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use bonepd_ct::recipe::Recipe;
use clap::Args;
use glob::Pattern;
use std::path::PathBuf;

/// Take scans through all steps of a recipe: segment, lattice, solve, report
///
/// Each scan stands alone: one that fails is named at the end (exit code 1) and the others finish. Results are in
/// OUT/<scan>/ with a log, all rows together in OUT/results.csv, tables and figures in OUT/report/. Options here override
/// the recipe. A run that is started again keeps what is up to date and continues where it stopped.
#[derive(Args)]
pub struct RunArgs {
    /// Recipe file (TOML), or the name of a recipe in the program, as paper or hrpqct (`bonepd-ct recipe` lists them)
    recipe: PathBuf,
    /// Scans, folders of scans (a folder of slices is one scan), or manifests (.csv with a column path, and any of name,
    /// subject, group, spacing_mm, lower, upper, otsu, gaussian_voxels)
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// Folder for the results
    #[arg(short, long, value_name = "OUT")]
    out: PathBuf,
    /// Number of scans at a time
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    jobs: u16,
    /// Memory that scans running at a time may take together, by estimate [default: what is free]
    #[arg(long, value_name = "MIB", value_parser = words::positive)]
    memory_mib: Option<f64>,
    /// Look for scans in folders of folders; a scan is then named after the folders on the way
    #[arg(long)]
    recursive: bool,
    /// In folders, take only files and folders whose name matches, as "*_L3*.nii.gz"
    #[arg(long, value_name = "PATTERN", value_parser = Pattern::new)]
    pattern: Option<Pattern>,
    /// Run only the scan of this name: one job of many on a cluster
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Choose the resolution of each scan so that its stated error (solver, elements, shape) stays below this, as 3% or 0.03;
    /// exit 1 where it cannot be met
    #[arg(long, value_name = "ERROR", value_parser = words::fraction, conflicts_with_all = ["method", "refine", "refine_mask", "coarsen", "lp_mm", "boundary", "structure"])]
    error: Option<f64>,
    #[command(flatten)]
    segment: SegmentSettings,
    #[command(flatten)]
    lattice: LatticeSettings,
    #[command(flatten)]
    solve: SolveSettings,
}

pub fn run(args: &RunArgs, session: &Session, json: bool) -> Result<Outcome> {
    let mut recipe = Recipe::read(&args.recipe)?;
    recipe.error = args.error.or(recipe.error);
    args.segment.apply(&mut recipe.segment)?;
    args.lattice.apply(&mut recipe.lattice)?;
    args.solve
        .apply(&mut recipe.solve, recipe.error.is_some())?;
    if args.solve.names_load() {
        recipe.loads.clear();
    }
    recipe.check()?;
    let selection = Selection {
        recursive: args.recursive,
        pattern: args.pattern.clone(),
    };
    let resources = Resources {
        jobs: args.jobs.into(),
        memory_mib: args.memory_mib,
    };
    let (outcome, scans) = cohort(
        &recipe,
        &args.inputs,
        &args.out,
        &selection,
        args.only.as_deref(),
        &resources,
        session,
    )?;
    if json {
        print_json(&scans);
    }
    Ok(outcome)
}
