//! Owns the table of estimated daily loads, `in_vivo.csv`.

use crate::error::Result;
use crate::io::{atomic, table};
use crate::result::settings::Load;
use serde::Serialize;
use std::path::Path;

/// Name of the table.
pub const IN_VIVO: &str = "in_vivo.csv";

/// One unit load and what it was found to act with.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct InVivoLine {
    /// Name of the scan.
    pub scan: String,
    /// The unit load.
    pub load: Load,
    /// `N`, or `N mm` of moments.
    pub unit: String,
    /// Force or moment of the unit load that was solved, in that unit.
    pub unit_load: f64,
    /// The estimate, in the same unit.
    pub amplitude: f64,
    /// Of the energy field over the unit load squared: the amplitude squared.
    pub factor: f64,
    /// Share in the combined energy, 0 to 1.
    pub energy_share: f64,
    /// Mean energy density that was aimed at.
    pub target_mpa: f64,
    /// Mean of the combined field.
    pub mean_mpa: f64,
    /// Its standard deviation.
    pub sd_mpa: f64,
    /// Of the combined field by Pistoia's criterion: what all energies' roots are multiplied by to fail.
    pub failure_factor: Option<f64>,
}

/// How the files of the combined field begin.
pub const COMBINED: &str = "field-sed-in-vivo-mpa";

/// Removes the table and the combined field in `dir`: they are of rows that are solved again.
pub fn remove(dir: &Path) {
    let _ = std::fs::remove_file(dir.join(IN_VIVO));
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(COMBINED) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Writes the table into `dir`.
///
/// # Errors
/// A file that cannot be written.
pub fn write(dir: &Path, lines: &[InVivoLine]) -> Result<()> {
    atomic::write(&dir.join(IN_VIVO), table::to_csv(lines))
}
