//! Scene files end to end: the example files, the program, geometry from images and scans, and the two solution methods.

use assert_cmd::Command;
use bonepd_ct::error::Result;
use bonepd_ct::grid::Grid;
use bonepd_ct::io::nifti;
use bonepd_ct::stage::scene::frame::{Frame, Observer};
use bonepd_ct::stage::scene::{Inputs, Scene, run};
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
