//! What scanners and programs write: every key of a format, every spelling, against files that are built here.

mod arrays;
mod descriptions;
mod headers;
mod kinds;
mod masks;
mod plausible;
mod slices;
mod tags;
pub mod write;

use std::path::{Path, PathBuf};

/// A file of this name in a folder of its own.
pub fn file(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    (dir, path)
}

/// Rows of the only table in a module's documentation: cells without their blanks.
pub fn documented(source: &str) -> Vec<Vec<String>> {
    let lines = source.lines().filter_map(|line| line.strip_prefix("//! |"));
    let rows = lines.map(|line| {
        let cells = line.trim_end_matches('|').split('|');
        cells.map(|cell| cell.trim().to_owned()).collect::<Vec<_>>()
    });
    let rows: Vec<Vec<String>> = rows.filter(|row| !row[0].starts_with("---")).collect();
    assert!(rows.len() > 10, "no table");
    rows[1..].to_vec()
}

/// What the program says and how it ends.
pub fn program(dir: &Path, words: &[&str]) -> (Option<i32>, String) {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_bonepd-ct"))
        .args(words)
        .arg("--threads=1")
        .current_dir(dir)
        .output()
        .unwrap();
    let [out, err] =
        [output.stdout, output.stderr].map(|b| String::from_utf8_lossy(&b).into_owned());
    (output.status.code(), out + &err)
}
