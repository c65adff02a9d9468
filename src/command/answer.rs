//! Owns what a scan's folder says of its answer: its facts, and `answer.json`.

use crate::error::Result;
use crate::record::answer::{self, Answer};
use crate::record::specimen;
use crate::record::specimen::SegmentRecord;
use crate::result::answer::ScanFacts;
use crate::result::row::Row;
use std::path::Path;

/// What segmentation and the last solve in `dir` left.
pub fn facts(dir: &Path) -> ScanFacts {
    let last = answer::read(dir);
    ScanFacts {
        target: last.and_then(|a| a.target),
        ..specimen::record(dir).map_or_else(ScanFacts::default, |record| of_record(&record))
    }
}

fn of_record(record: &SegmentRecord) -> ScanFacts {
    let results = &record.results;
    ScanFacts {
        size_mm: Some([0, 1, 2].map(|a| results.voxels[a] as f64 * results.spacing_mm[a])),
        warnings: results.warnings.clone(),
        ..ScanFacts::default()
    }
}

/// Writes `answer.json` of the rows that one command solved in `dir`, and returns it. None, and nothing is written, where no row
/// has a modulus, force or moment. `target` is the relative error asked for.
///
/// # Errors
/// A file that cannot be written.
pub fn keep(dir: &Path, rows: &[Row], target: Option<f64>) -> Result<Option<Answer>> {
    let facts = ScanFacts {
        target,
        ..facts(dir)
    };
    let answer = answer::answer(rows, &facts);
    if let Some(answer) = &answer {
        answer::write(dir, answer)?;
    }
    Ok(answer)
}
