//! Owns `solve` on disk: every lattice of a segmented scan, `results.csv` and `results.json` written after each.

use crate::error::Result;
use crate::measure::row::Row;
use crate::run::not_available;
use crate::run::session::Session;
use crate::stage::lattice::LatticeParams;
use crate::stage::solve::SolveParams;
use std::path::Path;

/// Solves every structure × lattice parameter × boundary for the specimen in `dir`. Rows already there for the same
/// mask and settings are kept unless the session forces.
pub fn solve(
    _dir: &Path,
    _lattice: &LatticeParams,
    _params: &SolveParams,
    _session: &Session,
) -> Result<Vec<Row>> {
    Err(not_available("solve"))
}
