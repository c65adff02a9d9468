//! Owns `failed.csv`: the scans of a run that have no results, and why.

use crate::error::Result;
use crate::io::own_files::FAILED;
use crate::io::table;
use serde::{Deserialize, Serialize};
use std::path::Path;

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
        false => {
            let lines: Vec<Failure> = failures.iter().map(on_one_line).collect();
            table::write(&file, &lines)
        }
        true => {
            let _ = std::fs::remove_file(file);
            Ok(())
        }
    }
}

/// Line breaks in a cell are more than many readers of tables take.
fn on_one_line(failure: &Failure) -> Failure {
    let lines = failure.reason.lines().map(str::trim);
    Failure {
        reason: lines.collect::<Vec<_>>().join("; "),
        ..failure.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_stands_on_one_line() {
        let dir = tempfile::tempdir().unwrap();
        let failure = Failure {
            scan: "a".to_owned(),
            input: "a.nii".to_owned(),
            reason: "a.nii: no image\n  what to do: check it".to_owned(),
        };
        write_failures(dir.path(), &[failure]).unwrap();
        let text = std::fs::read_to_string(dir.path().join(FAILED)).unwrap();
        assert_eq!(text.lines().count(), 2, "{text}");
        assert_eq!(
            failures_in(dir.path())[0].reason,
            "a.nii: no image; what to do: check it"
        );
    }
}
