//! `completions`: words for the shell.

use super::Cli;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// Print a completion script for your shell
///
/// For bash: bonepd-ct completions bash > ~/.local/share/bash-completion/completions/bonepd-ct
#[derive(Args)]
pub struct CompletionsArgs {
    shell: Shell,
}

pub fn run(args: &CompletionsArgs) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "bonepd-ct", &mut script);
    use std::io::Write;
    let _ = std::io::stdout().write_all(&script);
    Ok(Outcome::Done)
}
