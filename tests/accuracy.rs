//! Stated errors: what `solve --error` climbs through, what masks and the voxel staircase may state.

use crate::cli::run;
use crate::segment::real_stack;
use bonepd_ct::io::table;
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::{BoundaryRule, Method};
use std::path::Path;

/// A phantom of 1.2 mm with struts of 0.16 mm, segmented into `dir`.
fn phantom(dir: &Path) -> String {
    let scan = dir.join("scan.nii.gz");
    let scan = scan.to_str().unwrap();
    let out = dir.join("bone");
    let out = out.to_str().unwrap().to_owned();
    let shape = "--size-mm 1.2 --spacing-mm 0.02 --bvtv 0.3 --thickness-mm 0.16 --seed 5";
    let words: Vec<&str> = ["phantom", "-o", scan]
        .into_iter()
        .chain(shape.split(' '))
        .collect();
    assert_eq!(run(&words).0, 0);
    assert_eq!(run(&["segment", scan, "-o", &out, "--lower", "200"]).0, 0);
    out
}

fn rows(dir: &str) -> Vec<Row> {
    table::read(&Path::new(dir).join("results.csv")).unwrap()
}

/// The least stated error of a table of results.
fn least_error(rows: &[Row]) -> f64 {
    let stated = rows.iter().filter_map(Row::error);
    stated.fold(f64::INFINITY, f64::min)
}

/// Cheap models first, and a smaller target never ends with a larger error.
#[test]
fn a_smaller_target_climbs_on_and_never_states_a_larger_error() {
    let dir = tempfile::tempdir().unwrap();
    let out = phantom(dir.path());
    let mut before = f64::INFINITY;
    for (target, code, solves) in [("30%", 0, 1), ("9%", 0, 3), ("1%", 1, 4)] {
        let (found, _, words) = run(&["solve", &out, "--error", target, "--force"]);
        assert_eq!(found, code, "{target}: {words}");
        let rows = rows(&out);
        assert_eq!(rows.len(), solves, "{target}: {rows:?}");
        assert!(rows.iter().all(|r| r.key.method == Method::VoxelFe));
        let error = least_error(&rows);
        assert!(error <= before, "{target}: {error} after {before}");
        before = error;
    }
}

/// A mask says nothing of the surface within a voxel: one element a voxel is all there is, and its error is larger.
#[test]
fn a_mask_states_a_larger_error_than_the_grey_scan_it_came_from() {
    let dir = tempfile::tempdir().unwrap();
    let grey = phantom(dir.path());
    assert_eq!(run(&["solve", &grey, "--method", "voxel-fe"]).0, 0);
    let mask = dir.path().join("mask");
    let mask = mask.to_str().unwrap();
    let file = format!("{grey}/mask.nii.gz");
    assert_eq!(run(&["segment", &file, "-o", mask, "--lower", "1"]).0, 0);
    let (code, _, words) = run(&["solve", mask, "--error", "1%"]);
    assert_eq!(code, 1, "{words}");
    let rows_of_mask = rows(mask);
    assert_eq!(rows_of_mask.len(), 1);
    let grey = rows(&grey);
    assert_eq!(rows_of_mask[0].e_app_mpa(), grey[0].e_app_mpa());
    assert!(least_error(&rows_of_mask) > least_error(&grey));
}

/// Elements of split voxels converge to the staircase, which is another body than the bone: they answer nothing.
#[test]
fn the_staircase_states_no_error_of_the_bone() {
    let dir = tempfile::tempdir().unwrap();
    let out = phantom(dir.path());
    assert_eq!(run(&["solve", &out, "--method", "voxel-fe"]).0, 0);
    let split = ["solve", &out, "--method", "voxel-fe", "--refine-mask", "2"];
    assert_eq!(run(&split).0, 0);
    let rows = rows(&out);
    let limit = rows
        .iter()
        .find(|r| r.key.boundary == Some(BoundaryRule::Extrapolated))
        .unwrap();
    assert!(limit.marks.note.as_ref().unwrap().contains("staircase"));
    let answers = rows.iter().filter(|r| r.error().is_some()).count();
    assert_eq!(answers, 1, "{rows:?}");
}

#[test]
fn an_error_that_cannot_be_met_is_said_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let out = phantom(dir.path());
    let (code, _, words) = run(&["solve", &out, "--error", "0.01%", "--threads", "2"]);
    assert_eq!(code, 1, "{words}");
    assert!(
        words.contains("cannot reach the error asked for"),
        "{words}"
    );
}

#[test]
#[ignore = "needs the real stack (BONEPD_STACK)"]
fn connected_lattices_of_the_real_stack_are_near_voxel_elements() {
    let stack = real_stack();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let flags = ["--spacing", "0.0195", "--gaussian", "1", "--lower", "63"];
    let segment = [&["segment", stack.to_str().unwrap(), "-o", out], &flags[..]].concat();
    assert_eq!(run(&segment).0, 0);
    let solve = [
        "solve",
        out,
        "--boundary",
        "graded",
        "--lp",
        "0.12,0.1,0.08",
    ];
    assert_eq!(run(&solve).0, 0);
    // One element a voxel gives 75.05 MPa here, 73.0 ± 0.8 in the limit (`reports/speed-vs-error.md`); FFB is 67.6 to 68.6 at
    // these lattice parameters. Found: 69.9 to 71.1.
    for row in rows(out) {
        let e = row.e_app_mpa().unwrap();
        assert!((e / 73.0 - 1.0).abs() < 0.05, "{row:?}");
    }
}

/// Elements a three-hundredth of a voxel: no machine has that memory, and none is asked for it.
#[test]
fn a_solve_that_will_not_fit_is_refused_with_what_would() {
    let dir = tempfile::tempdir().unwrap();
    let out = phantom(dir.path());
    let (code, _, words) = run(&["solve", &out, "--method", "voxel-fe", "--refine", "300"]);
    assert_eq!(code, 2, "{words}");
    assert!(
        words.contains("MiB are free") && words.contains("or --refine "),
        "{words}"
    );
    let fits = words.split("--refine ").nth(1).unwrap();
    let fits: usize = fits.split_whitespace().next().unwrap().parse().unwrap();
    assert!(fits < 200, "{words}");
    let (code, _, words) = run(&["solve", &out, "--lp", "0.0001", "--boundary", "floppy"]);
    assert_eq!(code, 2, "{words}");
    assert!(words.contains("lattice parameter of"), "{words}");
    // Places that numbers cannot count, in every command that would lay them out.
    let settings = ["--lp", "0.000000001", "--boundary", "floppy"];
    for command in [&["solve"][..], &["solve", "--dry-run"], &["lattice"]] {
        let (code, _, words) = run(&[command, &[&*out], &settings].concat());
        assert_eq!(code, 2, "{command:?}: {words}");
        assert!(
            words.contains("lattice parameter of"),
            "{command:?}: {words}"
        );
    }
    for command in ["lattice", "solve"] {
        let (code, _, words) = run(&[command, &out, "--lp", "0.0005", "--boundary", "firm"]);
        assert_eq!(code, 2, "{words}");
        let advised = words.split("lattice parameter of ").nth(1).unwrap();
        let advised = advised.split_whitespace().next().unwrap();
        assert!(advised.parse::<f64>().unwrap() > 0.0005, "{words}");
    }
}

/// What `--dry-run` tells against what the solve then took, each in a program of its own.
#[test]
#[ignore = "half a minute"]
fn memory_is_foretold_within_a_fifth() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("scan.nii.gz"), dir.path().join("out"));
    let (scan, out) = (scan.to_str().unwrap(), out.to_str().unwrap());
    let made = ["--size-mm", "3.2", "--spacing-mm", "0.02", "--bvtv", "0.2"];
    assert_eq!(run(&[&["phantom", "-o", scan], &made[..]].concat()).0, 0);
    let segmented = run(&["segment", scan, "-o", out, "--lower", "200", "--keep-grey"]);
    assert_eq!(segmented.0, 0, "{}", segmented.2);
    for settings in [
        "--lp 0.03 --boundary firm",
        "--lp 0.02 --boundary floppy",
        "--lp 0.03 --boundary graded",
        "--structure bcc --lp 0.03 --boundary graded",
        "--structure fcc --lp 0.03 --boundary graded",
        "--structure fcc --lp 0.03 --boundary floppy",
        "--method voxel-fe",
        "--method voxel-fe --load stiffness",
    ] {
        let settings: Vec<&str> = settings.split(' ').collect();
        let solve = [&["solve", out, "--force"], &settings[..]].concat();
        let (code, _, words) = run(&[&solve[..], &["--dry-run"]].concat());
        assert_eq!(code, 0, "{words}");
        let foretold = words.split("about ").nth(1).unwrap();
        let foretold: f64 = foretold.split(' ').next().unwrap().parse().unwrap();
        let (code, _, words) = run(&solve);
        assert_eq!(code, 0, "{words}");
        let took = rows(out)[0].solved.as_ref().unwrap().peak_mib;
        let took = took.expect("measured");
        println!("{settings:?}: {foretold:.0} MiB foretold, {took:.0} taken");
        assert!(
            (foretold / took - 1.0).abs() < 0.2,
            "{settings:?}: {foretold}, {took}"
        );
    }
}
