//! `lattice`: sites and bonds over the bone.

use super::solve::TissueSettings;
use super::{print_json, words};
use bonepd_ct::command::Outcome;
use bonepd_ct::command::lattice::{Export, Exports};
use bonepd_ct::command::session::Session;
use bonepd_ct::error::Result;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::lattice::{Boundary, LatticeParams, Structure};
use clap::Args;
use std::path::PathBuf;

/// Lay lattices over a segmented scan: count sites and bonds, and export them
///
/// One lattice per structure, lattice parameter and boundary. The settings are kept in DIR/lattice.json, where `solve`
/// finds them.
#[derive(Args)]
pub struct LatticeArgs {
    /// Folder of a segmented scan
    dir: PathBuf,
    #[command(flatten)]
    settings: LatticeSettings,
    /// Also write each lattice for another program: lammps (data file; bonds alone, so always of Poisson's ratio 0.25, where
    /// `solve` takes 0.3 unless told otherwise), vtk (ParaView, OVITO)
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', value_parser = ["lammps", "vtk"])]
    export: Vec<String>,
    /// Of an exported model: different stiffnesses of bonds at most; more are rounded to the means of as many bins
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..))]
    bins: u16,
    #[command(flatten, next_help_heading = "Tissue of exported lattices (lammps)")]
    tissue: TissueSettings,
}

#[derive(Args)]
#[command(next_help_heading = "Lattice")]
pub struct LatticeSettings {
    /// Lattice structures, comma-separated [default: sc]
    #[arg(long, value_delimiter = ',', value_parser = words::choice::<Structure>(&["sc", "bcc", "fcc"]))]
    structure: Vec<Structure>,
    /// Lattice parameters in mm, comma-separated [default: 0.06,0.08,0.10,0.12]
    #[arg(long, value_name = "MM", value_delimiter = ',', value_parser = words::positive)]
    lp: Vec<f64>,
    /// How the lattice meets the bone's surface, comma-separated [default: firm,floppy]
    #[arg(long, value_delimiter = ',', value_parser = words::choice::<Boundary>(&["firm", "floppy", "graded"]))]
    boundary: Vec<Boundary>,
    /// Shift the lattice by this many mm along x, y, z
    #[arg(long, value_name = "X,Y,Z", value_parser = words::triple, allow_hyphen_values = true)]
    registration: Option<[f64; 3]>,
}

impl LatticeSettings {
    /// What was said here wins over `params`.
    pub fn apply(&self, params: &mut LatticeParams) -> Result<()> {
        if !self.structure.is_empty() {
            params.structure = self.structure.clone();
        }
        if !self.lp.is_empty() {
            params.lp_mm = self.lp.clone();
        }
        if !self.boundary.is_empty() {
            params.boundary = self.boundary.clone();
        }
        params.registration_mm = self.registration.unwrap_or(params.registration_mm);
        params.check()
    }
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
