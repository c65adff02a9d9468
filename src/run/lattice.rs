//! Owns `lattice` on disk: builds the lattices of a segmented scan, reports their counts, exports them.

use crate::error::Result;
use crate::run::not_available;
use crate::run::session::Session;
use crate::stage::lattice::LatticeParams;
use serde::Serialize;
use std::path::Path;

/// A format for other programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Export {
    Lammps,
    Vtk,
}

/// Counts of one lattice.
#[derive(Debug, Clone, Serialize)]
pub struct LatticeSummary {}

/// Builds every lattice asked for from the mask in `dir`, writes `dir/lattice.json` (settings and counts) and one file
/// per lattice and export format.
pub fn lattice(
    _dir: &Path,
    _params: &LatticeParams,
    _exports: &[Export],
    _session: &Session,
) -> Result<Vec<LatticeSummary>> {
    Err(not_available("lattice"))
}

/// The settings that `lattice` left in `dir`; the defaults where it was not run.
pub fn settings(_dir: &Path) -> Result<LatticeParams> {
    Ok(LatticeParams::default())
}
