//! `segment` through the built program: the real stack (on request), bad input everywhere.

use crate::cli::run;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::volume::Volume;
use std::path::{Path, PathBuf};

/// Folder of the 200 slices of real bone (LHDL 3155 D 4 bc), which are not part of the repository. Tests that read it are
/// ignored by default.
///
/// # Panics
/// If it is not where `BONEPD_STACK` says.
pub fn real_stack() -> PathBuf {
    let path = match std::env::var_os("BONEPD_STACK") {
        Some(path) => PathBuf::from(path),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/lhdl_3155_D_4_bc"),
    };
    assert!(
        path.is_dir(),
        "{} is no folder: set BONEPD_STACK to the folder of the slices",
        path.display()
    );
    path
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A bar of 500 along z in a field of 100, 0.05 mm voxels.
fn bar(path: &Path) {
    let grid = Grid::new([12, 12, 10], [0.05; 3]);
    let voxels = (0..grid.len()).map(|at| match [at % 12, at / 12 % 12] {
        [4..=7, 4..=7] => 500i16,
        _ => 100,
    });
    nifti::write(path, &Volume::from_vec(grid, voxels.collect())).unwrap();
}

#[test]
#[ignore = "needs the real stack (BONEPD_STACK)"]
fn the_real_stack_gives_the_published_count_of_bone_voxels() {
    let stack = real_stack();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let (code, stdout, stderr) = run(&[
        "segment",
        text(&stack),
        "-o",
        text(&out),
        "--spacing",
        "0.0195",
        "--gaussian",
        "1",
        "--lower",
        "63",
        "--json",
    ]);
    assert_eq!(code, 0, "{stderr}");
    let record: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let results = &record["results"];
    // From an independent implementation with the same smoothing (σ 1, cut at 4 σ, mirrored edges).
    assert_eq!(results["bone_voxels"], 1_869_627);
    assert!((results["bv_tv"].as_f64().unwrap() - 0.2337).abs() < 5e-5);
    let specimen = bonepd_ct::command::segment::load(&out).unwrap();
    assert_eq!(specimen.bv_tv(), results["bv_tv"].as_f64().unwrap());
    assert_eq!(specimen.bone.grid, Grid::new([200; 3], [0.0195; 3]));
}

#[test]
fn segmenting_again_is_up_to_date_until_something_changes() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("bar.nii.gz"), dir.path().join("out"));
    bar(&scan);
    let args = ["segment", text(&scan), "-o", text(&out), "--lower", "300"];
    let (code, _, first) = run(&args);
    assert_eq!(code, 0, "{first}");
    assert!(!first.contains("up to date"));
    assert!(run(&args).2.contains("up to date"));
    let other = ["segment", text(&scan), "-o", text(&out), "--lower", "200"];
    assert!(!run(&other).2.contains("up to date"));
}

#[test]
fn a_dry_run_writes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("bar.nii.gz"), dir.path().join("out"));
    bar(&scan);
    let (code, stdout, stderr) = run(&[
        "segment",
        text(&scan),
        "-o",
        text(&out),
        "--lower",
        "300",
        "--dry-run",
    ]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("160 bone voxels"), "{stdout}");
    assert!(!out.exists());
}

/// Arguments after the input, and words that the message must hold.
fn refused(input: &Path, more: &[&str], expected: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let mut args = vec!["segment", text(input), "-o", text(&out)];
    args.extend(more);
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 2, "{args:?}: {stderr}");
    for words in expected.iter().chain(&["what to do"]) {
        assert!(
            stderr.contains(words),
            "{args:?} should say `{words}`: {stderr}"
        );
    }
    assert!(!out.exists(), "{args:?} left something behind");
}

#[test]
fn bad_input_is_refused_and_leaves_nothing_behind() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let scan = at("bar.nii.gz");
    bar(&scan);
    refused(&at("absent.nii"), &["--lower", "1"], &["absent.nii"]);
    refused(&scan, &[], &["no threshold"]);
    refused(&scan, &["--lower", "5000"], &["run from 100 to 500"]);
    refused(
        &scan,
        &["--lower", "300", "--crop", "0:20,0:5,0:5"],
        &["crop", "0:12"],
    );
    refused(
        &scan,
        &["--lower", "300", "--voi", "cylinder:3"],
        &["cylinder"],
    );
    refused(
        &scan,
        &["--lower", "300", "--voi", text(&at("no-mask.nii"))],
        &["no-mask.nii"],
    );

    let bytes = std::fs::read(&scan).unwrap();
    for keep in [10, 100, bytes.len() - 20] {
        let cut = at("cut.nii.gz");
        std::fs::write(&cut, &bytes[..keep]).unwrap();
        refused(&cut, &["--lower", "300"], &["cut.nii.gz"]);
    }
    let other = at("notes.docx");
    std::fs::write(&other, "words").unwrap();
    refused(&other, &["--lower", "1"], &["notes.docx"]);
}

fn slice(path: &Path, width: u32, height: u32) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = tiff::encoder::TiffEncoder::new(file).unwrap();
    let values = vec![7u8; (width * height) as usize];
    encoder
        .write_image::<tiff::encoder::colortype::Gray8>(width, height, &values)
        .unwrap();
}

#[test]
fn slices_of_mixed_sizes_and_slices_without_a_size_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for k in 0..5 {
        slice(&dir.path().join(format!("s{k}.tif")), 6, 4);
    }
    refused(dir.path(), &["--lower", "1"], &["voxel size", "--spacing"]);
    slice(&dir.path().join("s3.tif"), 6, 5);
    refused(
        dir.path(),
        &["--lower", "1", "--spacing", "0.02"],
        &["s3.tif", "6 × 5", "6 × 4"],
    );
}

#[test]
fn an_unwritable_output_folder_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("bar.nii.gz");
    bar(&scan);
    let file = dir.path().join("file");
    std::fs::write(&file, "in the way").unwrap();
    let out = file.join("out");
    let (code, _, stderr) = run(&["segment", text(&scan), "-o", text(&out), "--lower", "300"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("cannot be written"), "{stderr}");
}
