//! Owns the results of one scan on disk: `results.csv`, one row per solve, and the same with provenance in
//! `results.json`. Both are written whole after each solve; what is there for the same mask, settings and version is not
//! redone.

use crate::error::Result;
use crate::io::own_files::RESULTS;
use crate::io::{atomic, table};
use crate::machine::host;
use crate::machine::session::Session;
use crate::measure::pistoia::Pistoia;
use crate::pipeline::apparent::SolveParams;
use crate::record::{details, specimen};
use crate::result::derived::with_derived;
use crate::result::details::Details;
use crate::result::row::Row;
use crate::result::settings::Settings;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The same with provenance.
const RECORD: &str = "results.json";

/// Where the rows of an earlier mask, or of a scan that failed since, are set aside; gone with the next solve.
pub const OLD_TABLE: &str = "results.old.csv";

/// Renames `results.csv`, whose rows no longer belong to what else is in the folder, so that nothing takes them for
/// current; the tables that belong to it are removed. True if there was one.
pub fn set_aside(dir: &Path) -> bool {
    details::remove(dir);
    std::fs::rename(dir.join(RESULTS), dir.join(OLD_TABLE)).is_ok()
}

/// Whether results were set aside and no others took their place.
pub fn has_old(dir: &Path) -> bool {
    dir.join(OLD_TABLE).is_file() && !dir.join(RESULTS).is_file()
}

/// The same where the mask in `dir` is not that of the results.
pub fn set_aside_stale(dir: &Path, session: &Session) {
    keep_other_version(dir, session);
    if session.dry_run {
        return;
    }
    let Some(old) = Record::read(dir) else {
        return;
    };
    let Ok(mask) = std::fs::read(dir.join(specimen::MASK)) else {
        return;
    };
    let now = blake3::hash(&mask).to_hex();
    if old.provenance.mask_blake3 != now.as_str() && set_aside(dir) {
        session.say(format!(
            "{}: the mask has changed: the results of the old mask are set aside as {OLD_TABLE}",
            dir.display()
        ));
    }
}

/// Keeps the results in `dir` under another name where another version made them: its rows are not mixed with those of this one.
pub fn keep_other_version(dir: &Path, session: &Session) {
    let table = dir.join(RESULTS);
    if session.dry_run || !table.is_file() {
        return;
    }
    let version = Record::read(dir).map(|record| record.provenance.version);
    if version.as_deref() == Some(env!("CARGO_PKG_VERSION")) {
        return;
    }
    let (made_by, kept) = match version {
        Some(version) => (
            format!("version {version} of the program"),
            format!("results-{version}.csv"),
        ),
        // Of a record that cannot be read, or of none.
        None => ("another program".to_owned(), "results-other.csv".to_owned()),
    };
    details::remove(dir);
    if std::fs::rename(&table, dir.join(&kept)).is_ok() {
        session.say(format!(
            "{}: {made_by} made the results there: they are kept as {kept}",
            dir.display()
        ));
    }
}

/// BLAKE3 of the mask that the results in `dir` are of.
pub fn mask_blake3(dir: &Path) -> Option<String> {
    Record::read(dir).map(|record| record.provenance.mask_blake3)
}

/// Settings and details of the solves in `dir`; empty where there are none.
pub fn details(dir: &Path) -> Vec<(Settings, Details)> {
    let rows = Record::read(dir).map_or(Vec::new(), |record| record.rows);
    let of = |keyed: KeyedRow| (keyed.row.key, keyed.details);
    rows.into_iter().map(of).collect()
}

/// Criteria by which failure loads in `dir` were found, each with the labels whose bone counts.
pub fn criteria(dir: &Path) -> Vec<(Pistoia, Vec<i32>)> {
    let rows = Record::read(dir).map_or(Vec::new(), |record| record.rows);
    let of = |keyed: KeyedRow| {
        keyed.row.failure()?;
        let settings = keyed.settings?;
        Some((settings.pistoia?, settings.failure_labels))
    };
    rows.into_iter().filter_map(of).collect()
}

/// Writes `results.csv`; an older one that was set aside goes.
pub fn write_table(dir: &Path, rows: &[Row]) -> Result<()> {
    table::write(&dir.join(RESULTS), rows)?;
    let _ = std::fs::remove_file(dir.join(OLD_TABLE));
    Ok(())
}

/// The content of `results.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Record {
    provenance: Provenance,
    rows: Vec<KeyedRow>,
}

// `segment.json` and `stiffness.json` have only program and version in common with this: a struct for two lines would be longer than they are.
/// Where results come from, enough to make them again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Provenance {
    program: String,
    version: String,
    /// Of the last solve, in UTC.
    date: String,
    host: String,
    threads: usize,
    /// BLAKE3 of `mask.nii.gz`: rows of another mask are not these.
    mask_blake3: String,
    /// `segment.json` as it was: the input, its hash, the settings.
    segment: Value,
}

/// A row; for a solved one with the settings it follows from and their key. Means have neither.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct KeyedRow {
    #[serde(flatten)]
    row: Row,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    key: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    settings: Option<SolveParams>,
    #[serde(default, skip_serializing_if = "is_empty")]
    details: Details,
}

fn is_empty(details: &Details) -> bool {
    *details == Details::default()
}

/// The rows of one scan's folder.
pub struct Results {
    /// None: they are kept in memory alone.
    dir: Option<PathBuf>,
    record: Record,
    /// Where solves are to be made again: keys of those that were.
    redone: Option<BTreeSet<String>>,
}

impl Results {
    /// Opens the results in `dir` of the mask of this hash, which `segment` (the content of `segment.json`) says how to make; empty where
    /// there are none, or where they belong to another mask or version. With `redo` no row is found before its solve was made again; rows
    /// of other settings stay.
    pub fn open(dir: &Path, mask_blake3: &str, segment: Value, redo: bool) -> Self {
        let provenance = Provenance::now(mask_blake3, segment);
        let old = Record::read(dir);
        let same = |r: &Record| {
            r.provenance.mask_blake3 == provenance.mask_blake3
                && r.provenance.version == provenance.version
        };
        let mut rows = old.filter(same).map_or(Vec::new(), |r| r.rows);
        // Means are computed again from what was solved.
        rows.retain(|row| row.key.is_some());
        Results {
            dir: Some(dir.to_path_buf()),
            record: Record { provenance, rows },
            redone: redo.then(BTreeSet::new),
        }
    }

    /// Results that no folder holds, of the mask of this hash, which `segment` says how to make.
    pub fn in_memory(mask_blake3: &str, segment: Value) -> Self {
        let provenance = Provenance::now(mask_blake3, segment);
        Results {
            dir: None,
            record: Record {
                provenance,
                rows: Vec::new(),
            },
            redone: None,
        }
    }

    /// The converged row that follows from the same settings, if it was made before. `blank` is the row before its
    /// solve.
    pub fn find(&self, blank: &Row, params: &SolveParams) -> Option<Row> {
        let own = key(blank, params);
        let is_old = |redone: &BTreeSet<String>| !redone.contains(&own);
        if self.redone.as_ref().is_some_and(is_old) {
            return None;
        }
        let key = Some(own);
        let same = |old: &&KeyedRow| old.key == key && old.row.converged() == Some(true);
        self.record
            .rows
            .iter()
            .find(same)
            .map(|old| old.row.clone())
    }

    /// The details of the row that [`Results::find`] finds; none where there is no such row.
    pub fn details(&self, blank: &Row, params: &SolveParams) -> Details {
        let key = Some(key(blank, params));
        let found = self.record.rows.iter().find(|old| old.key == key);
        found.map_or_else(Details::default, |old| old.details.clone())
    }

    /// What tells a solve of this mask from every other, in short.
    pub fn fingerprint(&self, blank: &Row, params: &SolveParams) -> String {
        let version = &self.record.provenance.version;
        format!(
            "solve {version} {} {}",
            key(blank, params),
            self.mask_blake3()
        )
    }

    /// Stores a row with its details (None: those it had), in place of an older one of the same settings, and writes all files.
    pub fn store(
        &mut self,
        blank: &Row,
        params: &SolveParams,
        row: &Row,
        details: Option<Details>,
    ) -> Result<()> {
        let mut new = KeyedRow {
            row: row.clone(),
            key: Some(key(blank, params)),
            settings: Some(params.clone()),
            details: Details::default(),
        };
        if let Some(KeyedRow { row: old, .. }) = self.record.rows.first() {
            (new.row.marks.group, new.row.marks.subject) =
                (old.marks.group.clone(), old.marks.subject.clone());
        }
        if let Some(redone) = &mut self.redone {
            redone.extend(new.key.clone());
        }
        self.record.provenance.date = host::date();
        match self.record.rows.iter_mut().find(|old| old.key == new.key) {
            Some(old) => {
                new.details = details.unwrap_or_else(|| std::mem::take(&mut old.details));
                *old = new;
            }
            None => {
                new.details = details.unwrap_or_default();
                self.record.rows.push(new);
            }
        }
        self.write()
    }

    /// Marks all rows, and those to come, with the group and subject that a manifest gives.
    pub fn label(&mut self, group: &Option<String>, subject: &Option<String>) -> Result<()> {
        let mut changed = false;
        for KeyedRow { row, .. } in &mut self.record.rows {
            let marks = &mut row.marks;
            if marks.group != *group || marks.subject != *subject {
                (marks.group, marks.subject) = (group.clone(), subject.clone());
                changed = true;
            }
        }
        if changed { self.write() } else { Ok(()) }
    }

    /// Lets `change` edit each solved row, and writes what has changed.
    pub fn edit_rows(&mut self, change: impl Fn(&mut Row)) -> Result<()> {
        let before = self.record.rows.clone();
        self.record
            .rows
            .iter_mut()
            .for_each(|keyed| change(&mut keyed.row));
        match self.record.rows == before {
            true => Ok(()),
            false => self.write(),
        }
    }

    /// The details of the solved row with these settings; none where there is no such row.
    pub fn details_of(&self, settings: &Settings) -> Details {
        let found = self.record.rows.iter().find(|own| own.row.key == *settings);
        found.map_or_else(Details::default, |own| own.details.clone())
    }

    /// BLAKE3 of the mask that the results are of.
    pub fn mask_blake3(&self) -> &str {
        &self.record.provenance.mask_blake3
    }

    /// The solved rows, of all settings.
    pub fn solved(&self) -> Vec<Row> {
        let keyed = self.record.rows.iter();
        keyed.map(|keyed| keyed.row.clone()).collect()
    }

    fn write(&self) -> Result<()> {
        let Some(dir) = &self.dir else {
            return Ok(());
        };
        let solved = self.solved();
        let rows = with_derived(&solved, &solved);
        let mut solved = self.record.rows.iter();
        let keyed = |row: &Row| match row.key.is_derived() {
            true => KeyedRow {
                row: row.clone(),
                key: None,
                settings: None,
                details: Details::default(),
            },
            false => solved
                .next()
                .expect("means are added, nothing is removed")
                .clone(),
        };
        let record = Record {
            provenance: self.record.provenance.clone(),
            rows: rows.iter().map(keyed).collect(),
        };
        let text = serde_json::to_string_pretty(&record).expect("plain data");
        atomic::write(&dir.join(RECORD), text)?;
        let details = self.record.rows.iter();
        details::write(dir, details.map(|keyed| (&keyed.row.key, &keyed.details)))?;
        write_table(dir, &rows)
    }
}

impl Record {
    /// None where there is none, or an older program wrote another kind.
    fn read(dir: &Path) -> Option<Self> {
        let text = std::fs::read(dir.join(RECORD)).ok()?;
        serde_json::from_slice(&text).ok()
    }
}

impl Provenance {
    fn now(mask_blake3: &str, segment: Value) -> Self {
        Provenance {
            program: env!("CARGO_PKG_NAME").to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            date: host::date(),
            host: host::name(),
            threads: rayon::current_num_threads(),
            mask_blake3: mask_blake3.to_owned(),
            segment,
        }
    }
}

/// Key of what a row follows from, apart from the mask and the version: its lattice and all settings, also those without a column.
fn key(blank: &Row, params: &SolveParams) -> String {
    let all = serde_json::json!([blank, params]);
    blake3::hash(all.to_string().as_bytes()).to_hex()[..32].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::BoundaryRule;

    const FIRM: BoundaryRule = BoundaryRule::Firm;
    const FLOPPY: BoundaryRule = BoundaryRule::Floppy;

    fn blank(boundary: BoundaryRule) -> Row {
        Row {
            key: Settings {
                boundary: Some(boundary),
                ..Settings::default()
            },
            ..Row::default()
        }
    }

    fn solved(boundary: BoundaryRule, e: f64) -> Row {
        Row {
            solved: Some(Solution {
                e_app_mpa: Some(e),
                converged: Some(true),
                ..Solution::default()
            }),
            ..blank(boundary)
        }
    }

    fn opened(dir: &tempfile::TempDir, mask_blake3: &str, redo: bool) -> Results {
        Results::open(dir.path(), mask_blake3, Value::Null, redo)
    }

    #[test]
    fn rows_are_found_again_for_the_same_settings_only() {
        let dir = tempfile::tempdir().unwrap();
        let params = SolveParams::default();
        let mut results = opened(&dir, "mask", false);
        results
            .store(&blank(FIRM), &params, &solved(FIRM, 1.0 / 3.0), None)
            .unwrap();
        results
            .store(&blank(FLOPPY), &params, &solved(FLOPPY, 0.1), None)
            .unwrap();

        let again = opened(&dir, "mask", false);
        assert_eq!(
            again.find(&blank(FIRM), &params),
            Some(solved(FIRM, 1.0 / 3.0))
        );
        let tighter = SolveParams {
            tolerance: 1e-6,
            ..params.clone()
        };
        assert_eq!(again.find(&blank(FIRM), &tighter), None);
        let table: Vec<Row> = table::read(&dir.path().join(RESULTS)).unwrap();
        assert_eq!(table.len(), 3);
        assert_eq!(table[2].key.boundary, Some(BoundaryRule::Ffb));

        assert_eq!(opened(&dir, "mask", true).find(&blank(FIRM), &params), None);
        assert_eq!(
            opened(&dir, "another", false).find(&blank(FIRM), &params),
            None
        );
    }

    #[test]
    fn a_row_that_did_not_converge_is_solved_again_and_replaced() {
        let dir = tempfile::tempdir().unwrap();
        let params = SolveParams::default();
        let mut results = opened(&dir, "mask", false);
        let mut stalled = solved(FIRM, 2.0);
        stalled.solved.as_mut().unwrap().converged = Some(false);
        results
            .store(&blank(FIRM), &params, &stalled, None)
            .unwrap();
        assert_eq!(results.find(&blank(FIRM), &params), None);
        results
            .store(&blank(FIRM), &params, &solved(FIRM, 1.0), None)
            .unwrap();
        let table: Vec<Row> = table::read(&dir.path().join(RESULTS)).unwrap();
        assert_eq!(table, [solved(FIRM, 1.0)]);
    }
}
