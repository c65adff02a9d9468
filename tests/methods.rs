//! `methods.md` through the built program: what it says is what was done.

mod settings;

use crate::cli::run;
use crate::cohort::{cohort, text};
use std::fs;
use std::path::Path;

/// The methods section after `run` of two scans by this recipe, with these words.
fn methods(recipe_text: &str, more: &[&str]) -> String {
    let (dir, scans, recipe) = cohort(2);
    fs::write(&recipe, recipe_text).unwrap();
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    let (code, _, stderr) = run(&[&words[..], more].concat());
    assert!(code <= 1, "{stderr}");
    let said = fs::read_to_string(out.join("report/methods.md")).unwrap();
    // The page shows the same.
    let page = fs::read_to_string(out.join("report/report.html")).unwrap();
    let first = said
        .lines()
        .find(|line| line.contains("analysed with"))
        .unwrap();
    assert!(page.contains(first.split(". ").next().unwrap()), "{first}");
    said
}

fn has(text: &str, words: &[&str]) {
    for w in words {
        assert!(text.contains(w), "no `{w}` in\n{text}");
    }
}

#[test]
fn a_lattice_run_says_its_settings() {
    let recipe = "[segment]\nlower = 500.0\ngaussian_voxels = 0.4\nvoi = { cylinder = { diameter_mm = 0.8 } }\n[lattice]\nlp_mm = [0.15]\n[solve]\ntolerance = 1e-5\nyoung_mpa = 5500.0\npoisson = 0.25\nstrain = -0.0042\ngrip_mm = 0.1\n";
    let said = methods(recipe, &[]);
    has(
        &said,
        &[
            "2 scans were analysed with bonepd-ct",
            "voxel size was 0.05 mm",
            "(σ = 0.4 voxels)",
            "values of 500 in the units of the image or more",
            "cylinder d=0.8 mm",
            "Only the largest 6-connected component",
            "simple cubic lattices",
            "lattice parameter of 0.15 mm",
            "(FFB, Zojaji et al. 2024)",
            "Young's modulus of 5500 MPa and a Poisson's ratio of 0.25",
            "compressed along z by 0.42 %",
            "the outer 0.1 mm at each end moved as one along the axis and were free",
            "below 0.001 %",
        ],
    );
}

#[test]
fn a_run_by_voxels_says_its_settings() {
    let recipe = "loads = [\"uniaxial\", \"shear-x\"]\n[segment]\notsu = true\nkeep_all = true\nturn = \"x\"\ncrop = [[0, 18], [0, 18], [0, 16]]\n[solve]\nmethod = \"voxel-fe\"\nends = \"bonded\"\nfailure_labels = []\npistoia = { critical_volume = 0.05, critical_strain = 0.006 }\n";
    let said = methods(recipe, &[]);
    has(
        &said,
        &[
            "cropped to voxels 0 to 17, 0 to 17, 0 to 15 and turned so that their x axis became z",
            "not filtered",
            "Otsu's threshold (Otsu 1979)",
            "All bone was kept, connected or not.",
            "one eight-node hexahedral element. The edge of an element was 0.05 mm",
            "modulus of 1000 MPa",
            "held sideways (bonded)",
            "load shear-x",
            "below 0.1 %",
            "5.00 % of the bone exceed an effective strain of 0.006",
            "Pistoia, W.",
            "is the program's default",
        ],
    );
}

#[test]
fn a_target_and_other_methods_are_said() {
    let said = methods("[segment]\nlower = 500.0\n", &["--error", "40%"]);
    has(
        &said,
        &["The target of the stated error was 40 %; it was met on"],
    );
}

/// `report` on one solved scan: the settings of the solve, not those of a recipe.
#[test]
fn a_single_scan_says_its_settings() {
    let (dir, scans, _) = cohort(1);
    let folder = dir.path().join("one");
    let scan = scans.join("s1.nii.gz");
    let solved = |args: &[&str]| {
        let (code, _, stderr) = run(args);
        assert_eq!(code, 0, "{args:?}: {stderr}");
    };
    solved(&[
        "segment",
        text(&scan),
        "-o",
        text(&folder),
        "--labels",
        "1000",
    ]);
    solved(&[
        "solve",
        text(&folder),
        "--method",
        "voxel-fe",
        "--load",
        "stiffness",
        "--conditions",
        "mixed",
        "--coarsen",
        "2",
        "--coarsen-by",
        "fraction",
        "--poisson",
        "0.2",
    ]);
    let report = |to: &Path| {
        solved(&["report", text(&folder), "-o", text(to)]);
        fs::read_to_string(to.join("methods.md")).unwrap()
    };
    has(
        &report(&dir.path().join("report")),
        &[
            "1 scan was analysed",
            "had labelled 1000",
            "times its bone fraction",
            "edge of an element was 0.1 mm",
            "ratio of 0.2",
            "six unit strains under periodicity-compatible mixed",
            "Pahr, D. H.",
        ],
    );
}
