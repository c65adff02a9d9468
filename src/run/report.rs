//! Owns `report` on disk: rows of any number of solved scans in; tables, plots and pages out.

use crate::error::Result;
use crate::run::not_available;
use crate::run::session::Session;
use std::path::{Path, PathBuf};

/// Reads `results.csv` of each folder and writes the report into `out`. Returns what was written.
pub fn report(_dirs: &[PathBuf], _out: &Path, _session: &Session) -> Result<Vec<PathBuf>> {
    Err(not_available("report"))
}
