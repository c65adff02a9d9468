//! `info` through the built program: what it says of made scans, for people and for programs.

use crate::cli::run;
use crate::formats::sound_files;
use bonepd_ct::grid::Grid;
use bonepd_ct::io::nifti;
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
