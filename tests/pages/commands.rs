//! Command lines of the pages: the built program understands each.

use super::{pages, root, spans};
use crate::cli::{VERBS, bonepd, run};
use std::collections::BTreeSet;

/// Command lines in blocks of code, fenced or indented, with the number of their line: the words after the program's name.
fn commands(page: &str) -> Vec<(usize, Vec<String>)> {
    let mut found = Vec::new();
    let mut is_shell = false;
    for (i, line) in page.lines().enumerate() {
        let is_indented = line.starts_with("    ");
        let line = line.trim();
        if let Some(language) = line.strip_prefix("```") {
            is_shell = !is_shell && language == "sh";
        } else if is_shell || is_indented {
            let after = line
                .strip_prefix("bonepd-ct ")
                .or_else(|| line.strip_prefix("cargo run --release -- "));
            found.extend(after.map(|rest| (i + 1, words(rest))));
        }
    }
    found
}

/// The words of a command line as a shell takes them apart, up to a comment, a pipe or a redirection.
fn words(line: &str) -> Vec<String> {
    let mut all = Vec::new();
    let mut word = String::new();
    let mut quote = None;
    for c in line.chars() {
        match (quote, c) {
            (Some(q), c) if c == q => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '#' | '|' | '>') if word.is_empty() => return all,
            (None, ' ') if word.is_empty() => {}
            (None, ' ') => all.push(std::mem::take(&mut word)),
            _ => word.push(c),
        }
    }
    if !word.is_empty() {
        all.push(word);
    }
    all
}

/// What clap says of a line that it does not understand.
const UNUSABLE: &str = "For more information, try '--help'";

/// Why the program does not understand `words`, if so. Nothing is computed: inputs do not exist in `dir`, and `--dry-run` writes nothing.
fn refused(words: &[String], dir: &std::path::Path) -> Option<String> {
    let output = bonepd()
        .args(words.iter().filter(|word| *word != "--dry-run"))
        .arg("--dry-run")
        .current_dir(dir)
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    // A recipe of the reader's own, or RECIPE for any.
    let own_recipe = words
        .iter()
        .any(|w| w == "RECIPE" || w.ends_with(".toml") && !w.starts_with("pipelines/"));
    let no_recipe = !own_recipe && stderr.contains("expected a recipe");
    let is_wrong = stderr.contains(UNUSABLE) || no_recipe || output.status.code() == Some(101);
    is_wrong.then_some(stderr)
}

/// An empty folder but for the recipes.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let to = dir.path().join("pipelines");
    std::fs::create_dir(&to).unwrap();
    for entry in std::fs::read_dir(root().join("pipelines")).unwrap() {
        let path = entry.unwrap().path();
        if path.is_file() {
            std::fs::copy(&path, to.join(path.file_name().unwrap())).unwrap();
        }
    }
    dir
}

#[test]
fn commands_in_blocks_are_understood() {
    let dir = folder();
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (path, page) in pages() {
        for (line, words) in commands(&page) {
            seen += 1;
            if let Some(why) = refused(&words, dir.path()) {
                wrong.push(format!(
                    "{}:{line}: {}\n{why}",
                    path.display(),
                    words.join(" ")
                ));
            }
        }
    }
    assert!(seen > 60, "found only {seen} commands");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Commands within a line may lack arguments; what they have must exist.
#[test]
fn commands_in_text_are_understood() {
    let dir = folder();
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (path, page) in pages() {
        for (line, text) in spans(&page) {
            let Some(rest) = text.strip_prefix("bonepd-ct ") else {
                continue;
            };
            seen += 1;
            if let Some(why) = refused(&words(rest), dir.path()) {
                let placeholder = why
                    .split_once("invalid value '")
                    .is_some_and(|(_, v)| v.starts_with(|c: char| c.is_uppercase()));
                if !placeholder && !why.contains("required arguments were not provided") {
                    wrong.push(format!("{}:{line}: {text}\n{why}", path.display()));
                }
            }
        }
    }
    assert!(seen > 15, "found only {seen} commands");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Options of all commands, as their help lists them.
fn known_options() -> BTreeSet<String> {
    let mut known = BTreeSet::new();
    for verb in VERBS {
        let (_, help, _) = run(&[verb, "--help"]);
        known.extend(options(&help).into_iter().map(str::to_owned));
    }
    known
}

/// Words that begin with `--` and a letter.
fn options(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices("--") {
        let begins = !text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '-');
        let rest = &text[at + 2..];
        let end = rest
            .find(|c: char| !(c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-'))
            .unwrap_or(rest.len());
        if begins && end > 0 && rest.starts_with(|c: char| c.is_ascii_lowercase()) {
            found.push(text[at..at + 2 + end].trim_end_matches('-'));
        }
    }
    found
}

/// Programs whose own options stand in the pages: their lines are left out.
const OTHERS: [&str; 8] = [
    "cargo",
    "chromium",
    "git ",
    "pip ",
    "python3",
    "snakemake",
    "sbatch",
    "rustup",
];

/// Options of other programs on lines that do not name them.
const OTHER_OPTIONS: [&str; 5] = [
    "--bodies",
    "--call-graph",
    "--include-ignored",
    "--no-children",
    "--tol",
];

#[test]
fn options_in_the_pages_exist() {
    let known = known_options();
    assert!(known.len() > 80, "{known:?}");
    let mut wrong = Vec::new();
    for (path, page) in pages() {
        for (i, line) in page.lines().enumerate() {
            if OTHERS.iter().any(|other| line.contains(other)) {
                continue;
            }
            for option in options(line) {
                if !known.contains(option) && !OTHER_OPTIONS.contains(&option) {
                    wrong.push(format!("{}:{}: {option}", path.display(), i + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn planted_faults_are_seen() {
    let page = "```sh\nbonepd-ct solve \"a b\" --lp '0.1,0.2'   # why\n```\n`x`";
    let found = commands(page);
    assert_eq!(found[0].1, ["solve", "a b", "--lp", "0.1,0.2"]);
    let dir = folder();
    let refused = |line: &str| refused(&words(line), dir.path());
    assert!(refused("solve a --lattice-parameter 0.1").is_some());
    assert!(refused("run papre scans -o out").is_some());
    assert!(refused("run paper scans -o out").is_none());
    assert_eq!(
        options("`--error 3%`, --no-such; a--b"),
        ["--error", "--no-such"]
    );
}
