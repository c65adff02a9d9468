//! The built program: exit codes, messages, and that a failure leaves nothing behind.

use assert_cmd::Command;

pub fn bonepd() -> Command {
    Command::new(env!("CARGO_BIN_EXE_bonepd-ct"))
}

/// Runs and returns (exit code, stdout, stderr).
pub fn run(args: &[&str]) -> (i32, String, String) {
    let output = bonepd().args(args).output().expect("the program starts");
    (
        output.status.code().expect("not killed"),
        String::from_utf8(output.stdout).unwrap(),
        String::from_utf8(output.stderr).unwrap(),
    )
}

pub const VERBS: [&str; 12] = [
    "segment",
    "lattice",
    "solve",
    "report",
    "run",
    "phantom",
    "info",
    "scene",
    "recipe",
    "columns",
    "completions",
    "man",
];

#[test]
fn every_verb_has_help() {
    let (code, help, _) = run(&["--help"]);
    assert_eq!(code, 0);
    for verb in VERBS {
        assert!(help.contains(verb), "{verb} is not in --help");
        assert_eq!(run(&[verb, "--help"]).0, 0, "{verb} --help");
    }
}

#[test]
fn the_version_is_the_crates() {
    let (code, version, _) = run(&["--version"]);
    assert_eq!(code, 0);
    assert_eq!(
        version.trim(),
        format!("bonepd-ct {}", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn completions_are_printed() {
    let (code, script, _) = run(&["completions", "bash"]);
    assert_eq!(code, 0);
    assert!(script.contains("voxel-fe"));
}

#[test]
fn bad_words_exit_2_and_say_why() {
    for (args, said) in [
        (&["frobnicate"][..], "frobnicate"),
        (&["segment", "x.nii"], "--out"),
        (
            &["segment", "x.nii", "-o", "d", "--otsu", "--lower", "3"],
            "cannot be used with",
        ),
        (
            &[
                "segment", "x.nii", "-o", "d", "--lower", "5", "--upper", "3",
            ],
            "above upper",
        ),
        (
            &["segment", "x.nii", "-o", "d", "--crop", "0:5"],
            "X0:X1,Y0:Y1,Z0:Z1",
        ),
        (
            &["segment", "x.nii", "-o", "d", "--spacing", "0"],
            "above 0",
        ),
        (&["solve", "d", "--poisson", "0.5"], "0.5"),
        (&["solve", "d", "--tolerance", "100%"], "tolerance"),
        (&["lattice", "d", "--lp", "0.1,-0.2"], "above 0"),
        (&["lattice", "d", "--structure", "hcp"], "fcc"),
    ] {
        let (code, _, stderr) = run(args);
        assert_eq!(code, 2, "{args:?}");
        assert!(stderr.contains(said), "{args:?} said: {stderr}");
    }
}
