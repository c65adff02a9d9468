//! Owns what all commands share: how loud, how many threads, whether to redo or only to say what would be done; and where
//! words go: results to stdout, everything else to stderr.

use crate::machine::interrupt::Stop;
use crate::machine::log::Log;
use crate::result::notes::Alikes;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The shared flags, as plain data, and where words go.
#[derive(Debug, Clone, Default)]
pub struct Session {
    /// None: one per core.
    pub threads: Option<usize>,
    /// No progress on stderr; results and warnings stay.
    pub quiet: bool,
    /// Details on stderr as well.
    pub verbose: bool,
    /// stdout is for the JSON alone.
    pub json: bool,
    /// Say what would be done, write nothing.
    pub dry_run: bool,
    /// Redo what is up to date.
    pub force: bool,
    /// The scan of a run that this session is about: warnings name it.
    pub scan: Option<String>,
    /// Other scans are worked on at the same time: the process's memory is not this one's.
    pub shares_process: bool,
    /// Seen at each iteration of a solver: whether to stop.
    pub stop: Stop,
    /// Where words go other than the terminal.
    pub output: Output,
}

/// Where words go other than the terminal.
#[derive(Debug, Clone, Default)]
pub struct Output {
    /// All bars of a run share the terminal.
    bars: MultiProgress,
    /// Of a scan of a run: bars are shown though its words go to the log.
    bars_shown: Option<bool>,
    log: Option<Arc<Mutex<Log>>>,
    /// Warnings of a run so far: one that says the same of another scan waits for the end.
    warned: Option<Arc<Mutex<Alikes>>>,
    /// Of a program that calls the library: its warnings, which the terminal does not show.
    collected: Option<Arc<Mutex<Vec<String>>>>,
}

impl Session {
    /// The session of a program that calls the library: nothing is printed but progress, if `bars`. [`Session::warnings`] has the
    /// warnings.
    pub fn of_caller(bars: bool) -> Session {
        Session {
            quiet: true,
            json: true,
            output: Output {
                bars_shown: Some(bars),
                collected: Some(Arc::default()),
                ..Output::default()
            },
            ..Session::default()
        }
    }

    /// The warnings so far of a session of [`Session::of_caller`]; of any other there are none.
    pub fn warnings(&self) -> Vec<String> {
        let collected = self.output.collected.as_ref();
        collected.map_or(Vec::new(), |collected| {
            let collected = collected.lock().expect("no one panics while adding a line");
            collected.clone()
        })
    }

    /// The session of one scan of a run: its words go to `file`, warnings to the terminal too.
    pub fn logged(&self, scan: &str, file: PathBuf) -> Session {
        Session {
            scan: Some(scan.to_owned()),
            quiet: self.quiet || !self.verbose,
            output: Output {
                bars_shown: Some(!self.quiet),
                log: Some(Arc::new(Mutex::new(Log::new(file)))),
                ..self.output.clone()
            },
            ..self.clone()
        }
    }

    /// A session that says a warning of the first scan only; [`Session::repeated_warnings`] has the others.
    pub fn with_warnings_once(&self) -> Session {
        Session {
            output: Output {
                warned: Some(Arc::default()),
                ..self.output.clone()
            },
            ..self.clone()
        }
    }

    /// Says which other scans each warning was of.
    pub fn repeated_warnings(&self) {
        let Some(warned) = &self.output.warned else {
            return;
        };
        let warned = warned.lock().expect("no one panics while adding a line");
        let repeated = warned.groups().filter(|alike| alike.scans.len() > 1);
        for alike in repeated {
            self.put_warning(format!(
                "of {} scans ({}): {}",
                alike.scans.len(),
                shortened(&alike.scans),
                alike.of_all()
            ));
        }
    }

    /// One line on stderr, unless quiet.
    pub fn say(&self, line: impl AsRef<str>) {
        self.note(line.as_ref());
        if !self.quiet {
            self.put(line.as_ref());
        }
    }

    /// A result: one line on stdout, also when quiet. On stderr, unless quiet, where stdout is for JSON; of a scan of a run
    /// only in its log.
    pub fn result(&self, line: impl AsRef<str>) {
        self.note(line.as_ref());
        let of_run = self.scan.is_some() && !self.verbose;
        match self.json {
            true if !self.quiet => self.put(line.as_ref()),
            false if !of_run => self.output.bars.suspend(|| {
                let _ = writeln!(std::io::stdout(), "{}", line.as_ref());
            }),
            _ => {}
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
        let line = line.as_ref();
        self.note(&format!("warning: {line}"));
        if let (Some(warned), Some(scan)) = (&self.output.warned, scan)
            && !self.verbose
        {
            let mut warned = warned.lock().expect("no one panics while adding a line");
            if !warned.add(line, scan) {
                return;
            }
        }
        let scan = scan.map_or(String::new(), |s| format!("{s}: "));
        self.put_warning(format!("{scan}{line}"));
    }

    fn put_warning(&self, line: String) {
        match &self.output.collected {
            Some(collected) => {
                let mut collected = collected.lock().expect("no one panics while adding a line");
                collected.push(line);
            }
            None => self.put(&format!("warning: {line}")),
        }
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
        self.logging(|log| log.add(line));
    }

    /// Writes what the log still holds back, making its folder.
    pub fn flush(&self) {
        self.logging(Log::flush);
    }

    fn logging(&self, act: impl FnOnce(&mut Log)) {
        if let Some(log) = &self.output.log
            && !self.dry_run
        {
            act(&mut log.lock().expect("no one panics while writing a line"));
        }
    }

    /// A progress bar over `len` steps, shown at once and kept to one line of the terminal; hidden when quiet or when stderr is
    /// not a terminal.
    pub fn bar(&self, len: u64, label: &str) -> ProgressBar {
        let shown = self.output.bars_shown.unwrap_or(!self.quiet);
        if !shown || !std::io::stderr().is_terminal() {
            return ProgressBar::with_draw_target(Some(len), ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template(
            "{prefix:.28} {bar:16} {percent:>3} % {elapsed_precise} {wide_msg}",
        )
        .expect("a fixed template");
        let prefix = match &self.scan {
            Some(scan) => format!("{scan} {label}"),
            None => label.to_owned(),
        };
        let bar = self.output.bars.add(ProgressBar::new(len));
        bar.set_style(style);
        bar.set_prefix(prefix);
        bar.tick();
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }
}

/// Names as far as one line of a terminal reads well.
fn shortened(names: &[String]) -> String {
    match names {
        [first @ .., _] if names.len() > 6 => format!("{}, …", first[..5].join(", ")),
        all => all.join(", "),
    }
}
