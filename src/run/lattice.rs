//! Owns `lattice` on disk: builds the lattices of a segmented scan, reports their counts, exports them.

use crate::error::{Error, Result};
use crate::grid::Axis;
use crate::io::{atomic, lammps, vtk};
use crate::run::segment::load;
use crate::run::session::Session;
use crate::stage::lattice::{
    Case, LatticeParams, LatticeSummary, build, build_pieces, summarise, summarise_pieces,
};
use crate::topology::pieces::Pieces;
use crate::topology::sites::Sites;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A format for other programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Export {
    Lammps,
    Vtk,
}

/// `lattice.json`: the settings `solve` finds there, and what they came to (nothing where `run` went straight on to the
/// solves).
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    version: String,
    settings: LatticeParams,
    lattices: Vec<LatticeSummary>,
}

const RECORD: &str = "lattice.json";

/// Builds every lattice asked for from the mask in `dir`, with the end planes along z gripped, writes `dir/lattice.json`
/// (settings and counts) and one file per lattice and export format.
pub fn lattice(
    dir: &Path,
    params: &LatticeParams,
    exports: &[Export],
    session: &Session,
) -> Result<Vec<LatticeSummary>> {
    params.check()?;
    let specimen = load(dir)?;
    if specimen.grey.is_some() && !exports.is_empty() {
        session.warn(
            "the folder keeps grey values, but exported lattices are of one tissue: laws of moduli are `solve`'s",
        );
    }
    let mut lattices = Vec::new();
    for case in params.cases() {
        let exports = if session.dry_run { &[] } else { exports };
        let summary = if case.in_pieces() {
            let pieces = build_pieces(&specimen, &case, Axis::Z, 0.0)?;
            export(dir, &case, exports, Err(&pieces))?;
            summarise_pieces(&specimen, &case, &pieces)
        } else {
            let sites = build(&specimen, &case, Axis::Z, 0.0)?;
            export(dir, &case, exports, Ok(&sites))?;
            summarise(&specimen, &case, &sites)
        };
        session.say(summary.in_words());
        lattices.push(summary);
    }
    if !session.dry_run {
        write(dir, params, lattices.clone())?;
    }
    Ok(lattices)
}

/// Writes `dir/lattice.json` for `solve` to find the settings there, without building a lattice: `solve` builds each
/// once, and its rows tell what it came to.
pub fn remember(dir: &Path, params: &LatticeParams) -> Result<()> {
    params.check()?;
    write(dir, params, Vec::new())
}

fn write(dir: &Path, params: &LatticeParams, lattices: Vec<LatticeSummary>) -> Result<()> {
    let record = Record {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        settings: params.clone(),
        lattices,
    };
    let text = serde_json::to_string_pretty(&record).expect("plain data");
    atomic::write(&dir.join(RECORD), text)
}

/// Writes sites, or the pieces of a graded lattice.
fn export(
    dir: &Path,
    case: &Case,
    exports: &[Export],
    lattice: std::result::Result<&Sites, &Pieces>,
) -> Result<()> {
    let name = format!(
        "lattice-{}-{}-{}",
        case.structure.name(),
        case.boundary.name(),
        case.lp_mm
    );
    for format in exports {
        match format {
            Export::Lammps => match lattice {
                Ok(sites) => lammps::write(&dir.join(format!("{name}.data")), sites)?,
                Err(_) => return Err(lammps::graded()),
            },
            Export::Vtk => {
                let path = dir.join(format!("{name}.vtk"));
                match lattice {
                    Ok(sites) => vtk::write_lattice(&path, sites)?,
                    Err(pieces) => vtk::write_pieces(&path, pieces)?,
                }
            }
        }
    }
    Ok(())
}

/// The settings that `lattice` left in `dir`; the defaults where it was not run.
///
/// # Errors
/// A `lattice.json` that cannot be read.
pub fn settings(dir: &Path) -> Result<LatticeParams> {
    let path = dir.join(RECORD);
    if !path.exists() {
        return Ok(LatticeParams::default());
    }
    let again = "run `bonepd-ct lattice` again, or delete the file";
    let text = std::fs::read(&path)
        .map_err(|e| Error::file(&path, format!("cannot be read: {e}"), again))?;
    let record: Record = serde_json::from_slice(&text)
        .map_err(|e| Error::file(&path, format!("not a lattice record: {e}"), again))?;
    Ok(record.settings)
}
