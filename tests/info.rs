//! `info` through the built program: what it says of made scans, for people and for programs.

use crate::cli::run;
use crate::formats::sound_files;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::{nifti, scan};
use bonepd_ct::volume::Volume;
use serde_json::Value;
use std::path::Path;

fn told(path: &Path) -> (String, Value) {
    let path = path.to_str().unwrap();
    let (code, words, stderr) = run(&["info", path]);
    assert_eq!(code, 0, "{stderr}");
    let (_, json, _) = run(&["info", path, "--json"]);
    (words, serde_json::from_str(&json).unwrap())
}

/// Marrow about 100, a quarter of bone about 900, each spread over 41 values.
#[test]
fn a_threshold_between_marrow_and_bone_is_suggested() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("scan.nii.gz");
    let grid = Grid::new([20, 20, 10], [0.03, 0.03, 0.04]);
    let values = (0..grid.len()).map(|i| {
        let peak = if i % 4 == 0 { 900 } else { 100 };
        peak + (i * 7 % 41) as i16 - 20
    });
    nifti::write(&path, &Volume::from_vec(grid, values.collect())).unwrap();
    let (words, json) = told(&path);
    let otsu = json["otsu"].as_f64().unwrap();
    assert!(otsu > 121.0 && otsu < 880.0, "{otsu}");
    assert_eq!(json["otsu_share"], 0.25);
    assert_eq!(json["labels"], Value::Array(Vec::new()));
    assert_eq!(json["size_mm"][2], 0.4);
    for part in [
        "Otsu",
        "25.0 % of the voxels",
        "segment --otsu",
        "0.03 × 0.03 × 0.04 mm",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    // The threshold is the one that `segment` takes.
    let out = dir.path().join("out");
    let (scan, out) = (path.to_str().unwrap(), out.to_str().unwrap());
    let (_, json, _) = run(&["segment", scan, "-o", out, "--otsu", "--keep-all", "--json"]);
    let record: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(record["results"]["lower"].as_f64().unwrap(), otsu);
}

#[test]
fn labels_are_counted_and_suggested() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("labels.nii");
    let grid = Grid::new([10; 3], [0.02; 3]);
    let values = (0..1000).map(|i| [0i16, 0, 0, 100, 127][i % 5]);
    nifti::write(&path, &Volume::from_vec(grid, values.collect())).unwrap();
    let (words, json) = told(&path);
    assert_eq!(
        json["labels"].to_string(),
        "[[0.0,600],[100.0,200],[127.0,200]]"
    );
    assert!(words.contains("0: 60.00 %, 100: 20.00 %"), "{words}");
    assert!(words.contains("segment --labels 100,127"), "{words}");
}

#[test]
fn a_scanco_scan_tells_its_calibration_and_the_threshold_in_its_units() {
    let dir = tempfile::tempdir().unwrap();
    let (_, bytes) = sound_files().into_iter().find(|f| f.0 == "a.aim").unwrap();
    let path = dir.path().join("a.aim");
    std::fs::write(&path, bytes).unwrap();
    let (words, json) = told(&path);
    assert_eq!(json["calibration"]["mu_scaling"], 8192.0);
    assert_eq!(json["calibration"]["mu_water_per_cm"], 0.2409);
    assert_eq!(
        json["calibration"]["density_mgha_slope_intercept"][0],
        1603.5
    );
    // Values run evenly from -900 to 2050: the middle, μ = 575 / 8192.
    let otsu = json["otsu"].as_f64().unwrap();
    assert!((otsu - 575.0).abs() < 50.0, "{otsu}");
    let line = words.lines().find(|line| line.starts_with("Otsu")).unwrap();
    let hu: f64 = line
        .split("; ")
        .nth(1)
        .unwrap()
        .trim_end_matches(" HU")
        .parse()
        .unwrap();
    assert!(
        (hu - (1000.0 * otsu / 8192.0 / 0.2409 - 1000.0)).abs() < 0.1,
        "{line}"
    );
    assert!(line.ends_with("mg HA/cm3"), "{line}");
}

/// A window in a scanner's counts, unless they were asked for, and one without a calibration.
#[test]
fn a_threshold_in_counts_is_warned_of() {
    let dir = tempfile::tempdir().unwrap();
    let said = |name: &str, more: &[&str]| {
        let (_, bytes) = sound_files().into_iter().find(|f| f.0 == name).unwrap();
        let path = dir.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let out = dir.path().join("out");
        let words = [
            "segment",
            path.to_str().unwrap(),
            "-o",
            out.to_str().unwrap(),
        ];
        let (code, stdout, stderr) = run(&[&words[..], &["--quiet", "--json"], more].concat());
        assert_eq!(code, 0, "{stderr}");
        let record: Value = serde_json::from_str(&stdout).unwrap();
        let warned = stderr.lines().find(|line| line.contains("stored counts"));
        // The record keeps what was said.
        let kept = record["results"]["warnings"].to_string();
        assert_eq!(kept.contains("stored counts"), warned.is_some(), "{kept}");
        warned.map(str::to_owned)
    };
    let window = ["--lower", "200", "--upper", "1500"];
    let words = said("a.aim", &window).unwrap();
    // 200 and 1500 counts of 8192 * 0.2409 per 1000 HU, from -1000 on.
    for part in [
        "warning: ",
        "lower -898.7 HU, upper -239.9 HU",
        "--units hu",
        "units = \"hu\"",
    ] {
        assert!(words.contains(part), "{words}");
    }
    let units = |unit: &str| {
        said(
            "a.aim",
            &[&["--units", unit][..], &["--lower", "-600"]].concat(),
        )
    };
    for unit in ["native", "hu", "mgha", "hu-where-known"] {
        assert_eq!(units(unit), None, "{unit}");
    }
    assert_eq!(said("a.aim", &["--otsu"]), None);
    assert_eq!(said("a.nii", &window), None);
    // This one holds no attenuation of water.
    let lost = said(
        "a.isq",
        &[&window[..], &["--units", "hu-where-known"]].concat(),
    );
    assert!(lost.unwrap().contains("no calibration to HU"));
}

/// Stored axes are not the specimen's: voxel sizes are told along those that `--spacing` and `--crop` act on.
#[test]
fn sizes_are_told_along_the_turned_axes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("turned.nrrd");
    // The first stored axis runs up, the second right to left, the third front to back.
    let head = "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 5 4 3\n\
                space directions: (0,0,0.05) (0.02,0,0) (0,0.03,0)\nendian: little\nencoding: raw\n\n";
    let data = crate::formats::bytes_of(&crate::formats::volume());
    std::fs::write(&path, [head.as_bytes(), &data].concat()).unwrap();
    let (words, json) = told(&path);
    assert_eq!(json["spacing_mm"].to_string(), "[0.02,0.03,0.05]");
    assert_eq!(json["voxels"].to_string(), "[4,3,5]");
    assert_eq!(json["size_mm"][2], 0.25);
    for part in [
        "voxels       4 × 3 × 5",
        "voxel size   0.02 × 0.03 × 0.05 mm",
        "as stored    5 × 4 × 3 voxels along i, j, k, 0.05 × 0.02 × 0.03 mm each",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    // What `info` prints is what `--spacing` overrides: the same numbers change nothing.
    let scan = scan::read(&path, Some([0.02, 0.03, 0.05])).unwrap();
    assert_eq!(
        scan.volume.grid,
        scan::read(&path, None).unwrap().volume.grid
    );
}
