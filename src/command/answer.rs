//! Owns what a scan's folder says of its answer: its facts, and `answer.json`.

use crate::error::Result;
use crate::io::own_files::RESULTS;
use crate::io::table;
use crate::record::answer::{self, Answer};
use crate::record::specimen;
use crate::record::specimen::SegmentRecord;
use crate::result::answer::{AnswerLine, ScanFacts, answers};
use crate::result::condition::{Condition, shared};
use crate::result::row::Row;
use std::path::Path;

/// What segmentation, as its record says, and the solves so far in `dir` left.
pub fn facts(dir: &Path, record: &SegmentRecord) -> ScanFacts {
    ScanFacts {
        targets: answer::targets(dir),
        ..facts_of(record)
    }
}

/// What segmentation left.
fn facts_of(record: &SegmentRecord) -> ScanFacts {
    let results = &record.results;
    ScanFacts {
        size_mm: Some([0, 1, 2].map(|a| results.voxels[a] as f64 * results.spacing_mm[a])),
        warnings: results.warnings.clone(),
        ..ScanFacts::default()
    }
}

/// Writes `answer.json` after one command solved `rows` in `dir`: of all rows there under their condition. The line of that answer;
/// None, and nothing is written, where no row has a modulus, force or moment. `target` is the relative error asked for; without
/// one, that of an earlier command under the same condition holds.
///
/// # Errors
/// A file that cannot be read or written.
pub fn keep(dir: &Path, rows: &[Row], target: Option<f64>) -> Result<Option<AnswerLine>> {
    let Some(condition) = condition(rows) else {
        return Ok(None);
    };
    let of_record = |record: SegmentRecord| facts(dir, &record);
    let mut facts = specimen::record(dir).map_or_else(ScanFacts::default, of_record);
    if let Some(target) = target {
        for row in rows {
            facts.targets.set(&Condition::of(&row.key), target);
        }
    }
    let known = known(dir, rows, &condition)?;
    if let Some(answer) = answer::answer(&known, &facts) {
        answer::write(dir, &answer)?;
    }
    Ok(answers(&known, &condition, |_| facts.clone()).pop())
}

/// The answer of a scan in memory, which `rows` are all of; `target` is the relative error asked for. None where no row has a modulus,
/// force or moment.
pub fn of_rows(rows: &[Row], record: &SegmentRecord, target: Option<f64>) -> Option<Answer> {
    let mut facts = facts_of(record);
    if let (Some(target), Some(condition)) = (target, condition(rows)) {
        facts.targets.set(&condition, target);
    }
    answer::answer(rows, &facts)
}

/// The condition that the answer is of: of several one with a modulus, then the last.
fn condition(rows: &[Row]) -> Option<Condition> {
    let solved: Vec<&Row> = rows
        .iter()
        .filter(|row| row.load_carried().is_some())
        .collect();
    shared(&solved)
}

/// All rows in `dir` under the condition; `rows` where nothing is written there.
fn known(dir: &Path, rows: &[Row], condition: &Condition) -> Result<Vec<Row>> {
    let file = dir.join(RESULTS);
    let mut known = match file.is_file() {
        true => table::read(&file)?,
        false => rows.to_vec(),
    };
    known.retain(|row: &Row| Condition::of(&row.key) == *condition);
    Ok(known)
}
