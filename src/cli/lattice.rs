//! `lattice`: sites and bonds over the bone.

use super::print_json;
use super::settings::{LatticeSettings, TissueSettings};
use bonepd_ct::command::Outcome;
use bonepd_ct::command::lattice::{Export, Exports};
use bonepd_ct::error::Result;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::lattice::LatticeParams;
use clap::Args;
use std::path::PathBuf;

/// Lay lattices over a segmented scan: count sites and bonds, and export them
///
/// One lattice per structure, lattice parameter and boundary. The settings are kept in DIR/lattice.json, where `solve`
/// finds them. DIR/sites.png shows the coarsest firm and floppy lattice over the bone.
#[derive(Args)]
pub struct LatticeArgs {
    /// Folder of a segmented scan
    dir: PathBuf,
    #[command(flatten)]
    settings: LatticeSettings,
    /// Also write each lattice for another program: lammps (data file with pair bonds only, which fixes
    /// Poisson's ratio at 0.25, the default of `solve` is 0.3; and an input script that compresses it in increments), vtk
    /// (ParaView, OVITO)
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', value_parser = ["lammps", "vtk"])]
    export: Vec<String>,
    /// Maximum number of different bond stiffnesses in an exported model; more are rounded to the means of as many bins
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    bins: u16,
    #[command(flatten, next_help_heading = "Tissue of exported lattices (lammps)")]
    tissue: TissueSettings,
}

pub fn run(args: &LatticeArgs, session: &Session, json: bool) -> Result<Outcome> {
    let mut params = LatticeParams::default();
    args.settings.apply(&mut params)?;
    let mut exports = Exports {
        formats: args.export.iter().map(|word| export(word)).collect(),
        tissue: SolveParams::default(),
        bins: args.bins.into(),
    };
    args.tissue.apply(&mut exports.tissue)?;
    let lattices = bonepd_ct::command::lattice::lattice(&args.dir, &params, &exports, session)?;
    if json {
        print_json(&lattices);
    }
    Ok(Outcome::Done)
}

fn export(word: &str) -> Export {
    match word {
        "lammps" => Export::Lammps,
        _ => Export::Vtk,
    }
}
