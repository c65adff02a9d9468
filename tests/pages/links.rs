//! Links, and files that pages name.

use super::{pages, root, spans};
use std::path::Path;

/// Targets of `[text](target)`, with the number of their line.
fn targets(page: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    for (i, line) in page.lines().enumerate() {
        for (at, _) in line.match_indices("](") {
            let rest = &line[at + 2..];
            if let Some(end) = rest.find(')') {
                found.push((i + 1, &rest[..end]));
            }
        }
    }
    found
}

/// The names by which headings are linked.
fn anchors(page: &str) -> Vec<String> {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    let name = |line: &str| -> String {
        let text = line.trim_start_matches('#').trim().to_lowercase();
        let kept = text
            .chars()
            .filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(name).collect()
}

/// Why a link of the page at `from` leads nowhere, if so.
fn broken(from: &Path, page: &str, target: &str) -> Option<String> {
    if target.contains("://") || target.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = match target.split_once('#') {
        Some((file, anchor)) => (file, Some(anchor)),
        None => (target, None),
    };
    let path = root().join(from).parent().unwrap().join(file);
    if !file.is_empty() && !path.exists() {
        return Some(format!("{} does not exist", path.display()));
    }
    let anchor = anchor?;
    let text = match file.is_empty() {
        true => page.to_owned(),
        false => std::fs::read_to_string(&path).ok()?,
    };
    let known = anchors(&text);
    (!known.iter().any(|a| a == anchor)).then(|| format!("no heading `{anchor}` among {known:?}"))
}

#[test]
fn links_lead_somewhere() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (path, page) in pages() {
        for (line, target) in targets(&page) {
            seen += 1;
            if let Some(why) = broken(&path, &page, target) {
                wrong.push(format!("{}:{line}: {target}: {why}", path.display()));
            }
        }
    }
    assert!(seen > 80, "found only {seen} links");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// Folders whose files are named by their path from the root.
const FOLDERS: [&str; 6] = [
    "src/",
    "tests/",
    "docs/",
    "reports/",
    "pipelines/",
    "sample_data/",
];

/// Of other repositories.
const ELSEWHERE: &str = "tests/fixtures/fea_reference/";

#[test]
fn files_that_pages_name_exist() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (path, page) in pages() {
        for (line, text) in spans(&page) {
            let word = text.split_whitespace().next().unwrap_or_default();
            let is_path = FOLDERS.iter().any(|folder| word.starts_with(folder));
            // `src/**`, `pipelines/NAME.toml` stand for several.
            let is_one = !word.contains(['*', '{', '<']) && !word.contains("NAME");
            let is_path = is_path && !word.starts_with(ELSEWHERE);
            if is_path && is_one {
                seen += 1;
                let word = word
                    .split("::")
                    .next()
                    .unwrap()
                    .trim_end_matches([',', ':']);
                if !root().join(word).exists() {
                    wrong.push(format!("{}:{line}: {word}", path.display()));
                }
            }
        }
    }
    assert!(seen > 60, "found only {seen} files");
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn planted_faults_are_seen() {
    let page =
        "# A page, of two words\n[a](gone.md) ![b](README.md#there) [c](#a-page-of-two-words)";
    let found = targets(page);
    assert_eq!(
        found,
        [
            (2, "gone.md"),
            (2, "README.md#there"),
            (2, "#a-page-of-two-words")
        ]
    );
    let why = |target| broken(Path::new("README.md"), page, target);
    assert!(why("gone.md").is_some() && why("README.md#there").is_some());
    assert_eq!(why("#a-page-of-two-words"), None);
    assert_eq!(why("https://rustup.rs"), None);
}
