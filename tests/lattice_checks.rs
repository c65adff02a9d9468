//! What rows of lattices say of themselves where they are wrong: no bracket, lost paths, limits that voxel FE contradicts; and the
//! sizes that rows of coarser elements state.

use crate::cli::run;
use crate::specimens::specimen;
use bonepd_ct::image::nifti;
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::{BoundaryRule, Method};
use tempfile::TempDir;

/// A scan of `n` voxels of 0.02 mm that holds a mask, segmented: its folder.
fn segmented(n: [usize; 3], bone: impl Fn([usize; 3]) -> bool) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("made.nii.gz");
    nifti::write(&scan, &specimen(n, [0.02; 3], bone).bone).unwrap();
    let words = [
        "segment",
        scan.to_str().unwrap(),
        "-o",
        path(&dir),
        "--lower",
        "1",
        "--keep-all",
    ];
    let (code, _, stderr) = run(&words);
    assert_eq!(code, 0, "{stderr}");
    dir
}

fn path(dir: &TempDir) -> &str {
    dir.path().to_str().unwrap()
}

/// Solves and returns what stderr said.
fn solve(dir: &TempDir, words: &[&str]) -> String {
    let (code, stdout, stderr) = run(&[&["solve", path(dir), "--quiet"], words].concat());
    assert_eq!(code, 0, "{stdout}{stderr}");
    stderr
}

fn rows(dir: &TempDir) -> Vec<Row> {
    bonepd_ct::io::table::read(&dir.path().join("results.csv")).unwrap()
}

fn of(rows: &[Row], boundary: BoundaryRule) -> &Row {
    let found = rows.iter().find(|row| row.key.boundary == Some(boundary));
    found.expect("a row of this boundary")
}

fn note(row: &Row) -> &str {
    row.marks.note.as_deref().unwrap_or_default()
}

/// A plate along the load of voxels `first..past` across 24.
fn plate(first: usize, past: usize) -> TempDir {
    segmented([24; 3], |[x, ..]| (first..past).contains(&x))
}

#[test]
fn firm_below_floppy_is_said_and_no_error_is_stated() {
    // Two planes of sites lie in the plate: 195 MPa. Of firm's four two are fully coordinated: 188. Voxels: 1000 · 4 / 24.
    let dir = plate(10, 14);
    let stderr = solve(&dir, &["--lp", "0.06"]);
    let rows = rows(&dir);
    let [floppy, firm, mean] = [BoundaryRule::Floppy, BoundaryRule::Firm, BoundaryRule::Ffb]
        .map(|boundary| of(&rows, boundary));
    assert!(firm.e_app_mpa() < floppy.e_app_mpa(), "{firm:?} {floppy:?}");
    assert!(mean.e_app_mpa().is_some() && mean.error_mpa().is_none());
    assert!(
        note(mean).contains("the answer need not lie between them"),
        "{mean:?}"
    );
    assert!(
        stderr.contains("sc ffb 0.06 mm: no error is stated"),
        "{stderr}"
    );
}

#[test]
fn voxel_fe_outside_of_floppy_and_firm_takes_the_error_back() {
    // One plane of sites, and one fully coordinated: 72 and 94 MPa. Voxels: 1000 · 3 / 24.
    let dir = plate(11, 14);
    let stderr = solve(&dir, &["--lp", "0.06"]);
    let before = of(&rows(&dir), BoundaryRule::Ffb).clone();
    assert!(
        before.error_mpa().is_some() && !stderr.contains("no error"),
        "{before:?}"
    );
    let stderr = solve(&dir, &["--method", "voxel-fe"]);
    let after = of(&rows(&dir), BoundaryRule::Ffb).clone();
    assert_eq!(after.e_app_mpa(), before.e_app_mpa());
    assert_eq!(after.error_mpa(), None);
    assert!(note(&after).contains("lies outside"), "{after:?}");
    assert!(stderr.contains("no error is stated: voxel FE"), "{stderr}");
}

/// Struts of five voxels, each with cracks that one column of voxels bridges.
fn cracked([x, y, z]: [usize; 3]) -> bool {
    let (x, y) = (x % 10, y % 10);
    x < 5 && y < 5 && (z % 8 != 4 || (x == 2 && y == 2))
}

#[test]
fn a_limit_of_lattices_that_bridge_a_crack_states_no_error() {
    let dir = segmented([40; 3], cracked);
    solve(&dir, &["--boundary", "graded", "--lp", "0.06,0.08,0.1"]);
    let limit = of(&rows(&dir), BoundaryRule::Extrapolated).clone();
    assert!(limit.error_mpa().is_some(), "{limit:?}");
    let stderr = solve(&dir, &["--method", "voxel-fe"]);
    let after = of(&rows(&dir), BoundaryRule::Extrapolated).clone();
    assert_eq!(after.error_mpa(), None, "{after:?}");
    assert!(note(&after).contains("contradicts this limit of lattices"));
    assert!(stderr.contains("extrapolated"), "{stderr}");
}

/// Plates with slanted rods of two voxels between them, which sites 0.1 mm apart lose.
fn rods([x, y, z]: [usize; 3]) -> bool {
    let plate = !(4..20).contains(&z);
    let rod = (x + z) % 12 < 2 && y % 12 < 2;
    plate || rod
}

#[test]
fn a_lattice_that_falls_apart_is_no_missing_path_of_bone() {
    let dir = segmented([24; 3], rods);
    solve(&dir, &["--lp", "0.1"]);
    let found = rows(&dir);
    let [floppy, firm, mean] = [BoundaryRule::Floppy, BoundaryRule::Firm, BoundaryRule::Ffb]
        .map(|boundary| of(&found, boundary));
    assert_eq!(floppy.e_app_mpa(), Some(0.0));
    assert!(
        note(floppy).contains("this lattice is disconnected although the bone connects"),
        "{floppy:?}"
    );
    assert!(!note(floppy).contains("no path of bone"));
    assert!(firm.e_app_mpa() > Some(0.0));
    assert_eq!((mean.e_app_mpa(), mean.error_mpa()), (None, None));
    assert!(note(mean).contains("no mean"), "{mean:?}");
    // The model's 0 is no answer, and no error of it is stated.
    let answer = std::fs::read_to_string(dir.path().join("answer.json")).unwrap();
    assert!(answer.contains("\"firm\""), "{answer}");
    assert_eq!(floppy.error_mpa(), None);
    // A gap that the firm lattice's padding, 0.11 mm from either side, cannot bridge.
    let gap = segmented([24; 3], |[.., z]| !(5..19).contains(&z));
    solve(&gap, &["--lp", "0.1"]);
    let found = rows(&gap);
    assert!(note(of(&found, BoundaryRule::Floppy)).contains("no path of bone"));
    assert_eq!(of(&found, BoundaryRule::Ffb).e_app_mpa(), Some(0.0));
}

#[test]
fn coarser_elements_state_the_size_they_have() {
    let dir = segmented([15; 3], |_| true);
    for coarsen in ["1", "2"] {
        solve(&dir, &["--method", "voxel-fe", "--coarsen", coarsen]);
    }
    let found = rows(&dir);
    let sizes = found.iter().filter(|row| row.key.method == Method::VoxelFe);
    let sizes: Vec<f64> = sizes.map(|row| row.key.lp_mm).collect();
    assert_eq!(sizes[0], 0.02);
    // Eight elements over 15 voxels of 0.02 mm.
    assert!((sizes[1] - 0.0375).abs() < 1e-15, "{sizes:?}");
}

#[test]
fn firm_without_a_site_of_all_bonds_gives_no_mean() {
    // Two planes of sites around a plate: each lacks the bonds across.
    let dir = plate(11, 13);
    solve(&dir, &["--lp", "0.04"]);
    let found = rows(&dir);
    let [floppy, firm, mean] = [BoundaryRule::Floppy, BoundaryRule::Firm, BoundaryRule::Ffb]
        .map(|boundary| of(&found, boundary));
    assert!(floppy.e_app_mpa() > Some(0.0));
    assert_eq!((firm.e_app_mpa(), firm.error_mpa()), (Some(0.0), None));
    assert!(
        note(firm).contains("no site of this lattice has all its bonds"),
        "{firm:?}"
    );
    assert_eq!((mean.e_app_mpa(), mean.error_mpa()), (None, None));
}
