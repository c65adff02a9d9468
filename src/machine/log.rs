//! Owns a scan's log: lines with their time, appended. Nothing is written before the scan's folder exists, so that a scan
//! that cannot be read leaves nothing behind unless it is asked to.

use crate::machine::host;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A scan's log file, and the lines that wait for its folder.
#[derive(Debug)]
pub struct Log {
    file: PathBuf,
    waiting: String,
}

impl Log {
    /// A log in `file`; nothing is written yet.
    pub fn new(file: PathBuf) -> Log {
        Log {
            file,
            waiting: String::new(),
        }
    }

    /// Adds a line with the date and time.
    pub fn add(&mut self, line: &str) {
        self.waiting += &format!("{} {line}\n", host::date());
        if self.folder().is_dir() {
            self.append();
        }
    }

    /// Makes the folder and writes what still waits.
    pub fn flush(&mut self) {
        let _ = std::fs::create_dir_all(self.folder());
        self.append();
    }

    fn folder(&self) -> &Path {
        self.file.parent().unwrap_or(Path::new("."))
    }

    /// A log that cannot be written is no reason to stop.
    fn append(&mut self) {
        let file = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.file);
        if file
            .and_then(|mut f| f.write_all(self.waiting.as_bytes()))
            .is_ok()
        {
            self.waiting.clear();
        }
    }
}
