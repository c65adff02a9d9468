//! Bone remodelling: reference values of an independent prototype, orders of convergence, and what is refused.

use bonepd_ct::error::Result;
use bonepd_ct::stage::scene::frame::{Frame, Observer, Summary};
use bonepd_ct::stage::scene::{Inputs, Scene, run};
use bonepd_ct::topology::plane::Points;
use std::path::Path;

/// Keeps what a scene reports.
#[derive(Default)]
struct Recorder {
    frames: Vec<Frame>,
    lines: Vec<String>,
}

impl Observer for Recorder {
    fn start(&mut self, _: &Points, _: usize) -> Result<()> {
        Ok(())
    }
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        self.frames.push(frame.clone());
        Ok(())
    }
    fn say(&mut self, line: &str) {
        self.lines.push(line.to_owned());
    }
}

impl Recorder {
    /// A number of the frame nearest to time `t`.
    fn at(&self, t: f64, name: &str) -> f64 {
        let near = |f: &&Frame| ((f.time - t).abs() * 1e9) as u64;
        let frame = self.frames.iter().min_by_key(near).unwrap();
        frame.numbers.iter().find(|(n, _)| n == name).unwrap().1
    }

    fn means<const N: usize>(&self, times: [f64; N]) -> [f64; N] {
        times.map(|t| self.at(t, "mean"))
    }
}

fn simulate(text: &str) -> Result<(Summary, Recorder)> {
    let scene = Scene::parse(text, Path::new("test.toml"))?;
    let mut recorder = Recorder::default();
    let summary = run(&scene, &Inputs::default(), &mut recorder)?;
    Ok((summary, recorder))
}

/// Step heights of the spec's main set S2 (per edge; the paper's figure gives none).
const S2: [f64; 4] = [0.06, 0.075, 0.09, 0.105];
const S1: [f64; 4] = [0.04, 0.08, 0.12, 0.16];

/// The unit square of the paper's section 4.1 with `n` points a side. Rows do not differ, so `rows` of them tell as much.
struct Square {
    n: usize,
    rows: usize,
    delta: f64,
    ratio: f64,
    steps: [f64; 4],
    end: f64,
    model: &'static str,
    layers: &'static str,
}

impl Square {
    fn new(n: usize, ratio: f64) -> Self {
        let delta = 1.0 / n as f64;
        Square {
            n,
            rows: n,
            delta,
            ratio,
            steps: S2,
            end: 8.0,
            model: "",
            layers: "",
        }
    }

    fn text(&self) -> String {
        let (w, h) = (self.n as f64 * self.delta, self.rows as f64 * self.delta);
        let steps = self.steps.map(|u| u * h / w);
        format!(
            "title = 'square'
             geometry.rectangle.size = [{w:?}, {h:?}]
             [grid]
             spacing = {:?}
             horizon_ratio = {:?}
             [layers]
             edges = ['bottom', 'top']
             displacement = {{ until = [2, 4, 6, 8], values = {steps:?} }}
             {}
             [[hold]]
             region = {{ point = [0, 0] }}
             component = 'x'
             [time]
             end = {:?}
             step = 0.1
             [physics.bond-based]
             young = 1.0
             {}
             growth = {{ rate = 1000, stimulus = 0.01 }}
             ",
            self.delta, self.ratio, self.layers, self.end, self.model
        )
    }

    fn run(&self) -> Recorder {
        let (summary, recorder) = simulate(&self.text()).unwrap();
        assert!(summary.converged, "{summary:?}");
        recorder
    }
}

#[test]
fn a4_fixed_ratio_meets_the_reference() {
    let square = Square::new(20, 3.01);
    let found = square.run().means([0.1, 1.0, 2.0, 4.0, 6.0, 8.0]);
    let reference = [
        -0.144619, -0.267143, -0.267200, 0.151335, 0.666871, 1.280507,
    ];
    for (f, r) in found.iter().zip(reference) {
        assert!((f - r).abs() < 2e-5, "{found:?}");
    }
}
