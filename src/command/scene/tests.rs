//! A scene that is stopped and started again ends as one that never stopped.

use super::*;
use crate::discretisation::plane::Points;
use crate::scene::frame::{Frame, Observer};
use crate::scene::state::State;
use std::collections::BTreeMap;
use std::time::Duration;

/// Lets `left` steps pass, then fails as if the disk were full.
struct Stopping<'a> {
    inner: Writer<'a>,
    left: usize,
    resumed: bool,
}

impl Observer for Stopping<'_> {
    fn start(&mut self, points: &Points, steps: usize) -> Result<()> {
        self.inner.start(points, steps)
    }
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        self.inner.frame(frame)
    }
    fn say(&mut self, line: &str) {
        self.inner.say(line);
    }
    fn resume(&mut self) -> Result<Option<State>> {
        let state = self.inner.resume()?;
        self.resumed = state.is_some();
        Ok(state)
    }
    fn keep(&mut self, state: &dyn Fn() -> State) -> Result<()> {
        // What was kept two steps ago is what there is when the power fails.
        if self.left > 2 {
            self.inner.keep(state)?;
        }
        self.left -= 1;
        match self.left {
            0 => Err(Error::specimen("stopped", "go on")),
            _ => Ok(()),
        }
    }
}

/// Runs a scene in `out`, up to `left` steps. Whether it finished, and whether it went on from a state.
fn attempt(text: &str, out: &Path, left: usize) -> (bool, bool) {
    let (summary, resumed) = summarised(text, out, left);
    (summary.is_some(), resumed)
}

/// The same with the summary of a scene that finished.
fn summarised(text: &str, out: &Path, left: usize) -> (Option<Summary>, bool) {
    let scene = Scene::parse(text, Path::new("scene.toml")).unwrap();
    let (inputs, session) = (
        Inputs::default(),
        Session {
            quiet: true,
            ..Session::default()
        },
    );
    let print = fingerprint(&scene, &inputs);
    let mut inner = Writer::new(out, &scene.setting.output, Path::new("."), print, &session);
    inner.every = Duration::ZERO;
    let mut stopping = Stopping {
        inner,
        left,
        resumed: false,
    };
    let done = run(&scene, &inputs, &mut stopping).ok();
    if done.is_some() {
        stopping.inner.finish().unwrap();
        stopping.inner.forget().unwrap();
    }
    (done, stopping.resumed)
}

fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(out).unwrap().map(|e| e.unwrap());
    let file = |e: std::fs::DirEntry| {
        let name = e.file_name().to_string_lossy().into_owned();
        (name, std::fs::read(e.path()).unwrap())
    };
    entries.map(file).collect()
}

fn assert_the_same_after_a_stop(model: &str, step: &str) {
    let text = format!(
        "title = 'strip'
         geometry.rectangle.size = [1.0, 0.4]
         [grid]
         spacing = 0.05
         horizon_ratio = 3.01
         [[hold]]
         region = {{ edge = 'bottom' }}
         component = 'y'
         [[hold]]
         region = {{ edge = 'left' }}
         component = 'x'
         [[hold]]
         region = {{ edge = 'top' }}
         component = 'y'
         value = {{ until = [0.5, 4], values = [0.03, 0.05] }}
         [time]
         end = 1.0
         {step}
         [output]
         every = 0.2
         animation = true
         vtk = true
         {model}
         density.noise = 0.02
         growth = {{ rate = 1000, stimulus = 0.01 }}
         solver = {{ method = 'reuse', tolerance = 1e-8 }}"
    );
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    assert_eq!(attempt(&text, whole.path(), 1000), (true, false));
    assert_eq!(attempt(&text, parts.path(), 5), (false, false));
    assert_eq!(attempt(&text, parts.path(), 6), (false, true));
    assert_eq!(attempt(&text, parts.path(), 1000), (true, true));
    let (whole, parts) = (files(whole.path()), files(parts.path()));
    assert!(whole.len() > 8 && whole.keys().any(|n| n.ends_with(".gif")));
    assert!(
        whole.keys().eq(parts.keys()),
        "{:?} {:?}",
        whole.keys(),
        parts.keys()
    );
    // The plotting library numbers the parts of its drawings through the whole process.
    for (name, bytes) in whole.iter().filter(|(n, _)| !n.ends_with(".svg")) {
        assert!(parts[name] == *bytes, "{name} differs");
    }
}

#[test]
fn a_stopped_scene_of_bonds_goes_on_to_the_same_end() {
    assert_the_same_after_a_stop("[physics.bond-based]\nyoung = 1.0", "step = 0.05");
}

#[test]
fn a_stopped_scene_of_elements_goes_on_to_the_same_end() {
    let model = "[physics.continuum]\nyoung = 1.0\ndensity_at = 'gauss'";
    assert_the_same_after_a_stop(model, "step = 0.01\ntolerance = 1e-4");
}

/// A sweep stopped in the middle of its values does only the rest, and ends with the same summary and files.
#[test]
fn a_stopped_sweep_keeps_its_finished_values() {
    let text = "title = 'angles'
         geometry.rectangle.size = [8, 8]
         [grid]
         spacing = 1.0
         horizon_ratio = 3
         partial_volumes = true
         [physics.continuum-molecular]
         known = [{ region = 'all', field = { strain = [1, 0, 0] } }]
         elasticity = { moduli = [1, 1, 0.2, 0.33, 0.1, 0.2] }
         sweep = { parameter = 'angle', values = [0, 10, 20, 30, 40, 50, 60, 70] }";
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (uncut, resumed) = summarised(text, whole.path(), 1000);
    assert!(uncut.is_some() && !resumed);
    assert_eq!(summarised(text, parts.path(), 5), (None, false));
    // Three values were kept: five are left, not eight.
    assert_eq!(summarised(text, parts.path(), 6), (uncut, true));
    let (whole, parts) = (files(whole.path()), files(parts.path()));
    assert!(whole.contains_key("fields_t70.csv") && whole.keys().eq(parts.keys()));
    for (name, bytes) in whole.iter().filter(|(n, _)| !n.ends_with(".svg")) {
        assert!(parts[name] == *bytes, "{name} differs");
    }
}

#[test]
fn scenes_and_values_of_their_files_are_told_apart() {
    use crate::discretisation::plane::geometry::Bitmap;
    let scene = |spacing: &str| {
        let text = format!(
            "title = 'disc'
             geometry.disc.radius = 1
             [grid]
             spacing = {spacing}
             horizon_ratio = 3
             [physics.bond-based]
             young = 1.0"
        );
        Scene::parse(&text, Path::new("scene.toml")).unwrap()
    };
    let bitmap = |n, inside: [bool; 2]| {
        let inside = inside.to_vec();
        Some(Bitmap { n, inside })
    };
    let inputs = Inputs {
        bitmap: bitmap([2, 1], [true, true]),
        grey: Some(vec![0.1, 0.2]),
        stiffness: Some([[1.0; 6]; 6]),
    };
    let others = [
        Inputs::default(),
        Inputs {
            grey: Some(vec![0.1, 0.2_f64.next_up()]),
            ..inputs.clone()
        },
        Inputs {
            stiffness: Some([[1.0_f64.next_up(); 6]; 6]),
            ..inputs.clone()
        },
        Inputs {
            bitmap: bitmap([1, 2], [true, true]),
            ..inputs.clone()
        },
        Inputs {
            bitmap: bitmap([2, 1], [true, false]),
            ..inputs.clone()
        },
    ];
    let print = fingerprint(&scene("0.1"), &inputs);
    assert_eq!(fingerprint(&scene("0.10"), &inputs.clone()), print);
    assert_ne!(fingerprint(&scene("0.2"), &inputs), print);
    for other in &others {
        assert_ne!(fingerprint(&scene("0.1"), other), print, "{other:?}");
    }
    let all = crate::recipe::SCENES.iter().map(|(name, text)| {
        let scene = Scene::parse(text, Path::new(name)).unwrap();
        fingerprint(&scene, &inputs)
    });
    let all: Vec<String> = all.collect();
    let distinct = all.iter().collect::<std::collections::BTreeSet<_>>();
    assert!(all.len() > 20 && distinct.len() == all.len());
}
