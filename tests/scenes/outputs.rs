//! What scenes read from and leave in folders: differences, folders used twice, dry runs, outlines, slices.

use super::{BODY, pipelines, run_scene};
use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::discretisation::plane::geometry::Geometry;
use bonepd_ct::draw::map;
use bonepd_ct::export::points;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::scene::Scene;
use bonepd_ct::scene::setting::{Inputs, Setting};
use bonepd_ct::volume::Volume;

/// Maps and numbers of the difference to another scene: what its fields say, with its sign; other points are refused.
#[test]
fn differences_to_another_scene_are_those_of_the_fields() {
    let dir = tempfile::tempdir().unwrap();
    let start = |name: &str, radius: f64, physics: &str, more: &str| {
        let scene = dir.path().join(format!("{name}.toml"));
        let text = format!(
            "geometry.disc.radius = {radius:?}\n{BODY}{more}\n[physics.{physics}]\nyoung = 100.0\n\
             growth = {{ rate = 1.0, stimulus = 0.01 }}\n"
        );
        std::fs::write(&scene, text).unwrap();
        let out = dir.path().join(name);
        run_scene(&scene, &out, &[])
    };
    let done = start("local", 6.0, "continuum", "");
    assert!(done.status.success(), "{done:?}");
    let done = start("bonds", 6.0, "bond-based", "minus = 'local'");
    assert!(done.status.success(), "{done:?}");
    let read = |name: &str| {
        points::read_column(
            &dir.path().join(name).join("fields_t4.csv"),
            "density_change",
        )
        .unwrap()
    };
    let (bonds, local) = (read("bonds"), read("local"));
    let change: Vec<f64> = bonds.iter().zip(&local).map(|(b, l)| b.1 - l.1).collect();
    let largest = change.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    assert!(largest > 1e-3);

    let table = std::fs::read_to_string(dir.path().join("bonds/difference.csv")).unwrap();
    let row = table.lines().find(|l| l.starts_with("4,")).unwrap();
    let row: Vec<f64> = row.split(',').map(|v| v.parse().unwrap()).collect();
    let n = change.len() as f64;
    let means = [
        change.iter().sum::<f64>() / n,
        change.iter().map(|v| v.abs()).sum::<f64>() / n,
    ];
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(
        near(row[1], means[0]) && near(row[2], means[1]) && near(row[4], largest),
        "{row:?}"
    );

    let pearson = {
        let centred = |v: &[([f64; 2], f64)]| -> Vec<f64> {
            let mean = v.iter().map(|(_, v)| v).sum::<f64>() / n;
            v.iter().map(|(_, v)| v - mean).collect()
        };
        let (a, b) = (centred(&bonds), centred(&local));
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        dot(&a, &b) / (dot(&a, &a) * dot(&b, &b)).sqrt()
    };
    assert!(table.lines().next().unwrap().ends_with(",correlation"));
    assert!(near(row[7], pearson) && pearson < 1.0, "{row:?} {pearson}");

    let cell = |p: &[f64; 2]| p.map(|v| (v - 0.5).round() as i32);
    let body = Points::from_cells([0.0; 2], 1.0, bonds.iter().map(|(p, _)| cell(p)).collect());
    let range = map::Range {
        low: -0.3,
        high: 0.3,
    };
    let drawn = image::open(dir.path().join("bonds/difference_t4.png"))
        .unwrap()
        .to_rgb8();
    assert!(drawn == map::draw(&body, &change, range, 4.0));

    for (name, radius, minus, expected) in [
        ("other", 7.0, "local", "not those of this scene"),
        ("lost", 6.0, "nowhere", "run that scene first"),
    ] {
        let done = start(name, radius, "bond-based", &format!("minus = '{minus}'"));
        let words = String::from_utf8_lossy(&done.stderr).replace('\n', " ");
        assert_eq!(done.status.code(), Some(2), "{words}");
        assert!(words.contains(expected), "{words}");
    }
    // Other steps end at the same times; what the other scene has not is named.
    let done = start("often", 6.0, "bond-based", "minus = 'local'\nevery = 1.5");
    let words = String::from_utf8_lossy(&done.stderr).replace('\n', " ");
    assert!(words.contains("no difference at t = 1.5, 3:"), "{words}");
}

/// A folder used again holds the new scene's results alone, and what is not a scene's stays.
#[test]
fn a_folder_used_again_keeps_nothing_of_the_scene_before() {
    let dir = tempfile::tempdir().unwrap();
    let (scene, out) = (dir.path().join("scene.toml"), dir.path().join("out"));
    let start = |output: &str, stimulus: &str| {
        let text = format!(
            "geometry.disc.radius = 6.0\n{BODY}{output}\n[physics.bond-based]\nyoung = 100.0\n\
             growth = {{ rate = 1.0, stimulus = {stimulus} }}\n"
        );
        std::fs::write(&scene, text).unwrap();
        run_scene(&scene, &out, &[]).status.code()
    };
    let there = |name: &str| out.join(name).exists();
    assert_eq!(start("every = 1.0", "0.01"), Some(0));
    assert!(there("fields_t1.csv") && there("density_change_t3.png") && there("fields_t2.vtk"));
    let animation = image::codecs::gif::GifDecoder::new(std::io::BufReader::new(
        std::fs::File::open(out.join("density_change.gif")).unwrap(),
    ));
    let frames = image::AnimationDecoder::into_frames(animation.unwrap());
    assert_eq!(frames.collect_frames().unwrap().len(), 5);
    std::fs::write(out.join("notes_t1.png"), "mine").unwrap();
    assert_eq!(start("", "0.01"), Some(0));
    assert!(there("fields_t4.csv") && there("notes_t1.png"));
    assert!(!there("fields_t1.csv") && !there("density_change_t3.png") && !there("fields_t2.vtk"));
    // One that is refused at its start leaves no record of the one before.
    assert_eq!(start("maps = ['density']", "0.01"), Some(2));
    assert!(!there("scene.json") && !there("fields_t4.csv"));
}

/// `--dry-run` refuses what the run itself would refuse.
#[test]
fn a_dry_run_refuses_what_the_run_refuses() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("scene.toml");
    for (from, to, code) in [
        ("young = 100.0", "young = 100.0", 0),
        ("young = 100.0", "young = nan", 2),
        ("stimulus = 0.01", "stimulus = 0.01, exponent = 2.0", 2),
        ("step = 0.5", "step = 0.3", 2),
        ("animation = true", "every = -1.0", 2),
    ] {
        let text = format!(
            "geometry.disc.radius = 6.0\n{BODY}\n[physics.bond-based]\nyoung = 100.0\n\
             growth = {{ rate = 1.0, stimulus = 0.01 }}\n"
        );
        assert!(text.contains(from));
        std::fs::write(&scene, text.replace(from, to)).unwrap();
        let out = dir.path().join("out");
        let done = run_scene(&scene, &out, &["--dry-run"]);
        assert_eq!(done.status.code(), Some(code), "{to}: {done:?}");
        assert!(!out.exists());
    }
}

/// The outline in `sample_data` has as many points as the paper's femur, in all its scenes.
#[test]
fn the_femur_has_as_many_points_as_the_papers() {
    for name in [
        "femur-lc1-continuum",
        "femur-lc1-delta-1.201",
        "femur-lc2-delta-0.301",
    ] {
        let path = pipelines().join(format!("{name}.toml"));
        let text = std::fs::read_to_string(&path).unwrap();
        let scene = Scene::parse(&text, &path).unwrap();
        let Geometry::Polygon(mut polygon) = scene.setting.geometry.clone() else {
            panic!("{name} has another outline");
        };
        polygon.corners =
            points::read_corners(&pipelines().join(polygon.file.take().unwrap())).unwrap();
        let setting = Setting {
            geometry: Geometry::Polygon(polygon),
            ..scene.setting
        };
        assert_eq!(
            setting.points(&Inputs::default()).unwrap().len(),
            21_652,
            "{name}"
        );
    }
}

/// Grey values that are not there, of another size, or pixels that are no squares: refused in words.
#[test]
fn slices_that_cannot_be_cells_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, h: [f64; 3], value: f32| {
        let grid = Grid::new([12, 5, 10], h);
        let volume = Volume::from_vec(grid, vec![value; grid.len()]);
        nifti::write(&dir.path().join(name), &volume).unwrap();
    };
    write("mask.nii.gz", [0.5; 3], 1.0);
    write("flat.nii.gz", [0.5, 0.5, 0.8], 1.0);
    write("scan.nii.gz", [0.5; 3], 100.0);
    write("wide.nii.gz", [0.7; 3], 100.0);
    write("gone.nii.gz", [0.5; 3], f32::NAN);
    for (mask, grey, code, expected) in [
        ("mask", "scan", 0, "0.5 mm wide in its file"),
        ("flat", "scan", 2, "cells are squares"),
        ("mask", "wide", 2, "12 x 10 pixels of 0.7"),
        ("mask", "gone", 2, "no grey value"),
    ] {
        let scene = dir.path().join("scene.toml");
        let text = format!(
            "geometry.slice = {{ file = '{mask}.nii.gz', grey = '{grey}.nii.gz', axis = 'y', index = 2 }}\n{BODY}\n\
             [physics.bond-based]\nyoung = 100.0\ndensity = {{ grey = {{ empty = 0.0, full = 100.0 }} }}\n\
             growth = {{ rate = 0.001, stimulus = 0.01 }}\n"
        );
        std::fs::write(&scene, text).unwrap();
        let done = run_scene(&scene, &dir.path().join("out"), &[]);
        let words = String::from_utf8_lossy(&done.stderr).replace('\n', " ");
        assert_eq!(done.status.code(), Some(code), "{words}");
        assert!(words.contains(expected), "{words}");
    }
}
