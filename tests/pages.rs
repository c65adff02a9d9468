//! The pages of the project: their links lead somewhere, their commands are understood, their words are plain.

mod commands;
mod links;
mod paper;
mod prose;

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All files below `folder` whose name ends so, in order; build folders are not entered.
fn files(folder: &Path, ends: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !name.starts_with(['.', '_']) {
                found.extend(files(&path, ends));
            }
        } else if ends.iter().any(|end| name.ends_with(end)) {
            found.push(path);
        }
    }
    found
}

/// Every Markdown page that a reader may open, relative to the root, with its text.
fn pages() -> Vec<(PathBuf, String)> {
    let mut paths = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "paper.md"]
        .map(|name| root().join(name))
        .to_vec();
    for folder in ["docs", "reports", "pipelines", "sample_data"] {
        paths.extend(files(&root().join(folder), &[".md"]));
    }
    assert!(paths.len() > 20, "found only {} pages", paths.len());
    paths
        .into_iter()
        .map(|path| {
            let text =
                fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            (path.strip_prefix(root()).unwrap().to_path_buf(), text)
        })
        .collect()
}

/// Texts between single backticks, with the number of their line; blocks of code are left out.
fn spans(page: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut is_code = false;
    for (i, line) in page.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            found.extend(line.split('`').skip(1).step_by(2).map(|text| (i + 1, text)));
        }
    }
    found
}
