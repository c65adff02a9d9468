//! The answers of a run through the built program: `answers.csv`, `answer.json`, groups, and runs that add to a folder.

use crate::cli::run;
use crate::cohort::{cohort, rows, text};
use bonepd_ct::io::table;
use bonepd_ct::record::answer;
use bonepd_ct::result::answer::AnswerLine;
use std::fs;
use std::path::Path;

fn answers(out: &Path) -> Vec<AnswerLine> {
    table::read(&out.join("answers.csv")).unwrap()
}

fn page(out: &Path) -> String {
    fs::read_to_string(out.join("report/report.html")).unwrap()
}

#[test]
fn one_line_a_scan_with_one_plus_minus() {
    let (dir, scans, recipe) = cohort(2);
    let out = dir.path().join("out");
    let args = [
        "run",
        text(&recipe),
        text(&scans),
        "-o",
        text(&out),
        "--error",
        "20%",
    ];
    assert!(run(&args).0 <= 1);
    let found = answers(&out);
    let names: Vec<&str> = found.iter().map(|a| a.scan.as_str()).collect();
    assert_eq!(names, ["s1", "s2"]);
    for line in &found {
        let own = rows(&out)
            .into_iter()
            .filter(|row| row.key.scan == line.scan);
        let stated = own.filter_map(|row| {
            let [algebraic, discretisation] = row.stated_errors_mpa();
            Some((algebraic.unwrap_or(0.0) + discretisation?) / row.e_app_mpa()?)
        });
        let least = stated.fold(f64::INFINITY, f64::min);
        let error = line.error_mpa.unwrap() / line.e_app_mpa.unwrap();
        assert!((error / least - 1.0).abs() < 1e-9, "{error} {least}");
        assert!((line.error_percent.unwrap() / (100.0 * error) - 1.0).abs() < 1e-9);
        assert_eq!(line.met, Some(error <= 0.2));
        // 0.9 mm cubes at 1 %.
        let force = line.e_app_mpa.unwrap() * 0.81 * 0.01;
        assert!((line.force_n.unwrap() / force - 1.0).abs() < 1e-6);
        assert!((line.stiffness_n_per_mm.unwrap() / (force / 0.009) - 1.0).abs() < 1e-6);
        let kept = answer::read(&out.join(&line.scan)).unwrap();
        assert_eq!(
            (kept.e_app_mpa, kept.error_mpa, kept.target),
            (line.e_app_mpa, line.error_mpa, Some(0.2))
        );
        assert!(
            kept.conditions.starts_with("Compression by 1 % along z"),
            "{}",
            kept.conditions
        );
    }
    // The head of the page, before the first table.
    let page = page(&out);
    let (head, rest) = page.split_once("<table").unwrap();
    for said in ["Compression by 1 % along z", "Tissue modulus 1000 MPa"] {
        assert!(head.contains(said), "{said}");
    }
    assert!(
        rest.split_once("</table>")
            .unwrap()
            .0
            .contains("E_app ± error")
    );
}

#[test]
fn a_coarser_solve_later_does_not_replace_the_answer() {
    let (dir, scans, recipe) = cohort(1);
    let out = dir.path().join("out");
    let (recipe, scans) = (text(&recipe), text(&scans));
    let target = ["run", recipe, scans, "-o", text(&out), "--error", "40%"];
    assert!(run(&target).0 <= 1);
    let scan = out.join("s1");
    let before = answer::read(&scan).unwrap();
    let (code, said, _) = run(&["solve", text(&scan), "--lp", "0.15"]);
    assert_eq!(code, 0);
    assert!(said.contains(" ffb "), "{said}");
    let after = answer::read(&scan).unwrap();
    assert_eq!(after.conditions, before.conditions);
    assert_eq!(
        (after.e_app_mpa, after.method, after.target, after.met),
        (before.e_app_mpa, before.method, Some(0.4), before.met)
    );
    let report = out.join("again");
    assert_eq!(run(&["report", text(&out), "-o", text(&report)]).0, 0);
    let again: Vec<AnswerLine> = table::read(&report.join("answers.csv")).unwrap();
    assert_eq!(
        (again[0].e_app_mpa, again[0].met),
        (before.e_app_mpa, before.met)
    );
    // Other conditions have no target; what was asked for of the first stays.
    let sideways = ["solve", text(&scan), "--lp", "0.15", "--axis", "x"];
    assert_eq!(run(&sideways).0, 0);
    let other = answer::read(&scan).unwrap();
    assert_eq!((other.target, other.met), (None, None));
    assert_eq!(run(&sideways[..4]).0, 0);
    assert_eq!(answer::read(&scan).unwrap().met, before.met);
}

#[test]
fn groups_are_compared_over_subjects() {
    let (dir, _scans, recipe) = cohort(6);
    let manifest = dir.path().join("cohort.csv");
    let line = |i: usize| {
        let group = if i < 4 { "control" } else { "OA" };
        // The first two scans are of one subject.
        let subject = i.max(2);
        format!("scans/s{i}.nii.gz,{group},p{subject}\n")
    };
    let lines: String = (1..=6).map(line).collect();
    fs::write(&manifest, format!("path,group,subject\n{lines}")).unwrap();
    let out = dir.path().join("out");
    let args = ["run", text(&recipe), text(&manifest), "-o", text(&out)];
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    let lines = fs::read_to_string(out.join("report/groups.csv")).unwrap();
    let control = lines
        .lines()
        .find(|l| l.starts_with("E_app (MPa),control,"))
        .unwrap();
    // Three scans of two subjects.
    assert!(control.starts_with("E_app (MPa),control,3,2,"), "{control}");
    let compared = fs::read_to_string(out.join("report/comparisons.csv")).unwrap();
    assert!(
        compared.contains("E_app (MPa),control,OA,independent,"),
        "{compared}"
    );
    let page = page(&out);
    for said in [
        "Mann–Whitney",
        "Hedges’ g",
        "CI widened by stated errors",
        "Apparent modulus by group",
        "control (n = 2)",
    ] {
        assert!(page.contains(said), "{said}");
    }
    // Methods and times are behind folds, after what is of bone.
    let (before, after) = page.split_once("<h2 id=\"solves\">").unwrap();
    assert!(before.contains("id=\"groups\"") && !before.contains("Time of a solve"));
    assert!(after.contains("<details><summary>Methods against each other"));
    assert!(!page.contains("Validation"));
}

#[test]
fn a_second_run_into_a_folder_adds_to_it() {
    let (dir, scans, recipe) = cohort(2);
    let out = dir.path().join("out");
    let scan = |i: usize| scans.join(format!("s{i}.nii.gz"));
    let one = |i: usize, more: &[&str]| {
        let path = scan(i);
        let words = ["run", text(&recipe), text(&path), "-o", text(&out)];
        let (code, _, stderr) = run(&[&words[..], more].concat());
        assert_eq!(code, 0, "{stderr}");
        stderr
    };
    one(1, &[]);
    let first = rows(&out);
    let said = one(2, &[]);
    assert!(
        said.contains("scans of earlier runs") && said.contains("s1"),
        "{said}"
    );
    assert_eq!(rows(&out)[..first.len()], first);
    assert_eq!(answers(&out).len(), 2);
    // Another load of one scan: its earlier rows stay, its answer is of the condition that both scans share.
    let said = one(2, &["--axis", "x"]);
    assert!(said.contains("recipe.old.toml"), "{said}");
    assert_eq!(rows(&out).len(), 3 * first.len());
    assert!(answers(&out).iter().all(|a| a.axis == "z"));
    assert!(page(&out).contains("has rows of other conditions too"));
}

#[test]
fn the_same_specimen_twice_is_said() {
    let (dir, scans, recipe) = cohort(1);
    fs::copy(scans.join("s1.nii.gz"), scans.join("again.nii.gz")).unwrap();
    let out = dir.path().join("out");
    assert_eq!(
        run(&["run", text(&recipe), text(&scans), "-o", text(&out)]).0,
        0
    );
    assert!(
        page(&out).contains("again and s1 are the same mask voxel by voxel"),
        "not said"
    );
}

#[test]
fn what_was_asked_for_is_on_the_page() {
    let (dir, scans, recipe) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let words = [
        "run",
        text(&recipe),
        text(&scan),
        "-o",
        text(&out),
        "--method",
        "voxel-fe",
    ];
    let more = ["--failure", "--fields", "sed"];
    let (code, stdout, stderr) = run(&[&words[..], &more[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("failure load"), "{stdout}");
    let load = answers(&out)[0].failure_load_n.unwrap();
    assert!(load > 0.0);
    let found = page(&out);
    for said in [
        "failure load (N)",
        "Field sed-mpa, mid-slices",
        "field-sed-mpa.nii.gz",
    ] {
        assert!(found.contains(said), "{said}");
    }
    let stiffness = dir.path().join("stiffness");
    let words = [
        "run",
        text(&recipe),
        text(&scan),
        "-o",
        text(&stiffness),
        "--method",
        "voxel-fe",
        "--load",
        "stiffness",
    ];
    assert_eq!(run(&words).0, 0);
    let found = page(&stiffness);
    for said in ["Apparent stiffness", "E1 (MPa)", "axis 1 (x, y, z)", "ν12"] {
        assert!(found.contains(said), "{said}");
    }
}
