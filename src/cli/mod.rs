//! The command line: one file per verb. Words become validated plain data here; the library does the rest.

mod columns;
mod completions;
mod hints;
mod info;
mod lattice;
mod man;
mod phantom;
mod recipe;
mod report;
mod run;
mod scene;
mod segment;
mod settings;
mod solve;
mod words;

use bonepd_ct::command::Outcome;
use bonepd_ct::error::{Error, Result};
use bonepd_ct::machine::session::Session;
use clap::{Args, Parser, Subcommand};
use serde::Serialize;
use std::ffi::OsString;
use std::io::Write;

/// From a μCT scan of trabecular bone to its apparent stiffness, with a stated error.
///
/// A scan goes through four steps, each a command of its own: `segment` finds the bone, `lattice` lays lattices over it,
/// `solve` compresses them and computes the apparent modulus E_app, `report` turns the results of many scans into tables and
/// figures. `run` does all four from a recipe file, on one scan or on a folder of scans.
#[derive(Parser)]
#[command(name = "bonepd-ct", version, after_help = EXAMPLES, max_term_width = 110)]
pub struct Cli {
    #[command(flatten)]
    shared: Shared,
    #[command(subcommand)]
    verb: Verb,
}

const EXAMPLES: &str = "\
Examples:
  bonepd-ct run quick scan.nii.gz -o out
  bonepd-ct segment slices/ -o out --spacing 0.0195 --gaussian 1 --lower 63
  bonepd-ct solve out --young-mpa 1000 --poisson 0.3
  bonepd-ct report out -o out/report

Exit code: 0 done; 1 not converged, or some scans failed (results written, marked); 2 usage or unreadable input.
Results go to stdout, progress and warnings to stderr. `bonepd-ct columns` says what the columns of the tables mean.
Units: mm, N, MPa, s. A negative strain is compression.";

/// Flags of every command.
#[derive(Args)]
struct Shared {
    /// Threads to compute with [default: one per core]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..), help_heading = "Shared")]
    threads: Option<u16>,
    /// No progress and no remarks: results on stdout, warnings and errors on stderr
    #[arg(long, global = true, help_heading = "Shared")]
    quiet: bool,
    /// More detail; in a run also the results of each solve
    #[arg(
        short,
        long,
        global = true,
        conflicts_with = "quiet",
        help_heading = "Shared"
    )]
    verbose: bool,
    /// Print the result as JSON on stdout, and nothing else there
    #[arg(long, global = true, help_heading = "Shared")]
    json: bool,
    /// Check the input and say what would be done; write nothing
    #[arg(long, global = true, help_heading = "Shared")]
    dry_run: bool,
    /// Recompute even where results are up to date
    #[arg(long, global = true, help_heading = "Shared")]
    force: bool,
}

#[derive(Subcommand)]
enum Verb {
    Segment(segment::SegmentArgs),
    Lattice(lattice::LatticeArgs),
    Solve(solve::SolveArgs),
    Report(report::ReportArgs),
    Run(Box<run::RunArgs>),
    Phantom(phantom::PhantomArgs),
    Info(info::InfoArgs),
    Scene(scene::SceneArgs),
    Recipe(recipe::RecipeArgs),
    Columns(columns::ColumnsArgs),
    Completions(completions::CompletionsArgs),
    Man(man::ManArgs),
}

/// The program: words in (its own name is the first), exit code out. 0 done; 1 not converged, or some scans failed; 2 usage or
/// unreadable input.
pub fn program(words: impl IntoIterator<Item = OsString>) -> u8 {
    match run(words) {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::NotConverged) => {
            put(
                "warning: not all that was asked for was reached (see the warnings above): the results are written, and their rows say so",
            );
            1
        }
        Ok(Outcome::SomeFailed(scans)) => {
            put(&format!("error: failed: {}", scans.join(", ")));
            1
        }
        Err(error) => {
            put(&format!("error: {error}"));
            2
        }
    }
}

/// One line on stderr. Nobody may be reading it any more.
fn put(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Parses the words and carries out the command. Bad usage ends the process here with clap's message, a hint where there is
/// one, and exit code 2.
fn run(words: impl IntoIterator<Item = OsString>) -> Result<Outcome> {
    let cli = Cli::try_parse_from(words).unwrap_or_else(|error| refuse(error));
    if cli.verb.keeps_what_it_finished() {
        bonepd_ct::machine::interrupt::say_how_to_go_on();
    }
    let session = session(&cli.shared)?;
    let json = cli.shared.json;
    match &cli.verb {
        Verb::Segment(args) => segment::run(args, &session, json),
        Verb::Lattice(args) => lattice::run(args, &session, json),
        Verb::Solve(args) => solve::run(args, &session, json),
        Verb::Report(args) => report::run(args, &session, json),
        Verb::Run(args) => run::run(args, &session, json),
        Verb::Phantom(args) => phantom::run(args, &session, json),
        Verb::Info(args) => info::run(args, json),
        Verb::Scene(args) => scene::run(args, &session, json),
        Verb::Recipe(args) => recipe::run(args),
        Verb::Columns(args) => columns::run(args, json),
        Verb::Completions(args) => completions::run(args),
        Verb::Man(args) => man::run(args),
    }
}

/// Prints what clap says, help and version among it, and ends the process. Where there is a hint, it stands instead of what
/// clap guesses from the spelling.
fn refuse(mut error: clap::Error) -> ! {
    let hint = hints::hint(&error);
    if hint.is_some() {
        for kind in hints::GUESSES {
            error.remove(kind);
        }
    }
    let _ = error.print();
    if let Some(words) = hint {
        let _ = writeln!(std::io::stderr(), "\nhint: {words}");
    }
    std::process::exit(error.exit_code())
}

impl Verb {
    /// Stopped, the same command goes on from there.
    fn keeps_what_it_finished(&self) -> bool {
        matches!(self, Verb::Run(_) | Verb::Solve(_))
    }
}

fn session(shared: &Shared) -> Result<Session> {
    if let Some(n) = shared.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(n.into())
            .build_global()
            .map_err(|e| Error::setting("--threads", e.to_string(), "ask for fewer"))?;
    }
    Ok(Session {
        threads: shared.threads.map(usize::from),
        quiet: shared.quiet,
        verbose: shared.verbose,
        json: shared.json,
        dry_run: shared.dry_run,
        force: shared.force,
        ..Session::default()
    })
}

/// The result on stdout. A closed pipe is the reader's choice, not an error.
fn print_json(result: &impl Serialize) {
    let text = serde_json::to_string_pretty(result).expect("results are plain data");
    let _ = writeln!(std::io::stdout(), "{text}");
}
