//! `run` through the built program: isolation of failures, resuming, killing, manifests, recipes.

use crate::cli::{bonepd, run};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::image::nifti;
use bonepd_ct::io::table;
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::{BoundaryRule, Method};
use bonepd_ct::volume::Volume;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A porous block in 0.05 mm voxels: bone is 1000, pores are 0; another seed, another pattern.
fn scan(path: &Path, seed: usize, n: usize) {
    let grid = Grid::new([n, n, n], [0.05; 3]);
    let pore = |at: usize| {
        let [i, j, k] = [at % n, at / n % n, at / n / n];
        let mix = |h: u64, v: usize| {
            (h ^ v as u64)
                .wrapping_mul(0x9E37_79B9_7F4A_7C15)
                .rotate_left(31)
        };
        let hole = [seed, i / 3, j / 3, k / 3].into_iter().fold(1, mix);
        hole % 5 == 0 && k > 1 && k + 2 < n
    };
    let voxels = (0..grid.len()).map(|at| if pore(at) { 0i16 } else { 1000 });
    nifti::write(path, &Volume::from_vec(grid, voxels.collect())).unwrap();
}

const RECIPE: &str =
    "[segment]\nlower = 500.0\n[lattice]\nlp_mm = [0.15, 0.2]\n[solve]\ntolerance = 1e-6\n";

/// A folder with a recipe and `n` scans.
pub fn cohort(n: usize) -> (tempfile::TempDir, PathBuf, PathBuf) {
    let dir = tempfile::tempdir().unwrap();
    let (scans, recipe) = (dir.path().join("scans"), dir.path().join("recipe.toml"));
    fs::create_dir(&scans).unwrap();
    fs::write(&recipe, RECIPE).unwrap();
    for i in 1..=n {
        scan(&scans.join(format!("s{i}.nii.gz")), i, 18);
    }
    (dir, scans, recipe)
}

pub fn rows(out: &Path) -> Vec<Row> {
    table::read(&out.join("results.csv")).unwrap()
}

/// The text of the table, byte for byte, without the two columns that a clock and the system fill.
pub fn timeless(out: &Path) -> String {
    let text = fs::read_to_string(out.join("results.csv")).unwrap();
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .from_reader(text.as_bytes());
    let records: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let timed = |name: &str| ["wall_s", "peak_mib"].contains(&name);
    let keep: Vec<bool> = records[0].iter().map(|name| !timed(name)).collect();
    assert_eq!(keep.iter().filter(|k| !**k).count(), 2);
    let line = |record: &csv::StringRecord| {
        let cells = record.iter().zip(&keep).filter(|(_, keep)| **keep);
        cells.map(|(cell, _)| cell).collect::<Vec<_>>().join(",") + "\n"
    };
    records.iter().map(line).collect()
}

#[test]
fn a_bad_scan_is_named_and_the_others_finish() {
    let (dir, scans, recipe) = cohort(2);
    fs::write(scans.join("broken.nii.gz"), "no image").unwrap();
    let out = dir.path().join("out");
    let (code, _, stderr) = run(&["run", text(&recipe), text(&scans), "-o", text(&out)]);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("failed: broken"), "{stderr}");
    let log = fs::read_to_string(out.join("broken/log.txt")).unwrap();
    assert!(log.contains("failed: "), "{log}");
    // Two scans, two lattice parameters, floppy, firm and their mean.
    assert_eq!(rows(&out).len(), 12);
    assert!(
        rows(&out)
            .iter()
            .all(|row| row.e_app_mpa().is_some_and(|e| e > 0.0))
    );
    for file in [
        "report/report.md",
        "report/bv-tv.svg",
        "report/convergence-s1.png",
        "s1/log.txt",
        "s2/segment.png",
        "s2/bone.png",
        "report/view-s1.html",
    ] {
        assert!(out.join(file).is_file(), "{file}");
    }
}

#[test]
fn a_single_bad_scan_is_an_error_and_leaves_nothing() {
    let (dir, scans, recipe) = cohort(0);
    let (bad, out) = (scans.join("bad.nii"), dir.path().join("out"));
    fs::write(&bad, "no image").unwrap();
    let (code, _, stderr) = run(&["run", text(&recipe), text(&bad), "-o", text(&out)]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("bad.nii"), "{stderr}");
    assert!(!out.exists());
}

#[test]
fn what_is_up_to_date_is_kept_and_what_changed_is_redone() {
    let (dir, scans, recipe) = cohort(2);
    let out = dir.path().join("out");
    let args = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    assert_eq!(run(&args).0, 0);
    let first = rows(&out);
    assert_eq!(run(&args).0, 0);
    // Times are those of the first run: nothing was solved again.
    assert_eq!(rows(&out), first);
    scan(&scans.join("s2.nii.gz"), 4, 18);
    assert_eq!(run(&args).0, 0);
    let third = rows(&out);
    assert_eq!(third[..6], first[..6]);
    // Floppy: firm padding fills pores this small, so that it does not tell the two scans apart.
    let floppy = |rows: &[Row]| -> Vec<Option<f64>> {
        let own = rows
            .iter()
            .filter(|row| row.key.boundary == Some(BoundaryRule::Floppy));
        own.map(Row::e_app_mpa).collect()
    };
    assert_ne!(floppy(&third[6..]), floppy(&first[6..]));
}

#[test]
fn jobs_at_a_time_change_nothing_but_time() {
    let (dir, scans, recipe) = cohort(4);
    let (one, three) = (dir.path().join("one"), dir.path().join("three"));
    assert_eq!(
        run(&["run", text(&recipe), text(&scans), "-o", text(&one)]).0,
        0
    );
    let args = [
        "run",
        text(&recipe),
        text(&scans),
        "-o",
        text(&three),
        "--jobs",
        "3",
    ];
    assert_eq!(run(&args).0, 0);
    assert_eq!(timeless(&one), timeless(&three));
    // The process's memory is one scan's only where no other scan runs.
    let peak = |row: &Row| row.solved.as_ref().unwrap().peak_mib;
    let known = |out| rows(out).iter().any(|row| peak(row).is_some());
    assert_eq!((known(&one), known(&three)), (true, false));
}

/// Starts the run and kills it once `files` more results are there; false when it was done first.
fn kill_after(args: &[&str], out: &Path, files: usize) -> bool {
    let program = bonepd().get_program().to_owned();
    let mut child = std::process::Command::new(program)
        .args(args)
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let solved = || {
        let scans = fs::read_dir(out).into_iter().flatten().flatten();
        scans
            .filter(|scan| scan.path().join("results.json").is_file())
            .count()
    };
    let (before, start) = (solved(), Instant::now());
    while solved() < before + files {
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        assert!(start.elapsed() < Duration::from_secs(60), "no progress");
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    true
}

#[test]
fn a_run_killed_twice_ends_as_one_that_was_not() {
    let (dir, scans, recipe) = cohort(18);
    fs::write(scans.join("broken.nii.gz"), "no image").unwrap();
    // Solid pores: the threshold selects nothing.
    let empty = Grid::new([8; 3], [0.05; 3]);
    nifti::write(
        &scans.join("empty.nii.gz"),
        &Volume::from_vec(empty, vec![0i16; 512]),
    )
    .unwrap();
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    let args = |out| ["run", text(&recipe), text(&scans), "-o", out];
    let (code, _, stderr) = run(&args(text(&whole)));
    assert_eq!(code, 1);
    assert!(stderr.contains("failed: broken, empty"), "{stderr}");
    assert!(kill_after(&args(text(&cut)), &cut, 5));
    // What a writer leaves that is killed in the midst.
    let halves = ["", "s1", "report"].map(|folder| cut.join(folder).join(".writing-k1LLed"));
    for half in &halves {
        fs::create_dir_all(half.parent().unwrap()).unwrap();
        fs::write(half, "half a table").unwrap();
    }
    assert!(kill_after(&args(text(&cut)), &cut, 5));
    assert_eq!(run(&args(text(&cut))).0, 1);
    for half in halves {
        assert!(!half.exists(), "{}", half.display());
    }
    assert_eq!(rows(&whole).len(), 18 * 6);
    assert_eq!(timeless(&cut), timeless(&whole));
    let failed = |out: &Path| fs::read(out.join("failed.csv")).unwrap();
    assert_eq!(failed(&cut), failed(&whole));
    let page = fs::read_to_string(cut.join("report/report.html")).unwrap();
    assert!(
        page.contains("broken: failed, no results"),
        "the page is silent on the failure"
    );
}

#[test]
fn a_manifest_names_scans_groups_and_settings() {
    let (dir, scans, recipe) = cohort(2);
    let (manifest, out) = (dir.path().join("cohort.csv"), dir.path().join("out"));
    // As a spreadsheet writes it where the comma is the decimal mark.
    fs::write(
        &manifest,
        "path;name;group;subject;spacing_mm\r\nscans/s1.nii.gz;left;OA;p1;0,06\r\nscans/s2.nii.gz;right;;p1;\r\n",
    )
    .unwrap();
    let (code, _, stderr) = run(&["run", text(&recipe), text(&manifest), "-o", text(&out)]);
    assert_eq!(code, 0, "{stderr}");
    let rows = rows(&out);
    assert!(scans.is_dir() && rows.len() == 12);
    let facts = |row: &Row| {
        (
            row.key.scan.clone(),
            row.marks.group.clone(),
            row.key.voxel_mm,
        )
    };
    assert_eq!(
        facts(&rows[0]),
        ("left".into(), Some("OA".into()), [0.06; 3])
    );
    assert_eq!(facts(&rows[11]), ("right".into(), None, [0.05; 3]));
    assert!(
        rows.iter()
            .all(|row| row.marks.subject.as_deref() == Some("p1"))
    );
    // A later solve in a scan's folder belongs to the same group.
    let left = out.join("left");
    let args = ["solve", text(&left), "--lp", "0.3", "--boundary", "floppy"];
    assert_eq!(run(&args).0, 0);
    let own: Vec<Row> = table::read(&left.join("results.csv")).unwrap();
    assert_eq!(own.len(), 7);
    assert!(
        own.iter()
            .all(|row| row.marks.group.as_deref() == Some("OA"))
    );
}

#[test]
fn a_dry_run_lists_scans_with_their_needs_and_writes_nothing() {
    let (dir, scans, recipe) = cohort(2);
    let out = dir.path().join("out");
    let (code, stdout, stderr) = run(&[
        "run",
        text(&recipe),
        text(&scans),
        "-o",
        text(&out),
        "--dry-run",
        "--json",
    ]);
    assert_eq!(code, 0);
    assert!(
        stderr.contains("18 × 18 × 18 voxels") && stderr.contains("MiB"),
        "{stderr}"
    );
    let plan: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(plan[1]["scan"], "s2");
    assert_eq!(plan[1]["state"], "planned");
    assert!(!out.exists());
}

/// Half the scan is bone, in two halves that do not meet.
#[test]
fn a_scan_that_bears_no_load_is_told_as_such_and_named_once() {
    let (dir, scans, recipe) = cohort(0);
    let grid = Grid::new([12; 3], [0.05; 3]);
    let voxels = (0..grid.len()).map(|at| if (at / 144) % 7 < 3 { 1000i16 } else { 0 });
    let volume = Volume::from_vec(grid, voxels.collect());
    nifti::write(&scans.join("gap.nii.gz"), &volume).unwrap();
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    let floppy = [&words[..], &["--boundary", "floppy"]].concat();
    let (code, said, _) = run(&[&floppy[..], &["--dry-run"]].concat());
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("no bone from face to face"), "{said}");
    let (code, answer, said) = run(&floppy);
    assert_eq!(code, 0, "{said}");
    let warning = said.lines().find(|line| line.contains("removed")).unwrap();
    assert_eq!(warning.matches("gap").count(), 1, "{warning}");
    assert!(
        answer.contains("gap (1 of 1): carries no load: E_app 0 by floppy; 2 rows"),
        "{answer}"
    );
}

#[test]
fn a_setting_on_the_command_line_wins_over_the_recipe() {
    let (dir, scans, recipe) = cohort(1);
    let out = dir.path().join("out");
    let (scan, recipe) = (scans.join("s1.nii.gz"), text(&recipe));
    let args = [
        "run",
        recipe,
        text(&scan),
        "-o",
        text(&out),
        "--lp",
        "0.3",
        "--boundary",
        "floppy",
        "--axis",
        "x",
    ];
    assert_eq!(run(&args).0, 0);
    let rows = rows(&out);
    assert_eq!(rows.len(), 1);
    assert_eq!((rows[0].key.lp_mm, rows[0].key.axis), (0.3, Axis::X));
}

#[test]
fn a_run_that_cannot_be_meant_is_refused_and_leaves_nothing() {
    let (dir, scans, recipe) = cohort(1);
    let (out, scan) = (dir.path().join("out"), scans.join("s1.nii.gz"));
    let bad_recipe = |name: &str, content: &str| {
        let path = dir.path().join(name);
        fs::write(&path, content).unwrap();
        path
    };
    let unknown = bad_recipe("unknown.toml", "[solve]\ntolerence = 1e-3\n");
    let incompressible = bad_recipe("half.toml", "[solve]\npoisson = 0.5\n");
    let nothing = dir.path().join("nothing");
    for (recipe, input, more, said) in [
        (&unknown, &scan, vec![], "did you mean `tolerance`"),
        (&incompressible, &scan, vec![], "poisson"),
        (&nothing, &scan, vec![], "expected a recipe"),
        (&recipe, &nothing, vec![], "nothing"),
        (&recipe, &recipe, vec![], "recipe.toml"),
        (&recipe, &scan, vec!["--lower", "2000"], "2000"),
        (&recipe, &scan, vec!["--lp", "9"], "9"),
        (&recipe, &scan, vec!["--grip-mm", "0.5"], "grip"),
    ] {
        let mut args = vec!["run", text(recipe), text(input), "-o", text(&out)];
        args.extend(more);
        let (code, _, stderr) = run(&args);
        assert_eq!(code, 2, "{args:?}: {stderr}");
        assert!(stderr.contains(said), "{args:?} said: {stderr}");
        assert!(stderr.contains("what to do"), "{args:?} said: {stderr}");
        assert!(!out.join("report").exists(), "{args:?} left a report");
    }
}

#[test]
fn an_output_folder_that_cannot_be_made_is_an_error() {
    let (dir, scans, recipe) = cohort(1);
    let blocker = dir.path().join("blocker");
    fs::write(&blocker, "a file, not a folder").unwrap();
    let (code, _, stderr) = run(&[
        "run",
        text(&recipe),
        text(&scans),
        "-o",
        text(&blocker.join("out")),
    ]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("blocker"), "{stderr}");
}

#[test]
fn a_structure_that_does_not_connect_the_faces_has_modulus_zero() {
    let (dir, _, recipe) = cohort(0);
    let (path, out) = (dir.path().join("gap.nii.gz"), dir.path().join("out"));
    // A block in the lower half only: nothing reaches the upper face.
    let grid = Grid::new([12; 3], [0.05; 3]);
    let voxels = (0..grid.len()).map(|at| if at / 144 < 6 { 1000i16 } else { 0 });
    nifti::write(&path, &Volume::from_vec(grid, voxels.collect())).unwrap();
    let args = [
        "run",
        text(&recipe),
        text(&path),
        "-o",
        text(&out),
        "--boundary",
        "floppy",
        "--lp",
        "0.1",
    ];
    let (code, _, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    let rows = rows(&out);
    assert_eq!(rows[0].e_app_mpa(), Some(0.0));
    assert!(
        rows[0].marks.note.as_ref().unwrap().contains("no path"),
        "{:?}",
        rows[0].marks.note
    );
}

#[test]
fn a_solve_that_stops_early_exits_1_and_marks_its_row() {
    let (dir, scans, recipe) = cohort(1);
    let out = dir.path().join("out");
    fs::write(&recipe, format!("{RECIPE}max_iterations = 2\n")).unwrap();
    let (code, _, stderr) = run(&["run", text(&recipe), text(&scans), "-o", text(&out)]);
    assert_eq!(code, 1);
    assert!(stderr.contains("not converged"), "{stderr}");
    assert!(rows(&out).iter().any(|row| row.converged() == Some(false)));
    let report = fs::read_to_string(out.join("report/report.md")).unwrap();
    assert!(report.contains("not converged"), "{report}");
}

/// One scan of a finished cohort run anew, as on a cluster: the others stay in the tables, in their places.
#[test]
fn a_single_scan_run_anew_does_not_take_the_others_from_the_table() {
    let (dir, scans, recipe) = cohort(3);
    fs::write(scans.join("s2.nii.gz"), b"no scan").unwrap();
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    assert_eq!(run(&words).0, 1);
    let whole = timeless(&out);
    let again = [&words[..], &["--only", "s3", "--force"]].concat();
    assert_eq!(run(&again).0, 0);
    assert_eq!(timeless(&out), whole);
    let failed = fs::read_to_string(out.join("failed.csv")).unwrap();
    assert!(failed.contains("s2"), "{failed}");
}

#[test]
fn morphometry_stands_beside_the_modulus() {
    let (dir, scans, recipe) = cohort(1);
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    assert_eq!(run(&words).0, 0);
    assert!(rows(&out).iter().all(|row| row.marks.tb_th_mm.is_none()));
    let measured = [&words[..], &["--morphometry"]].concat();
    assert_eq!(run(&measured).0, 0);
    for row in rows(&out).iter().map(|row| &row.marks) {
        assert!(
            row.tb_th_mm.unwrap() > 0.05 && row.tb_sp_mm.unwrap() > 0.05,
            "{row:?}"
        );
        assert!(
            row.conn_d_per_mm3.is_some() && row.da.unwrap() >= 1.0,
            "{row:?}"
        );
    }
    let page = fs::read_to_string(out.join("report/report.html")).unwrap();
    assert!(page.contains("Tb.Sp (mm)") && page.contains("Conn.D"));
}

/// Every size is solved once, and stands once in the table.
#[test]
fn a_stated_error_leaves_no_row_twice() {
    let (dir, scans, recipe) = cohort(1);
    let out = dir.path().join("out");
    let words = [
        "run",
        text(&recipe),
        text(&scans),
        "-o",
        text(&out),
        "--error",
        "4%",
    ];
    assert!(run(&words).0 <= 1);
    let rows = rows(&out);
    assert!(rows.iter().any(|row| row.key.method == Method::VoxelFe));
    for (at, row) in rows.iter().enumerate() {
        assert!(!rows[..at].contains(row), "{row:?}");
    }
}

/// Rows of another mask, or of a scan that fails now, are not left where they look current.
#[test]
fn results_that_no_longer_hold_are_set_aside() {
    let (dir, scans, recipe) = cohort(2);
    let out = dir.path().join("out");
    let words = ["run", text(&recipe), text(&scans), "-o", text(&out)];
    assert_eq!(run(&words).0, 0);
    let (one, two) = (out.join("s1"), out.join("s2"));
    let there = |dir: &Path| ["results.csv", "results.old.csv"].map(|f| dir.join(f).is_file());
    let before = fs::read(one.join("results.csv")).unwrap();
    let scan_1 = scans.join("s1.nii.gz");
    let segment = |more: &[&str]| {
        let words = ["segment", text(&scan_1), "-o", text(&one), "--lower", "500"];
        let (code, _, stderr) = run(&[&words[..], more].concat());
        assert_eq!(code, 0, "{stderr}");
        stderr
    };
    // The same mask again: its results stay.
    segment(&["--force"]);
    assert_eq!(there(&one), [true, false]);
    let said = segment(&["--crop", "0:18,0:18,2:16"]);
    assert!(said.contains("results.old.csv"), "{said}");
    assert_eq!(there(&one), [false, true]);
    assert_eq!(fs::read(one.join("results.old.csv")).unwrap(), before);
    // Solved again, nothing old is left.
    assert_eq!(run(&["solve", text(&one)]).0, 0);
    assert_eq!(there(&one), [true, false]);

    fs::write(scans.join("s2.nii.gz"), "no image").unwrap();
    assert_eq!(run(&words).0, 1);
    assert_eq!(there(&two), [false, true]);
    // Nor do they come back with the next scan that is run alone.
    assert_eq!(run(&[&words[..], &["--only", "s1"]].concat()).0, 0);
    assert!(rows(&out).iter().all(|row| row.key.scan == "s1"));
    // Nothing is left to show.
    fs::write(&scan_1, "no image").unwrap();
    assert_eq!(run(&words).0, 1);
    assert_eq!(there(&out), [false, true]);
}
