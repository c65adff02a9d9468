//! Numbers that cannot be meant: voxel sizes, thresholds, units; and the ends of pipes.

use super::program;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::volume::Volume;
use std::path::Path;

/// Air about −900, bone about 900 in a quarter, of noise of 40 to either side; 24³ voxels.
fn grey(i: usize) -> f32 {
    let noise = ((i * 7919) % 81) as f32 - 40.0;
    if (i / 24).is_multiple_of(4) {
        900.0 + noise
    } else {
        -900.0 + noise
    }
}

fn write(path: &Path, spacing_mm: [f64; 3], value: impl Fn(usize) -> f32) {
    let grid = Grid::new([24; 3], spacing_mm);
    nifti::write(
        path,
        &Volume::from_vec(grid, (0..24 * 24 * 24).map(value).collect()),
    )
    .unwrap();
}

fn segment(
    spacing_mm: [f64; 3],
    value: impl Fn(usize) -> f32,
    words: &[&str],
) -> (Option<i32>, String) {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.nii"), spacing_mm, value);
    program(
        dir.path(),
        &[&["segment", "a.nii", "-o", "out"], words].concat(),
    )
}

const CUBE: [f64; 3] = [0.02; 3];

#[test]
fn sizes_no_scan_has_are_warned_of_or_refused_with_the_likely_slip() {
    let (code, said) = segment([19.5; 3], grey, &["--lower", "0"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("error: ") && said.contains("0.0195 mm instead of 19.5?"),
        "{said}"
    );
    let (code, said) = segment([0.6; 3], grey, &["--lower", "0"]);
    assert!(
        code == Some(0)
            && said.contains("warning: a: voxels of 0.6 mm are outside 0.001 to 0.5 mm"),
        "{said}"
    );
    let (code, said) = segment([0.01, 0.01, 1.0], grey, &["--lower", "0"]);
    assert!(
        code == Some(0) && said.contains("100.0 times as long as wide"),
        "{said}"
    );
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.nii"), [0.01, 0.01, 1.0], grey);
    program(
        dir.path(),
        &[
            "segment",
            "a.nii",
            "-o",
            "out",
            "--lower",
            "0",
            "--keep-all",
        ],
    );
    let (code, said) = program(dir.path(), &["solve", "out", "--method", "voxel-fe"]);
    assert!(
        code == Some(2)
            && said.contains("100 times as long as wide")
            && said.contains("--resample"),
        "{said}"
    );
    let (code, said) = segment([0.02, 0.02, 0.04], grey, &["--lower", "0"]);
    assert!(
        code == Some(0) && !said.contains("as long as wide") && !said.contains("outside 0.001"),
        "{said}"
    );
    // The way out is said, and taken.
    let (code, said) = segment([19.5; 3], grey, &["--lower", "0", "--spacing", "0.0195"]);
    assert!(
        code == Some(0)
            && said
                .contains("warning: a: voxel size replaced: the file says 19.5 × 19.5 × 19.5 mm"),
        "{said}"
    );
}

#[test]
fn a_voxel_size_that_overrules_the_files_is_warned_of_and_stands_in_the_record() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.nii"), CUBE, grey);
    for (spacing, warned) in [("0.03", true), ("0.02,0.02,0.021", true), ("0.02", false)] {
        let words = ["segment", "a.nii", "-o", "out", "--lower", "0", "--quiet"];
        let (code, said) = program(dir.path(), &[&words[..], &["--spacing", spacing]].concat());
        assert_eq!(code, Some(0), "{said}");
        let words = "voxel size replaced: the file says 0.02 × 0.02 × 0.02 mm";
        assert_eq!(
            said.contains(&format!("warning: a: {words}")),
            warned,
            "{said}"
        );
        let record = std::fs::read_to_string(dir.path().join("out/segment.json")).unwrap();
        let record: serde_json::Value = serde_json::from_str(&record).unwrap();
        let warnings = record["results"]["warnings"].as_array().unwrap();
        let found = warnings.iter().filter_map(|w| w.as_str());
        assert_eq!(
            found.filter(|w| w.starts_with(words)).count() == 1,
            warned,
            "{spacing}"
        );
    }
}

#[test]
fn bone_volume_fractions_no_bone_has_are_warned_of() {
    for (lower, said_of) in [
        ("0", None),
        ("935", Some("less than trabecular bone has")),
        ("-935", Some("nearly everything")),
    ] {
        let (code, said) = segment(CUBE, grey, &["--keep-all", &format!("--lower={lower}")]);
        assert_eq!(code, Some(0), "{said}");
        match said_of {
            Some(words) => assert!(said.contains(words), "{lower}: {said}"),
            None => assert!(!said.contains("BV/TV is"), "{said}"),
        }
    }
}

#[test]
fn bounds_take_voxels_of_their_own_value() {
    let tenths = |i: usize| (i % 10) as f32 / 10.0;
    for tenth in 1..10 {
        let lower = format!("0.{tenth}");
        let (code, said) = segment(CUBE, tenths, &["--keep-all", "--lower", &lower]);
        let voxels = (0..24 * 24 * 24).filter(|i| i % 10 >= tenth).count();
        assert!(
            code == Some(0) && said.contains(&format!("{voxels} bone voxels")),
            "{lower}: {said}"
        );
        let (_, said) = segment(
            CUBE,
            tenths,
            &["--keep-all", "--lower", "0", "--upper", &lower],
        );
        let voxels = (0..24 * 24 * 24).filter(|i| i % 10 <= tenth).count();
        assert!(
            said.contains(&format!("{voxels} bone voxels")),
            "{lower}: {said}"
        );
    }
}

#[test]
fn otsu_leaves_out_padding_and_hot_voxels() {
    let bone = (0..24 * 24 * 24).filter(|i| grey(*i) > 0.0).count();
    let hot = |i: usize| if i == 77 { 1e9 } else { grey(i) };
    let (code, said) = segment(CUBE, hot, &["--keep-all", "--otsu"]);
    let with_hot = bone + usize::from(grey(77) < 0.0);
    assert!(
        code == Some(0) && said.contains(&format!("{with_hot} bone voxels")),
        "{said}"
    );
    assert!(
        said.contains("note: a: Otsu's threshold leaves out 1 voxels of extreme values"),
        "{said}"
    );
    let padded = |i: usize| if i % 24 < 8 { -32_768.0 } else { grey(i) };
    let (_, said) = segment(CUBE, padded, &["--keep-all", "--otsu"]);
    let bone = (0..24 * 24 * 24).filter(|i| padded(*i) > 0.0).count();
    assert!(said.contains(&format!("{bone} bone voxels")), "{said}");
    assert!(
        said.contains("33.3 % of the voxels, which hold -32768"),
        "{said}"
    );
    // A window that takes it is warned of.
    let (_, said) = segment(CUBE, padded, &["--keep-all", "--upper", "0"]);
    assert!(
        said.contains("warning: a: the window takes 33.3 % of the voxels, which hold -32768"),
        "{said}"
    );
    let (_, said) = segment(CUBE, padded, &["--keep-all", "--lower", "0"]);
    assert!(!said.contains("the window takes"), "{said}");
}

#[test]
fn labels_that_cannot_be_told_apart_are_refused() {
    let (code, said) = segment(CUBE, grey, &["--labels", "16777217"]);
    assert!(code == Some(2) && said.contains("label 16777217"), "{said}");
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_panic() {
    let dir = tempfile::tempdir().unwrap();
    write(&dir.path().join("a.nii"), CUBE, grey);
    let bin = env!("CARGO_BIN_EXE_bonepd-ct");
    let commands = [
        "info a.nii",
        "info a.nii --json",
        "segment a.nii -o out --lower 0 --json",
        "segment a.nii -o none --lower 5000",
        "info missing.nii",
    ];
    for words in commands {
        // Both ends closed before the program starts to write.
        let script = format!(
            "({bin} {words} --threads=1; echo $? >code) 2>&1 | true; sleep 0.2; while [ ! -s code ]; do sleep 0.1; done; cat code; rm code"
        );
        let output = std::process::Command::new("sh")
            .arg("-c")
            .arg(script)
            .current_dir(dir.path())
            .output()
            .unwrap();
        let code = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        let expected = if words.contains("none") || words.contains("missing") {
            "2"
        } else {
            "0"
        };
        assert_eq!(code, expected, "{words}");
    }
}
