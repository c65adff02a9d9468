//! What a new three-dimensional discretisation costs: `one_point.patch` is one (a file, an arm with its word, a row of laws). It
//! is applied to a copy of the project, built, held to the laws and run.

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Files that the patch adds, and those that it changes.
fn touched(patch: &str) -> [Vec<&str>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    let mut old = "";
    for line in patch.lines() {
        if let Some(name) = line.strip_prefix("--- ") {
            old = name;
        } else if let Some(name) = line.strip_prefix("+++ b/") {
            found[usize::from(old != "/dev/null")].push(name);
        }
    }
    found
}

#[test]
fn a_new_discretisation_is_one_file_an_arm_with_its_word_and_a_row_of_laws() {
    let patch = std::fs::read_to_string(root().join("tests/one_point.patch")).unwrap();
    let [added, changed] = touched(&patch);
    assert_eq!(added, ["src/pipeline/apparent/one_point.rs"]);
    assert_eq!(
        changed,
        [
            "src/pipeline/apparent/mod.rs",
            "src/result/settings.rs",
            "tests/laws.rs"
        ]
    );
    let lines = |sign: char| {
        let outside = |l: &&str| !l.starts_with("---") && !l.starts_with("+++");
        let lines = patch.lines().filter(|l| l.starts_with(sign));
        lines.filter(outside).count()
    };
    let file = patch.split("diff --git ").find(|d| d.contains("/dev/null"));
    let own = file.unwrap().lines().filter(|l| l.starts_with('+')).count();
    assert!(
        lines('+') - own <= 16,
        "{} lines beside its file",
        lines('+') - own
    );
    assert!(lines('-') <= 2);
    // Where git is not installed, the other test says whether the patch applies.
    let mut git = Command::new("git");
    let check = git.args(["apply", "--check", "tests/one_point.patch"]);
    if let Ok(out) = check.current_dir(root()).output() {
        let words = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{words}");
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        std::fs::copy(from, to).unwrap();
        return;
    }
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let name = entry.unwrap().file_name();
        copy(&from.join(&name), &to.join(&name));
    }
}

fn done(command: &mut Command) -> String {
    let out = command.output().unwrap();
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    let words = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{command:?}\n{said}\n{words}");
    said
}

/// Built in `target/extension`, which is kept: the first time with all dependencies.
#[test]
#[ignore = "builds a patched copy of the project: 5 to 20 minutes"]
fn a_new_discretisation_builds_obeys_the_laws_and_solves() {
    let dir = tempfile::tempdir().unwrap();
    let copied = [
        "Cargo.toml",
        "Cargo.lock",
        "src",
        "tests",
        "pipelines",
        "reports",
        "README.md",
    ];
    for name in copied {
        copy(&root().join(name), &dir.path().join(name));
    }
    let patch = root().join("tests/one_point.patch");
    done(
        Command::new("git")
            .arg("apply")
            .arg(&patch)
            .current_dir(&dir),
    );
    let target = root().join("target/extension");
    let cargo = |words: &[&str]| {
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(words).current_dir(&dir);
        cargo.env("CARGO_TARGET_DIR", &target);
        done(&mut cargo)
    };
    let said = cargo(&["test", "--release", "--test", "all", "laws::"]);
    assert!(said.contains("test result: ok"), "{said}");
    cargo(&["build", "--release", "--bin", "bonepd-ct"]);
    let program = target.join("release/bonepd-ct");
    let (scan, out) = (dir.path().join("scan.nii.gz"), dir.path().join("out"));
    let (scan, out) = (scan.to_str().unwrap(), out.to_str().unwrap());
    let run = |words: &[&str]| done(Command::new(&program).args(words));
    let size = ["--size-mm", "1.5", "--spacing-mm", "0.05", "--bvtv", "0.3"];
    run(&[&["phantom", "-o", scan], &size[..]].concat());
    run(&["segment", scan, "-o", out, "--otsu"]);
    let e_app = |method: &str| {
        run(&["solve", out, "--method", method]);
        let table = std::fs::read_to_string(Path::new(out).join("results.csv")).unwrap();
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let column = reader
            .headers()
            .unwrap()
            .iter()
            .position(|h| h == "e_app_mpa");
        let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
        let row = rows.iter().find(|row| &row[1] == method).expect("its row");
        row[column.unwrap()].parse::<f64>().unwrap()
    };
    let (full, one_point) = (e_app("voxel-fe"), e_app("one-point"));
    // One point bends too easily: softer than full integration, by less than its coarse elements are stiff.
    assert!(
        one_point < full && one_point > 0.5 * full,
        "{one_point} {full}"
    );
}
