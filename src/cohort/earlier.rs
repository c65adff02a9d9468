//! Owns what earlier runs left in the output folder: a run into the same folder adds to it.

use crate::cohort::job::ScanJob;
use crate::image::slices::natural;
use crate::io::own_files;
use crate::machine::session::Session;
use crate::record::specimen;
use std::path::Path;

/// Names of the scans that have results in `out` and are not among `jobs`, in the order of their names.
pub fn names(out: &Path, jobs: &[ScanJob]) -> Vec<String> {
    let folders = std::fs::read_dir(out).into_iter().flatten().flatten();
    let mut names: Vec<String> = folders
        .filter(|folder| {
            let has = |file: &str| folder.path().join(file).is_file();
            has(specimen::RECORD) && has(own_files::RESULTS)
        })
        .filter_map(|folder| folder.file_name().into_string().ok())
        .filter(|name| !jobs.iter().any(|job| job.name == *name))
        .collect();
    names.sort_by(|a, b| natural(a, b));
    names
}

/// Says that these scans stay in the tables and the report; nothing where there are none.
pub fn say(names: &[String], session: &Session) {
    if !names.is_empty() {
        session.say(format!(
            "note: scans of earlier runs in this folder stay in its tables and report: {} (remove their folders to drop them)",
            names.join(", ")
        ));
    }
}
