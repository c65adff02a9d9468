//! `report` through the built program: what it reads, and what it compares.

use crate::cli::run;
use crate::cohort::{cohort, rows, text};
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::BoundaryRule;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A cohort of `n` scans after `run` with these words; the folder that holds it, and `out` in it.
fn solved(n: usize, more: &[&str]) -> (tempfile::TempDir, std::path::PathBuf) {
    let (dir, scans, recipe) = cohort(n);
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    let (code, _, stderr) = run(&[&words[..], more].concat());
    assert!(code <= 1, "{stderr}");
    (dir, out)
}

/// The text of a new report of `out`, and the rows it is of.
fn report_of(out: &Path) -> (String, Vec<Row>) {
    let to = out.join("again");
    let (code, _, stderr) = run(&["report", text(out), "-o", text(&to)]);
    assert_eq!(code, 0, "{stderr}");
    let page = fs::read_to_string(to.join("report.md")).unwrap();
    (page, rows(&to))
}

#[test]
fn a_scan_solved_again_after_the_run_is_read_from_its_own_folder() {
    let (_dir, out) = solved(3, &[]);
    let (before, _) = report_of(&out);
    assert!(!before.contains("no converged"), "{before}");
    // As the run left it, its table is read, and no row twice.
    assert_eq!(report_of(&out).1, rows(&out));
    let s2 = out.join("s2");
    let more = ["solve", text(&s2), "--method", "voxel-fe"];
    assert_eq!(run(&more).0, 0);
    let (after, found) = report_of(&out);
    assert_eq!(found.len(), rows(&out).len() + 1);
    assert!(
        found
            .windows(2)
            .all(|two| two[0].key.scan <= two[1].key.scan)
    );
    // The one solve more takes nothing from the statistics, and is named.
    let statistics = |page: &str| {
        let (_, from) = page.split_once("## Statistics").unwrap();
        from.split_once("## Figures").unwrap().0.to_owned()
    };
    assert_eq!(statistics(&after), statistics(&before));
    let named = "fewer than 3 scans, in no comparison: voxel FE";
    assert!(after.contains(named), "{after}");
}

#[test]
fn a_scan_of_other_settings_is_named_and_not_compared() {
    let (_dir, out) = solved(4, &[]);
    let s4 = out.join("s4");
    fs::remove_file(s4.join("results.json")).unwrap();
    fs::remove_file(s4.join("results.csv")).unwrap();
    assert_eq!(run(&["solve", text(&s4), "--young-mpa", "500"]).0, 0);
    let (page, _) = report_of(&out);
    assert!(page.contains("left out: s4 (E 500 MPa)"), "{page}");
    assert!(page.contains("floppy; firm over 3 scans"), "{page}");
}

#[test]
fn a_mean_of_what_is_not_converged_is_not_compared() {
    let (dir, scans, recipe) = cohort(3);
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    let stopped = fs::read_to_string(&recipe).unwrap() + "max_iterations = 2\n";
    fs::write(&recipe, stopped).unwrap();
    assert_eq!(run(&words).0, 1);
    let means: Vec<Row> = rows(&out);
    let means = means
        .iter()
        .filter(|row| row.key.boundary == Some(BoundaryRule::Ffb));
    assert!(means.clone().count() == 6 && means.clone().all(|row| row.converged() == Some(false)));
    let (page, _) = report_of(&out);
    assert!(!page.contains("## Statistics"), "{page}");
}

#[test]
fn an_error_that_is_not_met_stands_in_the_rows() {
    let (_dir, out) = solved(1, &["--error", "0.05%"]);
    let own = out.join("s1");
    let noted = |rows: Vec<Row>, percent: &str| -> Vec<Option<BoundaryRule>> {
        let words = format!("the error asked for, {percent} %, is not met");
        let about = rows
            .into_iter()
            .filter(|row| row.marks.note.as_ref().is_some_and(|n| n.contains(&words)));
        about.map(|row| row.key.boundary).collect()
    };
    // The nearest solve, in the table of the run and of the scan.
    let nearest = [None];
    assert_eq!(noted(rows(&out), "0.05"), nearest);
    assert_eq!(noted(rows(&own), "0.05"), nearest);
    assert!(report_of(&out).0.contains("the error asked for, 0.05 %"));
    // Another error asked for: what was said of the first is gone.
    assert_eq!(run(&["solve", text(&own), "--error", "0.06%"]).0, 1);
    assert_eq!(noted(rows(&own), "0.06"), nearest);
    assert_eq!(noted(rows(&own), "0.05"), []);
    // Redone, all its resolutions are there: no step drops what another solved.
    let solved = |rows: Vec<Row>| -> BTreeSet<String> {
        let name = |row: Row| {
            format!(
                "{:?} {} {:?}",
                row.key.method, row.key.lp_mm, row.key.boundary
            )
        };
        rows.into_iter().map(name).collect()
    };
    let before = solved(rows(&own));
    assert_eq!(
        run(&["solve", text(&own), "--error", "0.06%", "--force"]).0,
        1
    );
    assert_eq!(solved(rows(&own)), before);
}
