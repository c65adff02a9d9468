//! Owns the results of one scan on disk: `results.csv`, one row per solve, and the same with provenance in
//! `results.json`. Both are written whole after each solve; what is there for the same mask and version is not redone.

use crate::error::{Error, Result};
use crate::io::{atomic, table};
use crate::measure::ffb::{settings_of, with_ffb};
use crate::measure::row::Row;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

#[derive(Debug, Serialize, Deserialize)]
struct Record {
    version: String,
    /// BLAKE3 of `mask.nii.gz`: rows of another mask are not these.
    mask_blake3: String,
    rows: Vec<Row>,
}

/// The rows of one scan's folder.
pub struct Results {
    dir: PathBuf,
    record: Record,
}

impl Results {
    /// Opens the results in `dir`; empty where there are none, where they belong to another mask or version, or when
    /// everything is to be redone.
    ///
    /// # Errors
    /// A mask that cannot be read.
    pub fn open(dir: &Path, redo: bool) -> Result<Self> {
        let mask = dir.join("mask.nii.gz");
        let bytes = std::fs::read(&mask).map_err(|e| {
            Error::file(
                &mask,
                format!("cannot be read: {e}"),
                "run `bonepd-ct segment` first",
            )
        })?;
        let mask_blake3 = blake3::hash(&bytes).to_hex().to_string();
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let old = std::fs::read(dir.join("results.json")).ok();
        let old: Option<Record> = old.and_then(|text| serde_json::from_slice(&text).ok());
        let same = |r: &Record| r.mask_blake3 == mask_blake3 && r.version == version;
        let rows = old
            .filter(|r| !redo && same(r))
            .map_or(Vec::new(), |r| r.rows);
        let record = Record {
            version,
            mask_blake3,
            rows,
        };
        Ok(Results {
            dir: dir.to_path_buf(),
            record,
        })
    }

    /// The converged row of the same settings, if it was made before.
    pub fn find(&self, blank: &Row) -> Option<Row> {
        let same =
            |row: &&Row| row.boundary == blank.boundary && settings_of(row) == settings_of(blank);
        self.record
            .rows
            .iter()
            .find(|row| same(row) && row.converged == Some(true))
            .cloned()
    }

    /// Keeps a row, in place of an older one of the same settings, and writes both files.
    pub fn keep(&mut self, row: &Row) -> Result<()> {
        let same = |old: &Row| old.boundary == row.boundary && settings_of(old) == settings_of(row);
        match self.record.rows.iter_mut().find(|old| same(old)) {
            Some(old) => *old = row.clone(),
            None => self.record.rows.push(row.clone()),
        }
        self.record.rows = with_ffb(&self.record.rows);
        let text = serde_json::to_string_pretty(&self.record).expect("plain data");
        atomic::write(&self.dir.join("results.json"), text)?;
        table::write(&self.dir.join("results.csv"), &self.record.rows)
    }
}
