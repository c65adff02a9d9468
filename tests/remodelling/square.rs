//! The unit square of the paper's section 4.1: scenes and what they report.

use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::error::Result;
use bonepd_ct::scene::frame::{Frame, Observer, Summary};
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::{Scene, run};
use std::path::Path;

/// Keeps what a scene reports.
#[derive(Default)]
pub struct Recorder {
    pub frames: Vec<Frame>,
    pub lines: Vec<String>,
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
    pub fn at(&self, t: f64, name: &str) -> f64 {
        let near = |f: &&Frame| ((f.time - t).abs() * 1e9) as u64;
        let frame = self.frames.iter().min_by_key(near).unwrap();
        frame.numbers.iter().find(|(n, _)| n == name).unwrap().1
    }

    pub fn means<const N: usize>(&self, times: [f64; N]) -> [f64; N] {
        times.map(|t| self.at(t, "mean"))
    }
}

pub fn simulate(text: &str) -> Result<(Summary, Recorder)> {
    let scene = Scene::parse(text, Path::new("test.toml"))?;
    let mut recorder = Recorder::default();
    let summary = run(&scene, &Inputs::default(), &mut recorder)?;
    Ok((summary, recorder))
}

/// Step heights of the independent prototype's second set (per edge; the paper's figure gives none).
pub const S2: [f64; 4] = [0.06, 0.075, 0.09, 0.105];
pub const S1: [f64; 4] = [0.04, 0.08, 0.12, 0.16];

/// The unit square of the paper's section 4.1 with `n` points a side. Rows do not differ, so `rows` of them tell as much.
pub struct Square {
    pub n: usize,
    pub rows: usize,
    pub delta: f64,
    pub ratio: f64,
    pub steps: [f64; 4],
    pub end: f64,
    pub model: &'static str,
    pub layers: &'static str,
}

impl Square {
    pub fn new(n: usize, ratio: f64) -> Self {
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

    pub fn text(&self) -> String {
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

    pub fn run(&self) -> Recorder {
        let (summary, recorder) = simulate(&self.text()).unwrap();
        assert!(summary.converged, "{summary:?}");
        recorder
    }
}

pub fn assert_near<const N: usize>(found: [f64; N], reference: [f64; N], tolerance: f64) {
    let worst = found.iter().zip(reference).map(|(f, r)| (f - r).abs());
    let worst = worst.fold(0.0, f64::max);
    assert!(
        worst < tolerance,
        "{found:?} differs from {reference:?} by {worst:e}"
    );
}

/// Another code meets the printed digits to +-2 in the last one. This for values printed to six.
pub const SIX_DIGITS: f64 = 2e-6;
/// And this for those printed to five only.
pub const FIVE_DIGITS: f64 = 2e-5;

pub const CONTINUOUS: &str = "micromodulus = 'continuous'";

/// A square of `n` x `n` elements, stretched by the steps; `x_clamped`: no contraction at the loaded edges.
pub fn continuum_square(n: usize, steps: [f64; 4], x_clamped: bool, model: &str) -> Recorder {
    let (summary, recorder) = simulate(&local_text(n, steps, x_clamped, model)).unwrap();
    assert!(summary.converged, "{summary:?}");
    recorder
}

pub fn local_text(n: usize, steps: [f64; 4], x_clamped: bool, model: &str) -> String {
    let x_region = if x_clamped {
        "{ edge = 'bottom' }"
    } else {
        "{ point = [-0.5, -0.5] }"
    };
    let more = if x_clamped {
        "[[hold]]\n region = { edge = 'top' }\n component = 'x'"
    } else {
        ""
    };
    format!(
        "title = 'square'
         geometry.rectangle = {{ size = [1.0, 1.0], nodal = true }}
         [grid]
         spacing = {:?}
         horizon_ratio = 3.01
         [[hold]]
         region = {{ edge = 'top' }}
         component = 'y'
         value = {{ until = [2, 4, 6, 8], values = {steps:?} }}
         [[hold]]
         region = {{ edge = 'bottom' }}
         component = 'y'
         value = {{ until = [2, 4, 6, 8], values = {:?} }}
         [[hold]]
         region = {x_region}
         component = 'x'
         {more}
         [time]
         end = 8.0
         step = 0.1
         [physics.continuum]
         young = 1.0
         growth = {{ rate = 1000, stimulus = 0.01 }}
         {model}
         ",
        1.0 / n as f64,
        steps.map(|u| -u),
    )
}
