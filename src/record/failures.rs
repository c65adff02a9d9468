//! Owns `failed.csv`: the scans of a run that have no results, and why.

use crate::error::Result;
use crate::io::table;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Scans of a run that have no results, in its output folder; absent where there are none.
const FAILED: &str = "failed.csv";

/// A scan of a run that has no results: a line of `failed.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct Failure {
    pub scan: String,
    pub input: String,
    pub reason: String,
}

/// What an earlier run wrote into `failed.csv`.
pub fn failures_in(out: &Path) -> Vec<Failure> {
    table::read(&out.join(FAILED)).unwrap_or_default()
}

/// Writes `failed.csv`, or removes that of an earlier run.
pub fn write_failures(out: &Path, failures: &[Failure]) -> Result<()> {
    let file = out.join(FAILED);
    match failures.is_empty() {
        false => table::write(&file, failures),
        true => {
            let _ = std::fs::remove_file(file);
            Ok(())
        }
    }
}
