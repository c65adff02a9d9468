//! Stated errors: graded lattices against voxel FE, the limit of several resolutions, `solve --error`.

use crate::cli::run;
use crate::segment::shared_stack;
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

fn find(rows: &[Row], method: Method, boundary: Option<BoundaryRule>) -> Option<&Row> {
    rows.iter()
        .find(|r| r.key.method == method && r.key.boundary == boundary)
}

#[test]
fn a_modest_error_is_met_by_lattices_and_a_small_one_by_voxel_elements() {
    let dir = tempfile::tempdir().unwrap();
    let out = phantom(dir.path());
    let (code, _, words) = run(&["solve", &out, "--error", "25%"]);
    assert_eq!(code, 0, "{words}");
    let coarse = rows(&out);
    assert!(
        find(&coarse, Method::VoxelFe, None).is_none(),
        "lattices were enough"
    );
    let lattice = find(&coarse, Method::Lattice, Some(BoundaryRule::Extrapolated)).unwrap();

    let (code, _, words) = run(&["solve", &out, "--error", "4%"]);
    assert_eq!(code, 0, "{words}");
    let fine = rows(&out);
    let limit = find(&fine, Method::VoxelFe, Some(BoundaryRule::Extrapolated)).unwrap();
    let stated: f64 = limit.stated_errors_mpa().iter().flatten().sum();
    assert!(limit.stated_errors_mpa().iter().all(Option::is_some));
    assert!(stated < 0.04 * limit.e_app_mpa().unwrap(), "{limit:?}");
    // The two limits, of unlike models, agree within what they state together.
    let apart = (lattice.e_app_mpa().unwrap() - limit.e_app_mpa().unwrap()).abs();
    let both = lattice.stated_errors_mpa()[1].unwrap() + stated;
    assert!(apart < both, "{apart} {both}");
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
fn graded_lattices_of_the_real_stack_are_near_voxel_elements() {
    let Some(stack) = shared_stack() else { return };
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
