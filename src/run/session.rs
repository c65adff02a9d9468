//! Owns what all commands share: how loud, how many threads, whether to redo or only to say what would be done.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// The shared flags, as plain data.
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
}

impl Session {
    /// One line on stderr, unless quiet.
    pub fn say(&self, line: impl AsRef<str>) {
        if !self.quiet {
            eprintln!("{}", line.as_ref());
        }
    }

    /// One line on stderr, only with `-v`.
    pub fn detail(&self, line: impl AsRef<str>) {
        if self.verbose && !self.quiet {
            eprintln!("{}", line.as_ref());
        }
    }

    /// A warning on stderr. Shown even when quiet: it changes how a result is read.
    pub fn warn(&self, line: impl AsRef<str>) {
        eprintln!("warning: {}", line.as_ref());
    }

    /// A progress bar over `len` steps; hidden when quiet or when stderr is not a terminal.
    pub fn bar(&self, len: u64, label: &str) -> ProgressBar {
        let target = if self.quiet || !std::io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let style =
            ProgressStyle::with_template("{prefix:<24} {bar:28} {pos}/{len} {msg} {elapsed}")
                .expect("a fixed template");
        ProgressBar::with_draw_target(Some(len), target)
            .with_style(style)
            .with_prefix(label.to_owned())
    }
}
