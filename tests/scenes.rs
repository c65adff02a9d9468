//! Scene files end to end: the example files, the program, geometry from images and scans, and the two solution methods.

mod outputs;

use assert_cmd::Command;
use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::error::Result;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::scene::frame::{Frame, Observer};
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::{Scene, check, run};
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

/// What `--dry-run` does with each scene of a continuum-molecular model.
#[test]
fn every_molecular_scene_file_passes_a_dry_run() {
    let mut count = 0;
    for entry in std::fs::read_dir(pipelines()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if name.starts_with("scene-") && name.ends_with(".toml") {
            let scene = Scene::parse(&std::fs::read_to_string(&path).unwrap(), &path).unwrap();
            check(&scene, &Inputs::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
            count += 1;
        }
    }
    assert!(count > 15, "{count} scenes");
}

/// The local twin of the unit square, and all files a scene leaves.
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

/// What the program makes of a scene file, results into `out`.
fn run_scene(scene: &Path, out: &Path, more: &[&str]) -> std::process::Output {
    let mut program = bonepd();
    program
        .arg("scene")
        .arg(scene)
        .arg("-o")
        .arg(out)
        .args(more);
    program.output().unwrap()
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
    let run = run_scene(&scene, &dir.path().join("out"), &[]);
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
    let is_connected = whole.replace("keep_largest = true", "");
    let is_connected = is_connected.replace(disc, "geometry.image.file = 'pieces.png'\n");
    let same = format!(
        "{disc}{BODY}{}",
        physics(
            "density = { exponent = 3.0 }\ngrowth = { rate = 1.0, stimulus = 0.01, exponent = 3.0 }",
        )
    );
    let cases = [
        (is_connected, "2 unconnected pieces"),
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
    std::fs::create_dir(dir.path().join("sample_data")).unwrap();
    std::fs::copy(&sample, dir.path().join("sample_data/dense.nii.gz")).unwrap();
    for name in ["scan-slice", "scan-slice-forces"] {
        let text = std::fs::read_to_string(pipelines().join(format!("{name}.toml"))).unwrap();
        assert!(text.contains(
            "bonepd-ct segment sample_data/dense.nii.gz -o out/dense --lower 200 --upper 5600"
        ));
        let text = text
            .replace("../out", "out")
            .replace("../sample_data", "sample_data");
        let scene = dir.path().join(format!("{name}.toml"));
        std::fs::write(&scene, text).unwrap();
        let out = dir.path().join(name);
        bonepd()
            .arg("scene")
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .assert()
            .success();
        // Some bone is resorbed to the least density, some is laid down.
        assert!((last(&out, "min") + 0.95).abs() < 1e-6, "{name}");
        assert!(last(&out, "max") > 0.1, "{name}");
    }
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
