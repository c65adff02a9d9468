//! Owns `run`: one recipe over scans and folders of scans, each scan on its own.

use crate::error::Result;
use crate::recipe::Recipe;
use crate::run::session::Session;
use crate::run::{Outcome, not_available};
use std::path::{Path, PathBuf};

/// Takes every scan under `inputs` through segment, lattice and solve into `out/<scan>/`, then writes `out/results.csv`
/// and `out/report/`. A scan that fails is named in the outcome; the others finish.
pub fn cohort(
    _recipe: &Recipe,
    _inputs: &[PathBuf],
    _out: &Path,
    _session: &Session,
) -> Result<Outcome> {
    Err(not_available("run"))
}
