//! Every recipe of `pipelines/` on the sample scans, one number each; and the report a reader opens.
//!
//! The moduli are this program's own (seeded phantom, no outside reference); what holds from outside is that floppy
//! lies below firm and both below the Voigt bound E · BV/TV of their own lattice's bone. 0.5 % leaves room for the
//! recipes' solver tolerances (0.1 %, quick 1 %).

use crate::cli::run;
use bonepd_ct::io::table;
use bonepd_ct::recipe::Recipe;
use bonepd_ct::result::row::Row;
use bonepd_ct::result::settings::BoundaryRule;
use serde_json::Value;
use std::collections::BTreeSet;
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
        row.key.structure.name() == structure
            && row.key.boundary.map(BoundaryRule::name) == Some(boundary)
            && row.key.lp_mm == lp_mm
    };
    rows.iter()
        .find(same)
        .and_then(|row| row.e_app_mpa())
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
    let met = |r: &&Row| r.error().is_some_and(|error| error <= 0.2);
    assert!(
        rows.iter()
            .filter(|r| r.key.scan == "trabecular")
            .any(|r| met(&r))
    );
    let mut gap = rows.iter().filter(|r| r.key.scan == "gap").peekable();
    assert!(gap.peek().is_some() && gap.all(Row::is_disconnected));
}

#[test]
fn the_papers_protocol() {
    let (_dir, rows) = run_recipe("paper.toml", &["trabecular.nii.gz"]);
    assert_eq!(rows.len(), 12);
    near(modulus(&rows, "sc", "ffb", 0.06), 42.10, 0.005);
    for lp in [0.06, 0.08, 0.10, 0.12] {
        assert!(modulus(&rows, "sc", "floppy", lp) < modulus(&rows, "sc", "firm", lp));
    }
    for key in rows.iter().map(|row| &row.key) {
        let settings = (key.strain, key.grip_mm, key.poisson, key.young_mpa);
        assert_eq!(settings, (-0.0042, 0.6, 0.3, 1000.0));
    }
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

/// A line `key = value` of a recipe, in use or in a comment, with the table it stands in.
struct Line {
    table: String,
    key: String,
    text: String,
    comment: bool,
}

impl Line {
    fn name(&self) -> String {
        match self.table.is_empty() {
            true => self.key.clone(),
            false => format!("{}.{}", self.table, self.key),
        }
    }

    /// The recipe that says this and nothing else; what it needs beside (voxel-fe) is not asked for.
    fn alone(&self) -> Recipe {
        let table = match self.table.is_empty() {
            true => String::new(),
            false => format!("[{}]\n", self.table),
        };
        let text = format!("{table}{}\n", self.text);
        toml::from_str(&text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }
}

fn lines(text: &str) -> Vec<Line> {
    let (mut table, mut lines) = (String::new(), Vec::new());
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            table = name.to_owned();
        }
        let (comment, text) = match line.strip_prefix("# ") {
            Some(text) => (true, text),
            None => (false, line),
        };
        let Some((key, _)) = text.split_once(" = ") else {
            continue;
        };
        if key.bytes().all(|c| c.is_ascii_lowercase() || c == b'_') {
            lines.push(Line {
                table: table.clone(),
                key: key.to_owned(),
                text: text.to_owned(),
                comment,
            });
        }
    }
    lines
}

#[test]
fn the_papers_recipe_names_every_key_with_its_default() {
    let lines = lines(&std::fs::read_to_string(at_root("pipelines/paper.toml")).unwrap());
    let Value::Object(known) = serde_json::to_value(Recipe::default()).unwrap() else {
        panic!("a recipe is a table");
    };
    let keys: BTreeSet<String> = known
        .iter()
        .flat_map(|(table, inner)| match inner {
            Value::Object(keys) => keys.keys().map(|key| format!("{table}.{key}")).collect(),
            _ => vec![table.clone()],
        })
        .collect();
    let named: BTreeSet<String> = lines.iter().map(Line::name).collect();
    assert_eq!(named, keys);
    assert_eq!(lines.len(), keys.len(), "a key stands twice");
    for line in lines.iter().filter(|line| line.comment) {
        let recipe = line.alone();
        let default = known
            .get(&line.table)
            .map_or(&Value::Null, |t| &t[&line.key]);
        // Examples stand where there is no default, or where an empty list is one.
        let example = default.is_null() || line.key == "labels";
        assert_eq!(recipe != Recipe::default(), example, "{}", line.name());
    }
}

/// The same specimen as HU in NIfTI and as counts of a scanner: one mask.
#[test]
fn the_papers_window_is_of_hu_in_every_format() {
    use bonepd_ct::command::segment::in_memory;
    use bonepd_ct::image::scan;
    use bonepd_ct::machine::session::Session;
    let recipe = Recipe::read(&at_root("pipelines/paper.toml")).unwrap();
    let nifti = at_root("sample_data/trabecular.nii.gz");
    let volume = scan::read(&nifti, None).unwrap().volume;
    // Two counts a HU, from -1000 HU on: water has 0.25 / cm, and 8000 counts are 1 / cm.
    let counts = volume.as_slice().iter().map(|hu| 2.0 * (hu + 1000.0));
    let counts: Vec<u8> = counts.flat_map(|v| (v as i16).to_le_bytes()).collect();
    let dir = tempfile::tempdir().unwrap();
    let aim = dir.path().join("trabecular.aim");
    let log = "! Mu_Scaling 8000\nHU: mu water 0.25\n";
    let nano = volume.grid.spacing_mm.map(|mm| (mm * 1e6).round() as i64);
    let bytes = crate::formats::aim_v3_of(volume.grid.n, nano, log, &counts);
    std::fs::write(&aim, bytes).unwrap();
    let session = Session::default();
    let mask = |path: &Path| {
        in_memory(path, None, &recipe.segment, &session)
            .unwrap()
            .bone
    };
    let (theirs, ours) = (mask(&aim), mask(&nifti));
    assert_eq!(theirs.grid.n, ours.grid.n);
    assert!(ours.as_slice().contains(&1));
    assert!(theirs.as_slice() == ours.as_slice(), "the masks differ");
}
