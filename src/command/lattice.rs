//! Owns `lattice` on disk: builds the lattices of a segmented scan, reports their counts, exports them.

mod picture;

use crate::command::estimate::refuse_lattice_that_does_not_fit;
use crate::discretisation::lattice::connected::ConnectedSites;
use crate::discretisation::lattice::sites::Sites;
use crate::error::{Error, Result};
use crate::export::{lammps, vtk};
use crate::grid::Axis;
use crate::io::atomic;
use crate::machine::session::Session;
use crate::physics::material::Solid;
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{SolveParams, of_lattice};
use crate::pipeline::lattice::{
    Boundary, Case, LatticeParams, LatticeSummary, build, build_connected, build_of, summarise,
    summarise_connected,
};
use crate::record::specimen;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A format for other programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Export {
    /// A LAMMPS data file (sites and bonds), and an input script with the published steps.
    Lammps,
    /// A VTK file: sites and bonds, for ParaView.
    Vtk,
}

/// What is written for other programs.
#[derive(Debug, Clone, PartialEq)]
pub struct Exports {
    /// One file a lattice and format; none where this is empty.
    pub formats: Vec<Export>,
    /// Young's modulus and, for LAMMPS, the law of moduli that differ.
    pub tissue: SolveParams,
    /// Different stiffnesses in one file at most.
    pub bins: usize,
}

/// `lattice.json`: the settings `solve` finds there, and their counts (nothing where `run` went straight on to the
/// solves).
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    version: String,
    settings: LatticeParams,
    lattices: Vec<LatticeSummary>,
}

const RECORD: &str = "lattice.json";

/// Builds every lattice of the settings from the mask in `dir`, with the end planes along z gripped, writes `dir/lattice.json`
/// (settings and counts) and one file per lattice and export format.
pub fn lattice(
    dir: &Path,
    params: &LatticeParams,
    exports: &Exports,
    session: &Session,
) -> Result<Vec<LatticeSummary>> {
    params.check()?;
    exports.tissue.check()?;
    let mut scan = specimen::load(dir)?;
    let factors = match exports.tissue.material {
        None => None,
        Some(_) => {
            scan.add_grey(dir)?;
            match Tissue::of(&scan.specimen, &exports.tissue)? {
                Tissue::Uniform(solid) => Some((solid.young_mpa, None)),
                Tissue::Mixed(mixed) => Some((mixed.mean_mpa, Some(mixed.factor))),
            }
        }
    };
    let specimen = scan.specimen;
    let (young_mpa, factors) = factors.unwrap_or((exports.tissue.young_mpa, None));
    let written = Written {
        dir,
        formats: if session.dry_run {
            &[]
        } else {
            &exports.formats
        },
        tissue: lammps::Tissue {
            young_mpa,
            bins: exports.bins,
        },
        specimen: lammps::script::Specimen {
            length_mm: specimen.length_mm(Axis::Z),
            area_mm2: specimen.area_mm2(Axis::Z),
            young_mpa,
        },
        session,
    };
    if factors.is_none() && dir.join(specimen::GREY).exists() && !exports.formats.is_empty() {
        session.warn(
            "the folder keeps grey values, but the exported lattices are of one tissue: give --material for moduli that follow them",
        );
    }
    if exports.formats.contains(&Export::Lammps) {
        session.warn(
            "LAMMPS data contain pair bonds only, which fixes Poisson's ratio at 0.25 whatever that of the tissue (0.3 by default): compare their results with `solve --poisson 0.25`",
        );
    }
    let tissue = Tissue::Uniform(Solid {
        young_mpa,
        poisson: exports.tissue.poisson,
    });
    let prepared = Prepared {
        specimen: &specimen,
        tissue: &tissue,
    };
    if let Some(note) = params.note() {
        session.say(note);
    }
    let (drawn, mut shown) = (picture::coarsest(&params.cases()), Vec::new());
    let mut lattices = Vec::new();
    for case in params.cases() {
        refuse_lattice_that_does_not_fit(&of_lattice(case), prepared, &exports.tissue)?;
        let summary = if case.boundary == Boundary::Connected {
            let sites = build_connected(&specimen, &case, Axis::Z, 0.0)?;
            written.components(&case, &sites)?;
            summarise_connected(&specimen, &case, &sites)
        } else {
            let sites = build(&specimen, &case, Axis::Z, 0.0)?;
            match &factors {
                None => written.sites(&case, &sites)?,
                Some(factors) => {
                    let mixed = build_of(&specimen, Some(factors), &case, Axis::Z, 0.0)?;
                    written.sites(&case, &mixed)?;
                }
            }
            if let Some(at) = drawn.iter().position(|of| *of == case) {
                shown.push((at, picture::shown(&case, &sites)));
            }
            summarise(&specimen, &case, &sites)
        };
        session.result(summary.in_words());
        lattices.push(summary);
    }
    if !session.dry_run {
        shown.sort_by_key(|(at, _)| *at);
        let shown: Vec<_> = shown.into_iter().map(|(_, lattice)| lattice).collect();
        picture::write(dir, &specimen, &shown)?;
        write(dir, params, lattices.clone())?;
    }
    Ok(lattices)
}

/// Writes `dir/lattice.json` for `solve` to find the settings there, without building a lattice: `solve` builds each
/// once, and its rows say what was found.
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

/// Where exported lattices go.
struct Written<'a> {
    dir: &'a Path,
    formats: &'a [Export],
    tissue: lammps::Tissue,
    specimen: lammps::script::Specimen,
    session: &'a Session,
}

impl Written<'_> {
    fn path(&self, case: &Case, extension: &str) -> PathBuf {
        self.dir
            .join(format!("lattice-{}.{extension}", case.stem()))
    }

    fn sites(&self, case: &Case, sites: &Sites) -> Result<()> {
        for format in self.formats {
            match format {
                Export::Vtk => vtk::write_lattice(&self.path(case, "vtk"), sites)?,
                Export::Lammps => {
                    let path = self.path(case, "data");
                    let worst = lammps::write(&path, sites, self.tissue)?;
                    self.session.say(binned(&path, worst));
                    let script = self.path(case, "in");
                    lammps::script::write(&script, &path, sites, self.specimen)?;
                    self.session.say(format!("wrote {}", script.display()));
                }
            }
        }
        Ok(())
    }

    fn components(&self, case: &Case, sites: &ConnectedSites) -> Result<()> {
        for format in self.formats {
            match format {
                Export::Vtk => vtk::write_connected(&self.path(case, "vtk"), sites)?,
                Export::Lammps => return Err(lammps::connected()),
            }
        }
        Ok(())
    }
}

/// What was written, and how far its stiffnesses are rounded.
pub(super) fn binned(path: &Path, worst: f64) -> String {
    let rounded = match worst > 0.0 {
        true => format!(
            ": stiffnesses are rounded to those of their bins, by {:.2} % at most (--bins)",
            100.0 * worst
        ),
        false => String::new(),
    };
    format!("wrote {}{rounded}", path.display())
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
        .map_err(|e| Error::file(&path, format!("cannot be read: {e}"), again).caused_by(e))?;
    let record: Record = serde_json::from_slice(&text).map_err(|e| {
        Error::file(&path, format!("not a lattice record: {e}"), again).caused_by(e)
    })?;
    Ok(record.settings)
}
