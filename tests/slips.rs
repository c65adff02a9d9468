//! Everyday slips through the built program: each ends in words that say what to do.

use crate::cli::{bonepd, run};
use crate::cohort::{cohort, rows, text};
use bonepd_ct::result::row::Row;
use std::fs;
use std::path::Path;

#[test]
fn flags_of_other_programs_are_hinted() {
    for (args, said) in [
        (
            &["segment", "x.nii", "-o", "d", "--threshold", "200"][..],
            "--lower V",
        ),
        (
            &["segment", "x.nii", "-o", "d", "--voxel-size", "0.02"],
            "--spacing MM",
        ),
        (&["solve", "d", "--E", "10"], "--young-mpa E"),
        (&["solve", "d", "--nu=0.3"], "--poisson NU"),
        (
            &["solve", "d", "--boundary-condition", "fixed"],
            "--ends free or bonded",
        ),
        (&["solve", "d", "-o", "x"], "omit -o"),
        (&["run", "scan.nii", "-o", "d"], "the recipe comes first"),
    ] {
        let (code, _, stderr) = run(args);
        assert_eq!(code, 2, "{args:?}");
        let hint = stderr.lines().find(|line| line.starts_with("hint: "));
        assert!(
            hint.is_some_and(|h| h.contains(said)),
            "{args:?} said: {stderr}"
        );
    }
    // Where clap says it all, nothing is added.
    assert!(!run(&["solve", "d", "--frobnicate"]).2.contains("hint:"));
}

#[test]
fn shares_above_one_are_refused_and_percentages_are_alike() {
    for (args, said) in [
        (&["solve", "d", "--error", "3"][..], "300 %"),
        (&["solve", "d", "--tolerance", "1"], "100 %"),
        (&["solve", "d", "--strain", "-1"], "-1% or -0.01"),
        (&["solve", "d", "--strain", "one"], "percentage"),
    ] {
        let (code, _, stderr) = run(args);
        assert!(
            code == 2 && stderr.contains(said),
            "{args:?} said: {stderr}"
        );
    }
    // Understood: what is wrong is the folder.
    let (_, _, stderr) = run(&[
        "solve",
        "no-such-folder",
        "--strain",
        "-1%",
        "--error",
        "3%",
    ]);
    assert!(stderr.contains("no-such-folder"), "{stderr}");
}

#[test]
fn scans_recipes_and_results_in_each_others_places_are_named() {
    let (dir, scans, recipe) = cohort(2);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let said = |args: &[&str], words: &str| {
        let (code, _, stderr) = run(args);
        assert!(
            code == 2 && stderr.contains(words),
            "{args:?} said: {stderr}"
        );
        assert!(stderr.contains("what to do"), "{stderr}");
    };
    let run_ = |recipe: &Path, input: &Path, words: &str| {
        said(&["run", text(recipe), text(input), "-o", text(&out)], words);
    };
    run_(&scan, &recipe, "give the recipe first");
    said(
        &["segment", text(&scans), "-o", text(&out), "--lower", "500"],
        "holds 2 scans",
    );
    assert!(!out.exists());
    assert_eq!(
        run(&["run", text(&recipe), text(&scan), "-o", text(&out)]).0,
        0
    );
    let other = dir.path().join("other");
    for results in [out.join("s1"), out.join("report")] {
        let args = ["run", text(&recipe), text(&results), "-o", text(&other)];
        said(&args, "folder of results");
    }
}

/// The scans' own folder as output, twice.
#[test]
fn results_among_the_scans_are_not_taken_for_scans() {
    let (_dir, scans, recipe) = cohort(2);
    let args = ["run", text(&recipe), text(&scans), "-o", text(&scans)];
    assert_eq!(run(&args).0, 0);
    let first = rows(&scans);
    let (code, stdout, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stdout.contains("s1 (1 of 2)") && stdout.contains("up to date"),
        "{stdout}"
    );
    assert_eq!(rows(&scans), first);
}

#[test]
fn unusual_settings_are_warned_of_once_and_stand_in_the_rows() {
    let (dir, scans, recipe) = cohort(3);
    let out = dir.path().join("out");
    let more = ["--grip-mm", "0.15", "--young-mpa", "10", "--lp", "0.1,0.15"];
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    let (code, _, stderr) = run(&[&words[..], &more[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    for said in [
        "grips of 0.15 mm hold 33 % of the height",
        "would be 10000 MPa",
    ] {
        let lines: Vec<&str> = stderr.lines().filter(|line| line.contains(said)).collect();
        assert_eq!(lines.len(), 2, "{said}: {stderr}");
        assert!(lines[1].contains("of 3 scans (s1, s2, s3)"), "{stderr}");
        let noted = |row: &Row| row.marks.note.as_ref().is_some_and(|n| n.contains(said));
        assert!(rows(&out).iter().all(noted), "{said}");
        for page in ["report/report.html", "report/report.md"] {
            let page = fs::read_to_string(out.join(page)).unwrap();
            assert!(page.contains(said), "{said} is not on the page");
            assert!(page.contains("3 of 3 scans (s1, s2, s3)"));
        }
    }
}

#[test]
fn a_solve_in_the_folder_of_a_run_takes_its_load_and_tissue() {
    let (dir, scans, recipe) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let settings = fs::read_to_string(&recipe).unwrap()
        + "strain = -0.0042\ngrip_mm = 0.05\nyoung_mpa = 2000.0\n";
    fs::write(&recipe, settings).unwrap();
    assert_eq!(
        run(&["run", text(&recipe), text(&scan), "-o", text(&out)]).0,
        0
    );
    let own = out.join("s1");
    let solve = [
        "solve",
        text(&own),
        "--method",
        "voxel-fe",
        "--young-mpa",
        "3000",
    ];
    let (code, _, stderr) = run(&solve);
    assert_eq!(code, 0, "{stderr}");
    assert!(
        stderr.contains("are those of the run") && stderr.contains("grips 0.05 mm"),
        "{stderr}"
    );
    let found = rows(&own).pop().unwrap().key;
    assert_eq!(
        (found.strain, found.grip_mm, found.young_mpa),
        (-0.0042, 0.05, 3000.0)
    );
}

#[test]
fn results_go_to_stdout_and_all_else_to_stderr() {
    let (dir, scans, recipe) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let args = [
        "run",
        text(&recipe),
        text(&scan),
        "-o",
        text(&out),
        "--quiet",
    ];
    let (code, stdout, _) = run(&args);
    assert_eq!(code, 0);
    assert!(
        stdout.contains("s1 (1 of 1): E_app ") && stdout.contains("answers.csv"),
        "{stdout}"
    );
    let own = out.join("s1");
    let solve = ["solve", text(&own), "--quiet", "--force"];
    let (_, first, stderr) = run(&solve);
    assert!(
        first.contains("E_app ") && !stderr.contains("E_app "),
        "{first} {stderr}"
    );
    assert!(!first.contains("kept"), "{first}");
    // Not forced, all of it is kept, and says so.
    let (_, again, _) = run(&solve[..3]);
    let solved = |text: &str| text.lines().filter(|l| l.contains("kept")).count();
    let means = again.lines().filter(|line| line.contains(" ffb "));
    assert_eq!(means.count(), 2, "{again}");
    assert_eq!((solved(&again), again.lines().count()), (4, 6), "{again}");
    let (_, json, _) = run(&["solve", text(&own), "--json"]);
    assert!(
        serde_json::from_str::<serde_json::Value>(&json).is_ok(),
        "{json}"
    );
}

/// Where fields cannot be written, the row is there.
#[test]
fn a_row_is_written_before_its_fields() {
    let (dir, scans, _) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    assert_eq!(
        run(&["segment", text(&scan), "-o", text(&out), "--lower", "500"]).0,
        0
    );
    // A folder in the place of the file.
    fs::create_dir_all(out.join("field-sed-mpa.nii.gz/in-the-way")).unwrap();
    let args = [
        "solve",
        text(&out),
        "--method",
        "voxel-fe",
        "--fields",
        "sed",
    ];
    let (code, _, stderr) = run(&args);
    assert!(code == 2 && stderr.contains("field-sed-mpa"), "{stderr}");
    assert_eq!(rows(&out).len(), 1);
}

#[cfg(unix)]
#[test]
fn an_interrupt_says_how_to_go_on() {
    let (dir, scans, recipe) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let program = bonepd().get_program().to_owned();
    let child = std::process::Command::new(program)
        .args([
            "run",
            text(&recipe),
            text(&scan),
            "-o",
            text(&out),
            "--lp",
            "0.012",
            "--boundary",
            "firm",
        ])
        .stderr(std::process::Stdio::piped())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let start = std::time::Instant::now();
    while !out.join("s1/segment.json").is_file() {
        assert!(start.elapsed().as_secs() < 60, "no progress");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let id = child.id().to_string();
    assert!(
        std::process::Command::new("kill")
            .args(["-INT", &id])
            .status()
            .unwrap()
            .success()
    );
    let done = child.wait_with_output().unwrap();
    let words = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(130), "{words}");
    assert!(words.contains("the same command goes on"), "{words}");
}

#[test]
fn recipes_and_columns_are_printed() {
    let (code, list, _) = run(&["recipe"]);
    assert_eq!(code, 0);
    for name in ["paper", "quick", "to-an-error", "bcc-against-sc"] {
        assert!(list.contains(name), "{list}");
        let (code, recipe, _) = run(&["recipe", name]);
        assert!(code == 0 && recipe.contains("[solve]"), "{recipe}");
    }
    assert_eq!(run(&["recipe", "nothing"]).0, 2);
    let (code, columns, _) = run(&["columns"]);
    assert_eq!(code, 0);
    for said in ["answers.csv", "e_app_reaction_mpa", "N/mm", "failed.csv"] {
        assert!(columns.contains(said), "{said}");
    }
    let (_, one, _) = run(&["columns", "failed.csv", "--json"]);
    let one: serde_json::Value = serde_json::from_str(&one).unwrap();
    assert_eq!(one[0]["columns"][0]["name"], "scan");
    let (code, _, refusal) = run(&["columns", "segment.json"]);
    assert_eq!(code, 2);
    for known in ["results.csv", "answers.csv", "history.csv"] {
        assert!(refusal.contains(known), "{refusal}");
    }
}

/// A recipe in the program is taken by its name where no file has it.
#[test]
fn a_run_takes_a_recipe_by_name() {
    let (dir, scans, _) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let args = ["run", "quick", text(&scan), "-o", text(&out), "--dry-run"];
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
}
