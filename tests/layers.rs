//! The house: the layers of `src/lib.rs`, no circles between files of a folder, folders and rooms of limited size.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The table in the crate's root. `cli` and `main` are the binary: they see the library by its name only.
const LAYERS: [(&str, u32); 27] = [
    ("error", 0),
    ("par", 0),
    ("parts", 0),
    ("simd", 0),
    ("system", 0),
    ("grid", 1),
    ("volume", 2),
    ("io", 2),
    ("format", 3),
    ("mask", 3),
    ("image", 4),
    ("discretisation", 4),
    ("operator", 5),
    ("physics", 6),
    ("solver", 6),
    ("measure", 7),
    ("result", 7),
    ("pipeline", 8),
    ("scene", 8),
    ("report", 8),
    ("recipe", 9),
    ("draw", 9),
    ("machine", 9),
    ("record", 10),
    ("export", 10),
    ("command", 11),
    ("cohort", 12),
];

/// What scan readers may import: a reader is of use outside this program.
const READERS_SEE: [&str; 6] = ["image", "format", "volume", "grid", "error", "io"];

/// Files and folders side by side in one folder.
const MAX_ENTRIES: usize = 16;

/// Share of all lines of `src` that one room may hold.
const MAX_SHARE: f64 = 0.15;

fn layer(module: &str) -> Option<u32> {
    LAYERS
        .iter()
        .find(|(name, _)| *name == module)
        .map(|(_, n)| *n)
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
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

/// A source file as a module: `src/solver/cg/mod.rs` is `["solver", "cg"]`.
#[derive(Debug)]
struct Module {
    path: Vec<String>,
    code: String,
    lines: usize,
}

/// All modules of the library and of `cli`.
fn modules() -> Vec<Module> {
    let mut files = Vec::new();
    sources(&src(), &mut files);
    assert!(files.len() > 200, "found only {} sources", files.len());
    files
        .iter()
        .filter(|f| !f.ends_with("lib.rs") && !f.ends_with("main.rs"))
        .map(|file| {
            let inside = file.strip_prefix(src()).unwrap().with_extension("");
            let mut path: Vec<String> = inside
                .iter()
                .map(|s| s.to_str().unwrap().to_owned())
                .collect();
            if path.last().is_some_and(|s| s == "mod") {
                path.pop();
            }
            let text = fs::read_to_string(file).unwrap();
            Module {
                path,
                lines: text.lines().count(),
                code: without_comments(&text),
            }
        })
        .collect()
}

fn without_comments(text: &str) -> String {
    let lines = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    lines.map(|line| format!("{line}\n")).collect()
}

/// Paths that a source text refers to as `crate::a::b` or `crate::a::{b, c::{d, e}}`, as far as their names are in lower case.
fn imports(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        // `$crate::` and `other_crate::` are not this crate's modules.
        if !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            tree(&code[at + "crate::".len()..], &[], &mut found);
        }
    }
    found
}

/// The leaves of one tree of a `use`, and how many bytes it takes.
fn tree(text: &str, prefix: &[String], found: &mut Vec<Vec<String>>) -> usize {
    let mut path = prefix.to_vec();
    let mut at = 0;
    loop {
        if text[at..].starts_with('{') {
            at += 1;
            loop {
                at += text[at..].len() - text[at..].trim_start_matches([' ', '\n', ',']).len();
                if text[at..].is_empty() || text[at..].starts_with('}') {
                    return at + 1;
                }
                let used = tree(&text[at..], &path, found);
                at += used.max(1);
            }
        }
        let name: String = text[at..]
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect();
        at += name.len();
        if !name.is_empty() && name != "self" {
            path.push(name);
        }
        if !text[at..].starts_with("::") {
            break;
        }
        at += 2;
    }
    found.push(path);
    at
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
    let mut wrong = Vec::new();
    for module in modules().iter().filter(|m| m.path[0] != "cli") {
        let room = module.path[0].as_str();
        for imported in imports(&module.code) {
            if let Some(words) = violation(room, &imported[0]) {
                wrong.push(format!("{}: {words}", module.path.join("/")));
            }
            if room == "image" && !READERS_SEE.contains(&imported[0].as_str()) {
                wrong.push(format!(
                    "{}: a reader imports `{}`",
                    module.path.join("/"),
                    imported[0]
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

/// The binary's own modules are `cli` and nothing else; the library does not know it.
#[test]
fn the_command_line_sees_the_library_by_name() {
    for module in modules() {
        let seen = imports(&module.code);
        let cli = seen.iter().any(|path| path[0] == "cli");
        assert!(!cli || module.path[0] == "cli", "{:?}", module.path);
        assert!(
            module.path[0] != "cli" || seen.iter().all(|path| path[0] == "cli"),
            "{:?} sees {seen:?}",
            module.path
        );
    }
}

/// Modules that a module refers to, among `known`: by `crate::`, by `super::`, or by the name of a child.
fn references(module: &Module, known: &BTreeSet<Vec<String>>) -> BTreeSet<Vec<String>> {
    let code = match module.code.find("#[cfg(test)]\nmod ") {
        Some(tests) => &module.code[..tests],
        None => &module.code,
    };
    let mut paths = imports(code);
    for (at, _) in code.match_indices("super::") {
        let before = &code[..at];
        if before.ends_with("super::") || before.ends_with(|c: char| c.is_alphanumeric()) {
            continue;
        }
        let rest = &code[at..];
        let up = leading(rest, "super::");
        let base = module.path.len().saturating_sub(up);
        tree(
            &rest[up * "super::".len()..],
            &module.path[..base],
            &mut paths,
        );
    }
    let longest = |path: &Vec<String>| {
        (1..=path.len())
            .rev()
            .map(|n| path[..n].to_vec())
            .find(|p| known.contains(p))
    };
    let mut found: BTreeSet<Vec<String>> = paths.iter().filter_map(longest).collect();
    found.remove(&module.path);
    found
}

/// How often `word` stands at the start of `text`, one after another.
fn leading(text: &str, word: &str) -> usize {
    let mut rest = text;
    let mut n = 0;
    while let Some(r) = rest.strip_prefix(word) {
        (rest, n) = (r, n + 1);
    }
    n
}

/// A folder, and its entries that lead back to themselves.
type Circle = (String, Vec<String>);

/// Circles between the entries of each folder, unit tests aside. A file and its own folder are one entry.
fn circles(modules: &[Module]) -> Vec<Circle> {
    let known: BTreeSet<Vec<String>> = modules.iter().map(|m| m.path.clone()).collect();
    let mut edges: BTreeMap<Vec<String>, BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
    for module in modules {
        for other in references(module, &known) {
            let shared = module
                .path
                .iter()
                .zip(&other)
                .take_while(|(a, b)| a == b)
                .count();
            if shared == 0 || shared == module.path.len() || shared == other.len() {
                continue;
            }
            let folder = edges.entry(other[..shared].to_vec()).or_default();
            let from = folder.entry(module.path[shared].clone()).or_default();
            from.insert(other[shared].clone());
        }
    }
    let leads_back = |graph: &BTreeMap<String, BTreeSet<String>>, start: &String| {
        let mut seen = BTreeSet::new();
        let mut open = vec![start];
        while let Some(at) = open.pop() {
            for next in graph.get(at).into_iter().flatten() {
                if seen.insert(next) {
                    open.push(next);
                }
            }
        }
        seen.contains(start)
    };
    let of = |(folder, graph): (&Vec<String>, &BTreeMap<String, BTreeSet<String>>)| {
        let round: Vec<String> = graph
            .keys()
            .filter(|entry| leads_back(graph, entry))
            .cloned()
            .collect();
        (!round.is_empty()).then(|| (folder.join("/"), round))
    };
    edges.iter().filter_map(of).collect()
}

#[test]
fn no_folder_holds_a_circle() {
    let found = circles(&modules());
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn folders_and_rooms_stay_small() {
    let modules = modules();
    let total: usize = modules.iter().map(|m| m.lines).sum();
    let mut rooms: BTreeMap<&str, usize> = BTreeMap::new();
    let mut entries: BTreeMap<&[String], BTreeSet<&str>> = BTreeMap::new();
    for module in &modules {
        *rooms.entry(&module.path[0]).or_default() += module.lines;
        for k in 1..module.path.len() {
            entries
                .entry(&module.path[..k])
                .or_default()
                .insert(&module.path[k]);
        }
    }
    for (room, lines) in rooms {
        let share = lines as f64 / total as f64;
        assert!(
            share <= MAX_SHARE,
            "{room}: {:.1} % of all lines",
            100.0 * share
        );
    }
    for (folder, entries) in entries {
        assert!(
            entries.len() <= MAX_ENTRIES,
            "{}: {} entries",
            folder.join("/"),
            entries.len()
        );
    }
}

#[test]
fn the_table_is_the_one_in_the_crates_root() {
    let root = fs::read_to_string(src().join("lib.rs")).unwrap();
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

/// Words of one operating system. Instruction sets (`target_arch`) are no such words.
const OF_ONE_SYSTEM: [&str; 10] = [
    "libc::",
    "std::os::",
    "/proc/",
    "/sys/",
    "/dev/",
    "cfg(unix",
    "cfg!(unix",
    "cfg(windows",
    "target_os",
    "target_vendor",
];

/// Unit tests aside: `code` up to the first of them.
fn of_one_system(code: &str) -> Option<&'static str> {
    let end = code.find("#[cfg(test)]\nmod tests").unwrap_or(code.len());
    OF_ONE_SYSTEM
        .into_iter()
        .find(|word| code[..end].contains(word))
}

#[test]
fn what_differs_between_systems_stands_in_one_file() {
    for module in modules() {
        let found = of_one_system(&module.code);
        match module.path[0].as_str() {
            "system" => assert!(found.is_some()),
            _ => assert_eq!(found, None, "{}", module.path.join("/")),
        }
    }
    assert_eq!(of_one_system("let x = cfg!(unix);"), Some("cfg!(unix"));
    assert_eq!(of_one_system("#[cfg(test)]\nmod tests { libc::x }"), None);
}

#[test]
fn upward_and_sideways_imports_are_seen() {
    let planted =
        "use crate::{grid::Grid, io::{a, b}};\nlet x = crate::physics::E;\nuse other_crate::run;";
    let heads: Vec<String> = imports(planted).iter().map(|p| p.join("::")).collect();
    assert_eq!(heads, ["grid::Grid", "io::a", "io::b", "physics::E"]);
    assert!(violation("solver", "grid").is_none());
    assert!(violation("solver", "solver").is_none());
    assert!(violation("solver", "physics").is_some());
    assert!(violation("report", "pipeline").is_some());
    assert!(violation("error", "par").is_some());
}

#[test]
fn a_planted_circle_is_seen() {
    let module = |path: &str, code: &str| Module {
        path: path.split('/').map(str::to_owned).collect(),
        code: code.to_owned(),
        lines: 1,
    };
    let round = [
        module("a/b", "use crate::a::c::d::X;"),
        module("a/c", ""),
        module("a/c/d", "use super::super::b::Y;"),
        module("a/e", "use super::b::Y;"),
    ];
    assert_eq!(
        circles(&round),
        [("a".to_owned(), vec!["b".to_owned(), "c".to_owned()])]
    );
    assert!(circles(&round[1..]).is_empty());
}
