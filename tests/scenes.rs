//! Scene files end to end: the example files, the program, geometry from images and scans, and the two solution methods.

use assert_cmd::Command;
use bonepd_ct::error::Result;
use bonepd_ct::grid::Grid;
use bonepd_ct::io::{map, nifti, points};
use bonepd_ct::stage::scene::frame::{Frame, Observer};
use bonepd_ct::stage::scene::{Inputs, Scene, run};
use bonepd_ct::topology::outline::Outline;
use bonepd_ct::topology::plane::Points;
use bonepd_ct::volume::Volume;
use std::path::{Path, PathBuf};

fn pipelines() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines")
}

fn bonepd() -> Command {
    Command::cargo_bin("bonepd-ct").unwrap()
}

/// The last row of `history.csv`: its numbers by name.
fn last(out: &Path, name: &str) -> f64 {
    let mut reader = csv::Reader::from_path(out.join("history.csv")).unwrap();
    let column = reader
        .headers()
        .unwrap()
        .iter()
        .position(|h| h == name)
        .unwrap();
    let row = reader.records().last().unwrap().unwrap();
    row[column].parse().unwrap()
}

#[test]
fn every_remodelling_scene_file_can_be_read() {
    let mut count = 0;
    for entry in std::fs::read_dir(pipelines()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let ours = ["femur", "square", "scan-slice"]
            .iter()
            .any(|start| name.starts_with(start));
        if ours && name.ends_with(".toml") {
            let text = std::fs::read_to_string(&path).unwrap();
            Scene::parse(&text, &path).unwrap();
            count += 1;
        }
    }
    assert!(count > 20, "{count} scenes");
}

/// The local twin of the unit square: spec A3, and all files a scene leaves.
#[test]
fn the_program_runs_a_scene() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let scene = pipelines().join("square-continuum.toml");
    bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    // 1.691230 by an independent prototype.
    assert!((last(&out, "mean") - 1.691230).abs() < 2e-6);
    for file in [
        "scene.json",
        "history.png",
        "history.svg",
        "fields_t8.csv",
        "density_change_t8.png",
    ] {
        assert!(out.join(file).exists(), "{file}");
    }
}

#[test]
fn a_missing_scene_is_refused_and_a_stopped_one_marked() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    bonepd()
        .args(["scene", "absent.toml", "-o"])
        .arg(&out)
        .assert()
        .code(2);
    let text = std::fs::read_to_string(pipelines().join("square-fixed-ratio-10.toml")).unwrap();
    assert!(text.contains("0.0225"));
    // The second value flattens the strip (0.3 high) to a line.
    let text = text.replace("0.0225", "-0.15");
    let scene = dir.path().join("scene.toml");
    std::fs::write(
        &scene,
        text.replace("step = 0.1", "step = 0.1\nsmallest_share = 0.25"),
    )
    .unwrap();
    bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(&out)
        .assert()
        .code(1);
    let record = std::fs::read_to_string(out.join("scene.json")).unwrap();
    assert!(
        record.contains("the last good state is written"),
        "{record}"
    );
    assert!(out.join("fields_t2.csv").exists());
}

const BODY: &str = "
    title = 'body'
    [grid]
    spacing = 1.0
    horizon_ratio = 3.01
    prune = true
    keep_largest = true
    [[hold]]
    region = { edge = 'bottom' }
    component = 'y'
    [[hold]]
    region = { edge = 'bottom' }
    component = 'x'
    [[hold]]
    region = { edge = 'top' }
    component = 'y'
    value = { times = [0.0, 2.0], values = [0.0, -0.1] }
    [time]
    end = 4.0
    step = 0.5
    [output]
    animation = true
    vtk = true
";

#[derive(Default)]
struct Recorder(Vec<Frame>);

impl Observer for Recorder {
    fn start(&mut self, _: &Points, _: usize) -> Result<()> {
        Ok(())
    }
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        self.0.push(frame.clone());
        Ok(())
    }
    fn say(&mut self, _: &str) {}
}

/// Means and extremes of the last state.
fn ends(text: &str) -> Vec<f64> {
    let scene = Scene::parse(text, Path::new("test.toml")).unwrap();
    let mut recorder = Recorder::default();
    let summary = run(&scene, &Inputs::default(), &mut recorder).unwrap();
    assert!(summary.converged, "{summary:?}");
    recorder
        .0
        .last()
        .unwrap()
        .numbers
        .iter()
        .map(|(_, v)| *v)
        .collect()
}

/// Reusing a factor is another way to the same residual: the result is Newton's.
#[test]
fn the_reusing_method_finds_what_newton_finds() {
    let physics = [
        "[physics.bond-based]\nyoung = 100.0\ngrowth = { rate = 1.0, stimulus = 0.01 }\n",
        "[physics.continuum]\nyoung = 100.0\ndensity_at = 'gauss'\ngrowth = { rate = 1.0, stimulus = 0.01 }\n",
    ];
    for model in physics {
        let text = |method: &str| {
            format!(
                "geometry.disc.radius = 8.0\n{BODY}\n{model}solver = {{ method = '{method}', tolerance = 1e-9, \
                 max_iterations = 200 }}\n"
            )
        };
        let (newton, reuse) = (ends(&text("newton")), ends(&text("reuse")));
        for (a, b) in newton.iter().zip(&reuse) {
            // Both stop at a residual of 1e-9; a halved step would show as 4e-6.
            assert!((a - b).abs() < 1e-6, "{newton:?} {reuse:?}");
        }
    }
}

/// An image is a geometry and grey values are densities: dark pixels start out less dense.
#[test]
fn images_and_slices_are_geometries() {
    let dir = tempfile::tempdir().unwrap();
    let grey =
        image::GrayImage::from_fn(12, 10, |x, _| image::Luma([if x < 6 { 160 } else { 255 }]));
    grey.save(dir.path().join("plate.png")).unwrap();
    let growth = "growth = { rate = 0.001, stimulus = 0.01 }\n";
    let model = |empty: f64, full: f64| {
        format!(
            "[physics.bond-based]\nyoung = 100.0\ndensity = {{ grey = {{ empty = {empty:?}, full = {full:?} }} }}\n{growth}"
        )
    };
    let scene = dir.path().join("plate.toml");
    std::fs::write(
        &scene,
        format!(
            "geometry.image.file = 'plate.png'\n{BODY}{}",
            model(0.0, 1.0)
        ),
    )
    .unwrap();
    let out = dir.path().join("plate");
    bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    // Half the pixels start at 160/255 of the reference density, half at it; growth is slow.
    assert!((last(&out, "min") - (160.0 / 255.0 - 1.0)).abs() < 0.01);
    assert!(last(&out, "max").abs() < 0.01);
    for file in ["density_change.gif", "fields.vtk.series", "fields_t4.vtk"] {
        assert!(out.join(file).exists(), "{file}");
    }

    let grid = Grid::new([12, 5, 10], [1.0; 3]);
    let mask = Volume::from_vec(grid, vec![1u8; grid.len()]);
    let value = |at: usize| if at % 12 < 6 { 50.0f32 } else { 100.0 };
    let scan = Volume::from_vec(grid, (0..grid.len()).map(value).collect());
    nifti::write(&dir.path().join("mask.nii.gz"), &mask).unwrap();
    nifti::write(&dir.path().join("scan.nii.gz"), &scan).unwrap();
    let geometry =
        "geometry.slice = { file = 'mask.nii.gz', grey = 'scan.nii.gz', axis = 'y', index = 2 }";
    let scene = dir.path().join("slice.toml");
    std::fs::write(&scene, format!("{geometry}\n{BODY}{}", model(0.0, 100.0))).unwrap();
    let out = dir.path().join("slice");
    bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    assert!((last(&out, "min") + 0.5).abs() < 0.01);
}

/// Runs a scene text in a folder of its own; the exit code, what was said, and the results.
fn run_text(text: &str) -> (i32, String, tempfile::TempDir) {
    let dir = tempfile::tempdir().unwrap();
    let grey = image::GrayImage::from_fn(12, 14, |_, y| {
        image::Luma([if y == 6 || y == 7 { 0 } else { 255 }])
    });
    grey.save(dir.path().join("pieces.png")).unwrap();
    let scene = dir.path().join("scene.toml");
    std::fs::write(&scene, text).unwrap();
    let run = bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(dir.path().join("out"))
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&run.stderr).into_owned();
    (run.status.code().unwrap(), words, dir)
}

/// Through the program: what cannot work exits with 2 and says what to do.
#[test]
fn scenes_that_cannot_work_are_refused() {
    let growth = "growth = { rate = 1.0, stimulus = 0.01 }";
    let physics = |more: &str| format!("[physics.bond-based]\nyoung = 100.0\n{more}\n");
    let disc = "geometry.disc.radius = 6.0\n";
    let held = |text: String| {
        let (start, end) = (text.find("[[hold]]").unwrap(), text.find("[time]").unwrap());
        format!("{}{}", &text[..start], &text[end..])
    };
    let whole = format!("{disc}{BODY}{}", physics(growth));
    let in_pieces = whole.replace("keep_largest = true", "");
    let in_pieces = in_pieces.replace(disc, "geometry.image.file = 'pieces.png'\n");
    let same = format!(
        "{disc}{BODY}{}",
        physics(
            "density = { exponent = 3.0 }\ngrowth = { rate = 1.0, stimulus = 0.01, exponent = 3.0 }",
        )
    );
    let cases = [
        (in_pieces, "2 unconnected pieces"),
        (held(whole.clone()), "nothing holds the body along x"),
        (same, "n = 3 is not below m = 3"),
        (
            whole.replace("stimulus", "stimulos"),
            "did you mean `stimulus`",
        ),
    ];
    for (text, expected) in cases {
        let (code, words, dir) = run_text(&text);
        assert_eq!(code, 2, "{words}");
        let line = words.replace('\n', " ");
        assert!(line.contains(expected), "{words}");
        assert!(!dir.path().join("out/scene.json").exists());
    }
}

/// With a least density the same body fades to it and the scene goes on to its end.
#[test]
fn a_least_density_stops_resorption() {
    for model in ["bond-based", "continuum"] {
        for more in ["", "solver.method = 'reuse'\n"] {
            let text = format!(
                "geometry.disc.radius = 6.0\n{}\n[physics.{model}]\nyoung = 100.0\n{more}\
                 growth = {{ rate = 1.0, stimulus = 0.3, least = 0.2 }}\n",
                BODY.replace("values = [0.0, -0.1]", "values = [0.0, 0.0]")
            );
            let (code, words, dir) = run_text(&text);
            assert_eq!(code, 0, "{words}");
            let out = dir.path().join("out");
            assert!((last(&out, "max") + 0.8).abs() < 1e-6);
            assert!((last(&out, "min") + 0.8).abs() < 1e-6);
        }
    }
}

/// The example scene of a scan's slice, on a sample scan that was segmented as its first lines say.
#[test]
fn a_slice_of_a_segmented_scan_remodels() {
    let dir = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sample = root.join("sample_data/dense.nii.gz");
    bonepd()
        .arg("segment")
        .arg(&sample)
        .arg("-o")
        .arg(dir.path().join("out/dense"))
        .args(["--lower", "200", "--upper", "5600"])
        .assert()
        .success();
    let text = std::fs::read_to_string(pipelines().join("scan-slice.toml")).unwrap();
    assert!(text.contains(
        "bonepd-ct segment sample_data/dense.nii.gz -o out/dense --lower 200 --upper 5600"
    ));
    let text = text
        .replace("../out", "out")
        .replace("../sample_data", "sample_data");
    std::fs::create_dir(dir.path().join("sample_data")).unwrap();
    std::fs::copy(&sample, dir.path().join("sample_data/dense.nii.gz")).unwrap();
    let scene = dir.path().join("scan-slice.toml");
    std::fs::write(&scene, text).unwrap();
    let out = dir.path().join("scene");
    bonepd()
        .arg("scene")
        .arg(&scene)
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    // Some bone is resorbed to the least density, some is laid down.
    assert!((last(&out, "min") + 0.95).abs() < 1e-6);
    assert!(last(&out, "max") > 0.1);
}

/// Nothing loads the body: densities fall until none is left. The program stops, says so, and keeps the last state.
#[test]
fn a_density_that_would_go_negative_stops_the_scene() {
    for model in ["bond-based", "continuum"] {
        let text = format!(
            "geometry.disc.radius = 6.0\n{}\n[physics.{model}]\nyoung = 100.0\n\
             growth = {{ rate = 1.0, stimulus = 0.3 }}\n",
            BODY.replace("values = [0.0, -0.1]", "values = [0.0, 0.0]")
                .replace("step = 0.5", "step = 0.5\nsmallest_share = 0.25")
        );
        let (code, words, dir) = run_text(&text);
        assert_eq!(code, 1, "{words}");
        let out = dir.path().join("out");
        let record = std::fs::read_to_string(out.join("scene.json")).unwrap();
        assert!(record.contains("a density would go negative"), "{record}");
        assert!(
            record.contains("the last good state is written"),
            "{record}"
        );
        // From 1 at 0.3 a unit of time: 3.25 is the last time a quarter of a step can reach.
        assert!(out.join("fields_t3.25.csv").exists());
        assert!((last(&out, "max") + 0.975).abs() < 1e-6);
    }
}

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
        bonepd()
            .arg("scene")
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .output()
            .unwrap()
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
        let mut program = bonepd();
        program
            .arg("scene")
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .output()
            .unwrap()
            .status
            .code()
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
        let mut program = bonepd();
        let done = program
            .arg("scene")
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .arg("--dry-run")
            .output()
            .unwrap();
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
        let Outline::Polygon(mut polygon) = scene.geometry.clone() else {
            panic!("{name} has another outline");
        };
        polygon.corners =
            points::read_corners(&pipelines().join(polygon.file.take().unwrap())).unwrap();
        let scene = Scene {
            geometry: Outline::Polygon(polygon),
            ..scene
        };
        assert_eq!(
            scene.points(&Inputs::default()).unwrap().len(),
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
        let done = bonepd()
            .arg("scene")
            .arg(&scene)
            .arg("-o")
            .arg(dir.path().join("out"))
            .output()
            .unwrap();
        let words = String::from_utf8_lossy(&done.stderr).replace('\n', " ");
        assert_eq!(done.status.code(), Some(code), "{words}");
        assert!(words.contains(expected), "{words}");
    }
}
