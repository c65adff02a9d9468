//! Every recipe of `pipelines/` on the sample scans, one number each; and the report a reader opens.
//!
//! The moduli are this program's own (seeded phantom, no outside reference); what holds from outside is that floppy
//! lies below firm and both below the Voigt bound E · BV/TV of their own lattice's bone. 0.5 % leaves room for the
//! recipes' solver tolerances (0.1 %, quick 1 %).

use crate::cli::run;
use bonepd_ct::io::table;
use bonepd_ct::measure::row::Row;
use std::path::{Path, PathBuf};

fn at_root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Runs a recipe on scans of `sample_data` and returns the folder with its rows.
fn run_recipe(recipe: &str, scans: &[&str]) -> (tempfile::TempDir, Vec<Row>) {
    let dir = tempfile::tempdir().unwrap();
    let recipe = at_root("pipelines").join(recipe);
    let inputs: Vec<PathBuf> = scans
        .iter()
        .map(|scan| at_root("sample_data").join(scan))
        .collect();
    let mut args = vec![
        "run",
        recipe.to_str().unwrap(),
        "-o",
        dir.path().to_str().unwrap(),
    ];
    args.extend(inputs.iter().map(|input| input.to_str().unwrap()));
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    let rows = table::read(&dir.path().join("results.csv")).unwrap();
    (dir, rows)
}

fn modulus(rows: &[Row], structure: &str, boundary: &str, lp_mm: f64) -> f64 {
    let same = |row: &&Row| {
        row.structure == structure
            && row.boundary.as_deref() == Some(boundary)
            && row.lp_mm == lp_mm
    };
    rows.iter()
        .find(same)
        .and_then(|row| row.e_app_mpa)
        .unwrap()
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found / expected - 1.0).abs() < tolerance,
        "{found} is not {expected}"
    );
}

/// The error asked for decides what is solved; the scan that carries no load has none.
#[test]
fn to_a_stated_error() {
    let (_dir, rows) = run_recipe("to-an-error.toml", &["trabecular.nii.gz", "gap.nii.gz"]);
    let met = |r: &&Row| {
        let stated = r.algebraic_error_mpa.unwrap_or(f64::INFINITY)
            + r.discretization_error_mpa.unwrap_or(f64::INFINITY);
        stated < 0.05 * r.e_app_mpa.unwrap_or(0.0)
    };
    assert!(
        rows.iter()
            .filter(|r| r.scan == "trabecular")
            .any(|r| met(&r))
    );
    let mut gap = rows.iter().filter(|r| r.scan == "gap").peekable();
    assert!(gap.peek().is_some() && gap.all(|r| r.e_app_mpa == Some(0.0)));
}

#[test]
fn the_papers_protocol() {
    let (_dir, rows) = run_recipe("paper.toml", &["trabecular.nii.gz"]);
    assert_eq!(rows.len(), 12);
    near(modulus(&rows, "sc", "ffb", 0.06), 42.10, 0.005);
    for lp in [0.06, 0.08, 0.10, 0.12] {
        assert!(modulus(&rows, "sc", "floppy", lp) < modulus(&rows, "sc", "firm", lp));
    }
    let settings = |row: &Row| (row.strain, row.grip_mm, row.poisson, row.young_mpa);
    assert!(
        rows.iter()
            .all(|row| settings(row) == (-0.0042, 0.6, 0.3, 1000.0))
    );
}

#[test]
fn the_quick_look() {
    let (_dir, rows) = run_recipe("quick.toml", &["trabecular.nii.gz"]);
    // Solved to 1 %.
    near(modulus(&rows, "sc", "ffb", 0.10), 35.75, 0.015);
}

#[test]
fn bcc_against_sc_with_a_report_over_three_scans() {
    let scans = ["trabecular.nii.gz", "dense.nii.gz", "sparse.nii.gz"];
    let (dir, rows) = run_recipe("bcc-against-sc.toml", &scans);
    near(modulus(&rows, "sc", "ffb", 0.08), 32.54, 0.005);
    near(modulus(&rows, "bcc", "ffb", 0.08), 46.66, 0.005);
    let report = dir.path().join("report");
    let page = std::fs::read_to_string(report.join("report.html")).unwrap();
    for scan in ["trabecular", "dense", "sparse"] {
        assert!(
            page.contains(&format!("id=\"scan-{scan}\"")),
            "{scan} has no page"
        );
    }
    for said in [
        "<svg",
        "data:image/png;base64,",
        "structure = [",
        "Bland and Altman",
        "BLAKE3 of the input",
    ] {
        assert!(page.contains(said), "the page lacks {said}");
    }
    // Self-contained: nothing is loaded from elsewhere.
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "<link"] {
        assert!(!page.contains(outside), "the page asks for {outside}");
    }
    // Drawings share one document, so their ids must not.
    let ids: Vec<&str> = page
        .split(" id=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .collect();
    let unique: std::collections::HashSet<&&str> = ids.iter().collect();
    assert_eq!(unique.len(), ids.len(), "ids repeat");
    for file in [
        "regressions.csv",
        "agreement.csv",
        "anova.csv",
        "distributions.csv",
        "methods.svg",
        "methods.png",
    ] {
        assert!(report.join(file).is_file(), "{file}");
    }
}
