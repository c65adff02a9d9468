//! The layers of `src/lib.rs`: a file imports from lower layers only, or from its own folder.

use std::fs;
use std::path::{Path, PathBuf};

/// The table in the crate's root. `cli` and `main` are the binary: they see the library by its name only.
const LAYERS: [(&str, u32); 15] = [
    ("error", 0),
    ("par", 0),
    ("simd", 0),
    ("grid", 1),
    ("volume", 2),
    ("mask", 3),
    ("topology", 4),
    ("operator", 5),
    ("physics", 6),
    ("solve", 6),
    ("measure", 7),
    ("stage", 8),
    ("recipe", 9),
    ("io", 10),
    ("run", 11),
];

fn layer(module: &str) -> Option<u32> {
    LAYERS
        .iter()
        .find(|(name, _)| *name == module)
        .map(|(_, n)| *n)
}

/// Names of the top-level modules that a source text refers to as `crate::NAME` or `crate::{NAME, ..}`, comments aside.
fn imports(source: &str) -> Vec<String> {
    let code: String = source
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .map(|line| format!("{line}\n"))
        .collect();
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        // `$crate::` and `other_crate::` are not this crate's modules.
        if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let rest = &code[at + "crate::".len()..];
        match rest.strip_prefix('{') {
            Some(group) => found.extend(group_heads(group)),
            None => found.push(head(rest)),
        }
    }
    found
}

/// First names of the top-level entries of a `{a::b, c::{d, e}}` group.
fn group_heads(group: &str) -> Vec<String> {
    let (mut depth, mut start, mut heads) = (0, 0, Vec::new());
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                heads.push(head(group[start..at].trim_start()));
                start = at + 1;
            }
            _ => {}
        }
        if c == '}' && start == at + 1 {
            break;
        }
    }
    heads.retain(|h| !h.is_empty());
    heads
}

fn head(path: &str) -> String {
    path.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

fn sources(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// `src/solve/cg.rs` and `src/solve/mod.rs` belong to `solve`, `src/grid.rs` to `grid`.
fn module_of(file: &Path, src: &Path) -> String {
    let inside = file.strip_prefix(src).unwrap();
    let first = inside
        .components()
        .next()
        .unwrap()
        .as_os_str()
        .to_str()
        .unwrap();
    first.trim_end_matches(".rs").to_owned()
}

/// What is wrong with a file of `module` that imports `imported`, if anything.
fn violation(module: &str, imported: &str) -> Option<String> {
    let (Some(from), Some(to)) = (layer(module), layer(imported)) else {
        return Some(format!(
            "`{module}` or `{imported}` is not in the table of layers"
        ));
    };
    let fine = to < from || module == imported;
    (!fine).then(|| format!("`{module}` (layer {from}) imports `{imported}` (layer {to})"))
}

#[test]
fn imports_point_one_way() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    assert!(files.len() > 10, "found only {} sources", files.len());
    let mut wrong = Vec::new();
    for file in &files {
        let module = module_of(file, &src);
        if ["lib", "main", "cli"].contains(&module.as_str()) {
            continue;
        }
        for imported in imports(&fs::read_to_string(file).unwrap()) {
            if let Some(words) = violation(&module, &imported) {
                wrong.push(format!("{}: {words}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_table_is_the_one_in_the_crates_root() {
    let root =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap();
    for (module, number) in LAYERS {
        let row = root
            .lines()
            .find(|line| line.starts_with("//! |") && line.contains(&format!("[`{module}`]")))
            .unwrap_or_else(|| panic!("`{module}` is not in the table of src/lib.rs"));
        assert!(row.starts_with(&format!("//! | {number} |")), "{row}");
    }
    let declared = root
        .lines()
        .filter(|line| line.starts_with("pub mod "))
        .count();
    assert_eq!(declared, LAYERS.len());
}

#[test]
fn upward_and_sideways_imports_are_seen() {
    let planted = "// use crate::command::x;\nuse crate::{grid::Grid, io::{a, b}};\nlet x = crate::physics::E;\nuse other_crate::run;";
    assert_eq!(imports(planted), ["grid", "io", "physics"]);
    assert!(violation("solve", "grid").is_none());
    assert!(violation("solve", "solve").is_none());
    assert!(violation("solve", "physics").is_some());
    assert!(violation("solve", "io").is_some());
    assert!(violation("error", "par").is_some());
}
