//! A folder of results that version 0.1.0 wrote still works: `report` reads its rows, `solve` and `run` go on from its masks.

use crate::cli::run;
use crate::cohort::{rows, text};
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::{BoundaryRule, Method};
use std::fs;
use std::path::{Path, PathBuf};

/// A copy of what `run recipe.toml scans -o out` of version 0.1.0 left, with the scan and the recipe. Young's modulus is 18 000 MPa.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let kept = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/written_by_0_1_0");
    let dir = tempfile::tempdir().unwrap();
    copy(&kept, dir.path());
    let out = dir.path().join("out");
    (dir, out)
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        match source.is_dir() {
            true => copy(&source, &target),
            false => drop(fs::copy(&source, &target).unwrap()),
        }
    }
}

fn modulus(rows: &[Row], is_it: impl Fn(&Row) -> bool) -> f64 {
    let row = rows.iter().find(|row| is_it(row)).unwrap();
    row.e_app_mpa().unwrap()
}

fn by_voxels(row: &Row) -> bool {
    row.key.method == Method::VoxelFe
}

fn floppy(row: &Row) -> bool {
    row.key.boundary == Some(BoundaryRule::Floppy)
}

#[test]
fn its_rows_are_reported() {
    let (dir, out) = folder();
    let report = dir.path().join("report");
    let scan = out.join("s1");
    let (code, _, said) = run(&["report", text(&scan), "-o", text(&report)]);
    assert_eq!(code, 0, "{said}");
    let old = rows(&scan);
    let shown = rows(&report);
    assert_eq!(modulus(&shown, floppy), modulus(&old, floppy));
    assert_eq!(modulus(&shown, by_voxels), modulus(&old, by_voxels));
    let page = fs::read_to_string(report.join("report.html")).unwrap();
    assert!(page.contains("s1"));
}

#[test]
fn its_mask_is_solved_and_its_rows_are_kept_under_its_version() {
    let (_dir, out) = folder();
    let scan = out.join("s1");
    let old = fs::read(scan.join("results.csv")).unwrap();
    let old_rows = rows(&scan);
    let tight = ["--method", "voxel-fe", "--tolerance", "1e-6"];
    let words = [&["solve", text(&scan)], &tight[..]].concat();
    let (code, _, said) = run(&words);
    assert_eq!(code, 0, "{said}");
    // The run's tissue, not the default.
    assert!(said.contains("18000"), "{said}");
    assert!(said.contains("results-0.1.0.csv"), "{said}");
    assert_eq!(fs::read(scan.join("results-0.1.0.csv")).unwrap(), old);
    let new = rows(&scan);
    assert!(new.iter().all(by_voxels), "rows of both versions are mixed");
    let ratio = modulus(&new, by_voxels) / modulus(&old_rows, by_voxels);
    // Both solve to 1e-6.
    assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
}

#[test]
fn its_run_is_run_again() {
    let (dir, out) = folder();
    let (recipe, scans) = (dir.path().join("recipe.toml"), dir.path().join("scans"));
    let old = rows(&out);
    let (code, _, said) = run(&["run", text(&recipe), text(&scans), "-o", text(&out)]);
    assert_eq!(code, 0, "{said}");
    assert!(out.join("s1/results-0.1.0.csv").is_file(), "{said}");
    let ratio = modulus(&rows(&out), floppy) / modulus(&old, floppy);
    assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
}
