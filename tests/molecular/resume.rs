//! Continuum-molecular scenes that are stopped and go on.

use super::strip_text;
use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::error::{Error, Result};
use bonepd_ct::scene::frame::{Frame, Observer, Summary};
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::state::State;
use bonepd_ct::scene::{Scene, run};
use std::path::Path;

/// Stops after so many events, keeping the state of the last but one; what was reported since is lost with it.
struct Stopping {
    frames: Vec<Frame>,
    kept: Option<(State, usize)>,
    from: Option<State>,
    left: usize,
}

impl Observer for Stopping {
    fn start(&mut self, _: &Points, _: usize) -> Result<()> {
        Ok(())
    }
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        self.frames.push(frame.clone());
        Ok(())
    }
    fn say(&mut self, _: &str) {}
    fn resume(&mut self) -> Result<Option<State>> {
        Ok(self.from.take())
    }
    fn keep(&mut self, state: &dyn Fn() -> State) -> Result<()> {
        self.left -= 1;
        match self.left {
            0 => Err(Error::specimen("stopped", "go on")),
            1 => {
                self.kept = Some((state(), self.frames.len()));
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

/// Runs on from `from`, with what had been reported by then, until `left` states have been passed.
fn attempt(
    scene: &Scene,
    from: Option<State>,
    frames: Vec<Frame>,
    left: usize,
) -> (Option<Summary>, Stopping) {
    let mut observer = Stopping {
        frames,
        kept: None,
        from,
        left,
    };
    let summary = run(scene, &Inputs::default(), &mut observer);
    (summary.ok(), observer)
}

/// Stopped again and again, a scene ends with the very numbers and fields of a run that never stopped. The states it
/// went on from.
fn goes_on_to_the_same_end(text: &str, every: usize) -> Vec<State> {
    let scene = Scene::parse(text, Path::new("scene.toml")).unwrap();
    let (whole, uncut) = attempt(&scene, None, Vec::new(), usize::MAX);
    let (mut from, mut frames, mut states) = (None, Vec::new(), Vec::new());
    loop {
        let (summary, part) = attempt(&scene, from, frames, every);
        if summary.is_some() {
            assert_eq!(summary, whole);
            assert_eq!(format!("{:?}", part.frames), format!("{:?}", uncut.frames));
            return states;
        }
        let (state, reported) = part.kept.unwrap();
        frames = part.frames[..reported].to_vec();
        states.push(state.clone());
        assert!(states.len() < 100, "it does not get on");
        from = Some(state);
    }
}

/// Fracture from two slits that take turns, so that the window moves between them: stopped within windows in which bonds
/// are broken already, after others in which bonds had broken.
#[test]
fn stopped_fracture_goes_on_to_the_same_end() {
    let wired = "[physics.continuum-molecular.conduction]
        conductivity = [2, 1, 0]
        probes = [[-14.5, 1.5], [-14.5, -1.5]]";
    let text = strip_text(wired, 0.2).replace(
        "hold = [",
        "hold = [{ region = { box = [-15, -10, -13, -8] }, component = 'potential' },
                { region = { box = [-15, 8, -13, 10] }, component = 'potential', value = 1 },",
    );
    let text = text.replace("[[-20, 0, -5, 0]]", "[[-20, 0, -5, 0], [5, 3, 20, 3]]");
    let states = goes_on_to_the_same_end(&(text + "\n        window_points = 150"), 9);
    let count = |s: &State| {
        let sums = s.array("fracture.sums", 17).unwrap();
        let broken = s.find("fracture.order").unwrap().len() / 2;
        (sums[11], sums[15] as usize, broken)
    };
    let within = |s: &&State| {
        let (windows, before, broken) = count(s);
        windows > 2.0 && before > 0 && broken > before
    };
    assert!(
        states.iter().filter(within).count() > 2,
        "{:?}",
        states.iter().map(count).collect::<Vec<_>>()
    );
}
