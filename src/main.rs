//! The program: words in, exit code out. 0 done; 1 not converged, or some scans failed; 2 usage or unreadable input.

mod cli;

use bonepd_ct::command::Outcome;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    bonepd_ct::machine::host::give_freed_memory_back();
    match cli::run() {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::NotConverged) => {
            put(
                "warning: not all that was asked for was reached (see the warnings above): the results are written, and their rows say so",
            );
            ExitCode::from(1)
        }
        Ok(Outcome::SomeFailed(scans)) => {
            put(&format!("error: failed: {}", scans.join(", ")));
            ExitCode::from(1)
        }
        Err(error) => {
            put(&format!("error: {error}"));
            ExitCode::from(2)
        }
    }
}

/// One line on stderr. Nobody may be reading it any more.
fn put(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}
