//! `history.csv` has a row for all that a scene reported.

use super::{Kept, strip_text};
use bonepd_ct::command::scene::scene;
use bonepd_ct::machine::session::Session;
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::{Scene, run};

/// What was reported, and the rows of the file.
fn rows(text: &str) -> (Kept, Vec<Vec<f64>>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let quiet = Session {
        quiet: true,
        ..Session::default()
    };
    scene(&path, &folder.path().join("out"), &quiet).unwrap();
    let mut file = csv::Reader::from_path(folder.path().join("out/history.csv")).unwrap();
    let row = |r: csv::StringRecord| r.iter().map(|v| v.parse().unwrap()).collect();
    let rows = file.records().map(|r| row(r.unwrap())).collect();
    let mut kept = Kept::default();
    run(
        &Scene::parse(text, &path).unwrap(),
        &Inputs::default(),
        &mut kept,
    )
    .unwrap();
    (kept, rows)
}

/// A break at constant load is two rows, before and after, of one time; a sweep may come to a value twice.
#[test]
fn rows_of_one_time_are_all_kept() {
    let stops = strip_text("", 0.4) + "\nstop = { box = [-3, -3, 15, 3] }";
    let sweep = format!(
        "{}\n[physics.continuum-molecular.sweep]\nparameter = 'angle'\nvalues = [30, 30, 0]",
        super::stretched_block("young = 1000\npoisson = 0.2")
    );
    for text in [stops, sweep] {
        let (kept, rows) = rows(&text);
        assert_eq!(rows.len(), kept.frames.len());
        let same = |w: &&[Vec<f64>]| w[0][0] == w[1][0];
        assert!(rows.windows(2).filter(same).count() > 0, "{rows:?}");
        for (frame, row) in kept.frames.iter().zip(rows) {
            let numbers = frame.numbers.iter().map(|(_, v)| *v);
            assert_eq!(row[0], frame.time);
            assert!(numbers.zip(&row[1..]).all(|(a, b)| a == *b || a.is_nan()));
        }
    }
}
