//! Owns the folders of the scans of a report: each is found, and its record read, once.

use crate::record::specimen;
use crate::record::specimen::SegmentRecord;
use crate::result::row::Row;
use std::path::PathBuf;

/// The scans of some rows, in the order of their first rows, with their folders.
pub struct Folders(Vec<(String, Option<Folder>)>);

/// The folder of a scan.
pub struct Folder {
    /// Where it is.
    pub dir: PathBuf,
    /// What was segmented there.
    pub record: SegmentRecord,
}

impl Folders {
    /// Looks for the folders of the scans of `rows` in `dirs`, which are output folders or folders of scans.
    pub fn of(rows: &[Row], dirs: &[PathBuf]) -> Folders {
        let mut found: Vec<(String, Option<Folder>)> = Vec::new();
        for row in rows {
            let scan = &row.key.scan;
            if found.iter().all(|(known, _)| known != scan) {
                found.push((scan.clone(), folder(scan, dirs)));
            }
        }
        Folders(found)
    }

    /// The folder of a scan; None where none was found.
    pub fn get(&self, scan: &str) -> Option<&Folder> {
        let (_, folder) = self.0.iter().find(|(known, _)| known == scan)?;
        folder.as_ref()
    }

    /// Scans with and without folders.
    pub fn scans(&self) -> impl Iterator<Item = (&str, Option<&Folder>)> {
        self.0
            .iter()
            .map(|(scan, folder)| (scan.as_str(), folder.as_ref()))
    }

    /// Scans by what `key` says of their folder. Scans that it says nothing of are left out.
    pub fn by(&self, key: impl Fn(&Folder) -> Option<String>) -> Vec<(String, Vec<&str>)> {
        let mut found: Vec<(String, Vec<&str>)> = Vec::new();
        for (scan, folder) in self.scans() {
            let Some(key) = folder.and_then(&key) else {
                continue;
            };
            match found.iter_mut().find(|(known, _)| *known == key) {
                Some((_, scans)) => scans.push(scan),
                None => found.push((key, vec![scan])),
            }
        }
        found
    }
}

fn folder(scan: &str, dirs: &[PathBuf]) -> Option<Folder> {
    let places = dirs.iter().flat_map(|dir| [dir.join(scan), dir.clone()]);
    let of = |dir: PathBuf| {
        let record = specimen::record(&dir)?;
        Some(Folder { dir, record })
    };
    places
        .filter_map(of)
        .find(|folder| folder.record.scan == scan)
}
