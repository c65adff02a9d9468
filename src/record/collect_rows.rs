//! Owns reading solved scans back: the tables of runs and of single scans, the newer before the older.

use crate::error::{Error, Result};
use crate::io::own_files::RESULTS;
use crate::io::table;
use crate::machine::session::Session;
use crate::record::failures::{Failure, failures_in};
use crate::record::results::OLD_TABLE;
use crate::record::specimen;
use crate::result::row::Row;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Rows of all scans read so far, and the scans that have none.
#[derive(Debug, Default)]
pub struct CollectedRows {
    pub rows: Vec<Row>,
    pub failures: Vec<Failure>,
}

impl CollectedRows {
    /// Adds the rows of a solved scan's folder, or of the output of a run: of scans in it that were solved again since, the
    /// rows in their own folders, in place of those of the run.
    ///
    /// # Errors
    /// A folder without `results.csv`, a table that cannot be read.
    pub fn add(&mut self, dir: &Path, session: &Session) -> Result<()> {
        let file = dir.join(RESULTS);
        if !file.is_file() {
            let old = dir.join(OLD_TABLE).is_file();
            return Err(Error::file(
                dir,
                match old {
                    true => format!(
                        "expected {RESULTS}, found only {OLD_TABLE}: results of another mask, which a later run has set aside"
                    ),
                    false => format!("expected a folder with {RESULTS}, found none"),
                },
                match old {
                    true => format!("run again, or rename {OLD_TABLE} to {RESULTS}"),
                    false => "name folders that `solve` or `run` has written to".to_owned(),
                },
            ));
        }
        let mut rows: Vec<Row> = table::read(&file)?;
        let mut failures = failures_in(dir);
        for (scan, newer) in newer_in(dir, &file) {
            session.say(format!(
                "{scan}: solved after the run, read from {}",
                newer.display()
            ));
            replace(&mut rows, &scan, table::read(&newer)?);
            failures.retain(|failure| failure.scan != scan);
        }
        self.rows.extend(rows);
        self.failures.extend(failures);
        Ok(())
    }
}

/// Names and tables of the scans in `dir` whose own table is newer than `file`, by name.
fn newer_in(dir: &Path, file: &Path) -> Vec<(String, PathBuf)> {
    let written = |path: &Path| -> Option<SystemTime> { path.metadata().ok()?.modified().ok() };
    let folders = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let newer = folders.filter_map(|folder| {
        let own = folder.path().join(RESULTS);
        let record = specimen::record(&folder.path())?;
        (written(&own)? > written(file)?).then_some((record.scan, own))
    });
    let mut newer: Vec<(String, PathBuf)> = newer.collect();
    newer.sort();
    newer
}

/// The scan's rows stand where they stood; those of a scan that had none come last.
fn replace(rows: &mut Vec<Row>, scan: &str, new: Vec<Row>) {
    let at = rows.iter().position(|row| row.key.scan == scan);
    let at = at.unwrap_or(rows.len());
    rows.retain(|row| row.key.scan != scan);
    rows.splice(at..at, new);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::settings::Settings;

    #[test]
    fn newer_rows_stand_where_the_older_stood() {
        let row = |scan: &str, lp_mm| Row {
            key: Settings {
                scan: scan.to_owned(),
                lp_mm,
                ..Settings::default()
            },
            ..Row::default()
        };
        let mut rows = vec![row("a", 1.0), row("b", 1.0), row("b", 2.0), row("c", 1.0)];
        replace(&mut rows, "b", vec![row("b", 3.0)]);
        replace(&mut rows, "d", vec![row("d", 4.0)]);
        let found: Vec<(&str, f64)> = rows
            .iter()
            .map(|r| (r.key.scan.as_str(), r.key.lp_mm))
            .collect();
        assert_eq!(found, [("a", 1.0), ("b", 3.0), ("c", 1.0), ("d", 4.0)]);
    }
}
