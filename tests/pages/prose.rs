//! Words that the project does not use: private or old ones that a reader has to decode.

use super::{files, pages, root};
use std::path::Path;

/// Whole words and phrases.
const WORDS: [&str; 27] = [
    "amid",
    "anew",
    "apiece",
    "beside",
    "besides",
    "betwixt",
    "came by",
    "come by",
    "foretold",
    "forthwith",
    "had back",
    "henceforth",
    "hitherto",
    "in vain",
    "lest",
    "nought",
    "thence",
    "thereof",
    "therein",
    "told",
    "untold",
    "whence",
    "whereby",
    "wherein",
    "whereof",
    "whilst",
    "yield its",
];

/// Comments and texts of a line of source; code itself may name its variables as it likes.
fn prose(line: &str) -> String {
    let (code, comment) = line.split_once("//").unwrap_or((line, ""));
    let code = code.replace("\\\"", " ");
    let texts: Vec<&str> = code.split('"').skip(1).step_by(2).collect();
    let all = format!("{} {comment}", texts.join(" "));
    // `{told}` in a text is a variable.
    let mut shown = String::new();
    let mut depth = 0;
    for c in all.chars() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            c if depth <= 0 => shown.push(c),
            _ => {}
        }
    }
    shown
}

/// The word of [`WORDS`] in a text, if there is one.
fn found(text: &str) -> Option<&'static str> {
    let text = text.to_lowercase();
    let is_whole = |word: &str, at: usize| {
        let letter = |c: char| c.is_alphanumeric() || c == '_';
        !text[..at].ends_with(letter) && !text[at + word.len()..].starts_with(letter)
    };
    let has = |word: &&&str| text.match_indices(**word).any(|(at, _)| is_whole(word, at));
    WORDS.iter().find(has).copied()
}

fn lines_with_words(path: &Path, text: &str, is_source: bool) -> Vec<String> {
    let lines = text.lines().enumerate();
    lines
        .filter_map(|(i, line)| {
            let word = match is_source {
                true => found(&prose(line)),
                false => found(line),
            }?;
            Some(format!(
                "{}:{}: `{word}`: {}",
                path.display(),
                i + 1,
                line.trim()
            ))
        })
        .collect()
}

#[test]
fn words_are_plain() {
    let mut wrong = Vec::new();
    for (path, page) in pages() {
        wrong.extend(lines_with_words(&path, &page, false));
    }
    for path in files(&root().join("src"), &[".rs", ".html"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        let shown = path.strip_prefix(root()).unwrap();
        wrong.extend(lines_with_words(shown, &text, true));
    }
    for path in files(&root().join("pipelines"), &[".toml", "Snakefile", ".py"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        wrong.extend(lines_with_words(
            path.strip_prefix(root()).unwrap(),
            &text,
            false,
        ));
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn planted_words_are_seen() {
    assert_eq!(found("It is made Anew."), Some("anew"));
    assert_eq!(found("what it was told;"), Some("told"));
    assert_eq!(found("besides"), Some("besides"));
    assert_eq!(found("a renewal of retold tales"), None);
    assert_eq!(found(&prose("let told = 1; // fine")), None);
    assert_eq!(found(&prose("let x = 1; // as told")), Some("told"));
    assert_eq!(found(&prose("println!(\"{told} of\");")), None);
    assert_eq!(found(&prose("println!(\"as told {x}\");")), Some("told"));
}
