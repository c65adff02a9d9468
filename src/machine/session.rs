//! Owns what all commands share: how loud, how many threads, whether to redo or only to say what would be done.

use crate::machine::host;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// The shared flags, as plain data, and where words go.
#[derive(Debug, Clone, Default)]
pub struct Session {
    /// None: one per core.
    pub threads: Option<usize>,
    pub quiet: bool,
    pub verbose: bool,
    /// Say what would be done, write nothing.
    pub dry_run: bool,
    /// Redo what is up to date.
    pub force: bool,
    /// The scan of a run that this session is about: warnings name it.
    pub scan: Option<String>,
    /// Other scans are worked on at the same time: the process's memory is not this one's.
    pub shares_process: bool,
    pub output: Output,
}

/// Where words go beside the terminal.
#[derive(Debug, Clone, Default)]
pub struct Output {
    /// All bars of a run share the terminal.
    bars: MultiProgress,
    log: Option<Arc<Mutex<Log>>>,
}

impl Session {
    /// The session of one scan of a run: its words go to `file`, warnings to the terminal too.
    pub fn logged(&self, scan: &str, file: PathBuf) -> Session {
        Session {
            scan: Some(scan.to_owned()),
            quiet: self.quiet || !self.verbose,
            output: Output {
                bars: self.output.bars.clone(),
                log: Some(Arc::new(Mutex::new(Log {
                    file,
                    waiting: String::new(),
                }))),
            },
            ..self.clone()
        }
    }

    /// One line on stderr, unless quiet.
    pub fn say(&self, line: impl AsRef<str>) {
        self.note(line.as_ref());
        if !self.quiet {
            self.put(line.as_ref());
        }
    }

    /// One line on stderr, only with `-v`.
    pub fn detail(&self, line: impl AsRef<str>) {
        self.note(line.as_ref());
        if self.verbose && !self.quiet {
            self.put(line.as_ref());
        }
    }

    /// A warning on stderr. Shown even when quiet: it changes how a result is read.
    pub fn warn(&self, line: impl AsRef<str>) {
        self.warn_of(self.scan.as_deref(), line);
    }

    /// A warning about `scan`.
    pub fn warn_of(&self, scan: Option<&str>, line: impl AsRef<str>) {
        let scan = scan.map_or(String::new(), |s| format!("{s}: "));
        self.note(&format!("warning: {}", line.as_ref()));
        self.put(&format!("warning: {scan}{}", line.as_ref()));
    }

    /// What a user should know of how `scan` was understood.
    pub fn note_of(&self, scan: &str, line: &str) {
        self.say(format!("note: {scan}: {line}"));
    }

    /// One line on stderr. A reader that has closed it does not stop the work.
    fn put(&self, line: &str) {
        self.output.bars.suspend(|| {
            let _ = writeln!(std::io::stderr(), "{line}");
        });
    }

    /// A line in the log alone.
    pub fn note(&self, line: &str) {
        if let Some(log) = &self.output.log
            && !self.dry_run
        {
            log.lock()
                .expect("no one panics while writing a line")
                .add(line);
        }
    }

    /// Writes what the log still holds back, making its folder.
    pub fn flush(&self) {
        if let Some(log) = &self.output.log
            && !self.dry_run
        {
            log.lock()
                .expect("no one panics while writing a line")
                .flush();
        }
    }

    /// A progress bar over `len` steps; hidden when quiet or when stderr is not a terminal.
    pub fn bar(&self, len: u64, label: &str) -> ProgressBar {
        if self.quiet || !std::io::stderr().is_terminal() {
            return ProgressBar::with_draw_target(Some(len), ProgressDrawTarget::hidden());
        }
        let style =
            ProgressStyle::with_template("{prefix:<24} {bar:28} {pos}/{len} {msg} {elapsed}")
                .expect("a fixed template");
        self.output
            .bars
            .add(ProgressBar::new(len))
            .with_style(style)
            .with_prefix(label.to_owned())
    }
}

/// A scan's log: lines with their time, appended. Nothing is written before the scan's folder exists, so that a scan
/// that cannot be read leaves nothing behind unless [`Session::flush`] says so.
#[derive(Debug)]
struct Log {
    file: PathBuf,
    waiting: String,
}

impl Log {
    fn add(&mut self, line: &str) {
        self.waiting += &format!("{} {line}\n", host::date());
        if self.folder().is_dir() {
            self.append();
        }
    }

    fn flush(&mut self) {
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
