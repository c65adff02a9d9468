//! `recipe`: the recipes that are in the program.

use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::recipe::{BUILT_IN, SCENES, built_in};
use clap::Args;
use std::io::Write;

/// Print a recipe or a scene that is in the program, to keep and change; without a name, list them
///
/// `bonepd-ct recipe paper > paper.toml`; `bonepd-ct run paper SCAN -o OUT` uses it unchanged.
#[derive(Args)]
pub struct RecipeArgs {
    /// Name of the recipe or scene
    name: Option<String>,
}

pub fn run(args: &RecipeArgs) -> Result<Outcome> {
    let text = match &args.name {
        Some(name) => built_in::any(name)?.to_owned(),
        None => {
            let lines = |files: &[(&str, &str)]| -> String {
                files.iter().map(|(name, text)| line(name, text)).collect()
            };
            format!(
                "recipes of `bonepd-ct run`:\n{}\nscenes of `bonepd-ct scene`:\n{}",
                lines(BUILT_IN),
                lines(SCENES)
            )
        }
    };
    let _ = std::io::stdout().write_all(text.as_bytes());
    Ok(Outcome::Done)
}

/// The name, and the first sentence of the recipe's own words.
fn line(name: &str, text: &str) -> String {
    let words = text.lines().map_while(|line| line.strip_prefix("# "));
    let words = words.collect::<Vec<_>>().join(" ");
    let is_end = |at: usize| {
        let next = words[at + 2..].chars().next();
        next.is_none_or(char::is_uppercase)
    };
    let end = words
        .match_indices(". ")
        .map(|(at, _)| at)
        .find(|at| is_end(*at));
    format!(
        "{name:<40} {}\n",
        &words[..end.map_or(words.len(), |at| at + 1)]
    )
}
