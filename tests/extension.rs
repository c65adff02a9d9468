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

/// The folder of this build, where its dependencies lie compiled.
fn own_build() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.ancestors().nth(2).unwrap().to_path_buf()
}

/// Copies what is compiled of the dependencies, times of change included: cargo goes by them. The project's own files, which
/// are of another folder there, are left out.
fn copy_dependencies(from: &Path, to: &Path) {
    let is_own = |name: &str| {
        let name = name.trim_start_matches("lib");
        name.starts_with("bonepd") || name.starts_with("all-")
    };
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name());
        if is_own(&name.to_string_lossy()) {
            continue;
        }
        if path.is_dir() {
            copy_dependencies(&path, &to.join(name));
        } else {
            std::fs::copy(&path, to.join(&name)).unwrap();
            let changed = path.metadata().unwrap().modified().unwrap();
            let copied = std::fs::File::options().append(true).open(to.join(&name));
            copied.unwrap().set_modified(changed).unwrap();
        }
    }
}

/// The patched copy of the project, and where it is built: `target/extension`, which is kept.
struct Copy {
    dir: tempfile::TempDir,
    target: PathBuf,
}

impl Copy {
    fn new() -> Copy {
        let dir = tempfile::tempdir().unwrap();
        let copied = [
            "Cargo.toml",
            "Cargo.lock",
            "src",
            "tests",
            "examples",
            "pipelines",
            "reports",
            "README.md",
        ];
        for name in copied
            .map(Path::new)
            .iter()
            .filter(|name| root().join(name).exists())
        {
            copy(&root().join(name), &dir.path().join(name));
        }
        let patch = root().join("tests/one_point.patch");
        let mut git = Command::new("git");
        done(git.arg("apply").arg(&patch).current_dir(&dir));
        // Of its tests only the laws are built.
        std::fs::write(dir.path().join("tests/all.rs"), "mod laws;\n").unwrap();
        let build = own_build();
        let target = build.parent().unwrap().join("extension");
        let release = target.join(build.file_name().unwrap());
        if !release.exists() {
            for part in [".fingerprint", "build", "deps"] {
                copy_dependencies(&build.join(part), &release.join(part));
            }
        }
        Copy { dir, target }
    }

    fn cargo(&self, words: &[&str]) -> String {
        let mut cargo = Command::new(env!("CARGO"));
        // Built to be run once: the project's own code is not optimised.
        cargo.args(["--config", "profile.release.package.bonepd-ct.opt-level=0"]);
        cargo.args(words).current_dir(&self.dir);
        cargo.env("CARGO_TARGET_DIR", &self.target);
        done(&mut cargo)
    }

    fn program(&self, words: &[&str]) {
        let program = self.target.join("release/bonepd-ct");
        done(Command::new(program).args(words));
    }

    /// E_app in MPa of the segmented scan in `out`, of voxels split `refine` times.
    fn e_app_mpa(&self, out: &str, method: &str, refine: u32) -> f64 {
        let split = refine.to_string();
        let words = [
            "--method",
            method,
            "--refine-mask",
            &split,
            "--tolerance",
            "1e-6",
        ];
        self.program(&[&["solve", out], &words[..]].concat());
        let table = std::fs::read_to_string(Path::new(out).join("results.csv")).unwrap();
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let header = reader.headers().unwrap().clone();
        let column = |name: &str| header.iter().position(|h| h == name).unwrap();
        let (method_at, size_at, e_at) = (column("method"), column("lp_mm"), column("e_app_mpa"));
        let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
        let is_it = |row: &&csv::StringRecord| {
            let size: f64 = row[size_at].parse().unwrap();
            &row[method_at] == method && (size * f64::from(refine) / VOXEL_MM - 1.0).abs() < 1e-6
        };
        // Limits of two sizes come after their rows.
        let row = rows.iter().find(is_it).expect("its row");
        row[e_at].parse().unwrap()
    }
}

const VOXEL_MM: f64 = 0.05;

/// E_app of both elements follows from their matrices: `K = K₁ + (what full integration adds against hourglass modes)`, so
/// that one point is never stiffer; under uniform strain both are exact; and both tend to the same limit.
#[test]
#[ignore = "builds a patched copy of the project: 3 to 20 minutes"]
fn a_new_discretisation_builds_obeys_the_laws_and_solves() {
    let copy = Copy::new();
    let said = copy.cargo(&["test", "--release", "--test", "all", "laws::"]);
    let passed = said.lines().find(|line| line.contains("test result: ok"));
    assert!(
        passed.is_some_and(|line| !line.contains(" 0 passed")),
        "{said}"
    );
    copy.cargo(&["build", "--release", "--bin", "bonepd-ct"]);
    let path = |name: &str| copy.dir.path().join(name).to_str().unwrap().to_owned();
    let (scan, out, solid) = (path("scan.nii.gz"), path("out"), path("solid"));
    let spacing = VOXEL_MM.to_string();
    let size = [
        "--size-mm",
        "1.5",
        "--spacing-mm",
        &spacing,
        "--bvtv",
        "0.3",
    ];
    copy.program(&[&["phantom", "-o", &scan], &size[..]].concat());
    copy.program(&["segment", &scan, "-o", &out, "--otsu"]);
    copy.program(&["segment", &scan, "-o", &solid, "--lower=-1e9"]);
    // A solid block that slides at its ends is under uniform strain: E_app is the tissue's 1000 MPa.
    for method in ["voxel-fe", "one-point"] {
        let e = copy.e_app_mpa(&solid, method, 1);
        assert!((e / 1000.0 - 1.0).abs() < 1e-5, "{method}: {e}");
    }
    let gaps = [1, 2].map(|refine| {
        let [full, one_point] =
            ["voxel-fe", "one-point"].map(|method| copy.e_app_mpa(&out, method, refine));
        println!("voxels split by {refine}: full integration {full}, one point {one_point} MPa");
        assert!(one_point > 0.0 && one_point < full, "{one_point} {full}");
        (full - one_point) / full
    });
    // Of smooth fields the gap falls with the square of the size, at edges of voxels with its first power at least.
    assert!(gaps[1] < 0.6 * gaps[0], "{gaps:?}");
}
