//! The program as an executable: its words and its exit code are the command line's.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    bonepd_ct::machine::host::give_freed_memory_back();
    ExitCode::from(cli::program(std::env::args_os()))
}
