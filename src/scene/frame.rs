//! Owns what a running scene reports: states as they are accepted, and a closing summary.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use crate::scene::state::State;
use crate::scene::step_statistics::StepStatistics;
use serde::{Deserialize, Serialize};

/// What a scene writes, and when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Times at which fields are written, in addition to the last.
    pub times: Vec<f64>,
    /// Also every so many time units.
    pub every: Option<f64>,
    /// Fields to draw as maps; empty: the first scalar.
    pub maps: Vec<String>,
    /// Range of the maps' colours; by default that of all written states.
    pub range: Option<[f64; 2]>,
    /// Also an animation of the maps (GIF).
    pub animation: bool,
    /// Also a series for ParaView.
    pub vtk: bool,
    /// Output folder of another scene on the same points, relative to this file: maps of the difference to it.
    pub minus: Option<std::path::PathBuf>,
}

impl Output {
    /// # Errors
    /// Times or a range that cannot be.
    pub fn check(&self) -> Result<()> {
        let wrong =
            |key: &str, found: String, advice: &str| Err(Error::setting(key, found, advice));
        if let Some(t) = self.times.iter().find(|t| !(t.is_finite() && **t >= 0.0)) {
            return wrong("output.times", format!("found {t}"), "give times from 0 on");
        }
        if let Some(every) = self.every.filter(|e| !(e.is_finite() && *e > 0.0)) {
            return wrong(
                "output.every",
                format!("found {every}"),
                "give a positive time",
            );
        }
        match self.range {
            Some([low, high]) if !(low.is_finite() && high.is_finite() && low < high) => {
                let found = format!("found [{low}, {high}]");
                wrong(
                    "output.range",
                    found,
                    "give the lowest value, then the highest",
                )
            }
            _ => Ok(()),
        }
    }

    /// Whether fields are due after a step from `before` to `now`.
    pub fn due(&self, before: f64, now: f64) -> bool {
        let slack = 1e-9 * now.abs().max(1e-300);
        let passed = |t: f64| before + slack < t && t <= now + slack;
        let multiple =
            |every: f64| ((now + slack) / every).floor() > ((before + slack) / every).floor();
        self.times.iter().any(|&t| passed(t)) || self.every.is_some_and(multiple)
    }

    /// The next time after `now` at which fields are due.
    pub fn next_due(&self, now: f64) -> Option<f64> {
        let slack = 1e-9 * now.abs().max(1e-300);
        let multiple = self.every.map(|e| (((now + slack) / e).floor() + 1.0) * e);
        let listed = self.times.iter().copied().filter(|t| *t > now + slack);
        listed.chain(multiple).min_by(f64::total_cmp)
    }
}

/// An accepted state.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    pub time: f64,
    /// A row of `history.csv`; the same names in every frame.
    pub numbers: Vec<(String, f64)>,
    /// Only when due.
    pub fields: Vec<Field>,
}

/// Values at the material points.
#[derive(Debug, Clone)]
pub struct Field {
    pub name: &'static str,
    pub values: Values,
}

#[derive(Debug, Clone)]
pub enum Values {
    Scalar(Vec<f64>),
    Vector(Vec<[f64; 2]>),
}

/// Values of a scene's bonds by direction, every degree of a turn: a column a name.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Directions {
    pub columns: Vec<(&'static str, Vec<f64>)>,
}

impl Directions {
    /// A column of `f` by the angle in radians.
    pub fn add(&mut self, name: &'static str, f: impl Fn(f64) -> f64) {
        let values = (0..360).map(|degrees| f(f64::from(degrees).to_radians()));
        self.columns.push((name, values.collect()));
    }
}

/// Receives what happens while a scene runs.
pub trait Observer {
    /// Before the first state. `steps` is the number of steps foreseen.
    fn start(&mut self, points: &Points, steps: usize) -> Result<()>;
    fn frame(&mut self, frame: &Frame) -> Result<()>;
    /// A frame that was reported before, of the same time, now with its fields.
    fn again(&mut self, frame: &Frame) -> Result<()> {
        self.frame(frame)
    }
    /// What bonds are by direction, once, before the first state of scenes that have such.
    fn directions(&mut self, _directions: &Directions) -> Result<()> {
        Ok(())
    }
    /// Something worth a line: a halved step, a refactorisation.
    fn say(&mut self, line: &str);
    /// Something that changes how the result is read.
    fn warn(&mut self, line: &str) {
        self.say(line);
    }
    /// Where this very scene was stopped before, to go on from there. Asked once, after `start`.
    fn resume(&mut self) -> Result<Option<State>> {
        Ok(None)
    }
    /// After each accepted step: `state` makes the state to go on from, for an observer that keeps it.
    fn keep(&mut self, _state: &dyn Fn() -> State) -> Result<()> {
        Ok(())
    }
}

/// How a scene ended.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Points of the body.
    pub points: usize,
    /// Unknowns solved for, in all.
    pub unknowns: usize,
    /// Bonds, each counted once.
    pub bonds: usize,
    /// Steps in time or load.
    pub steps: usize,
    /// False where a step, a solve or a mode was left without convergence.
    pub converged: bool,
    /// How the time step changed, where time is marched through.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[serde(rename = "pace")]
    pub step_statistics: Option<StepStatistics>,
    /// Further numbers by name.
    pub numbers: Vec<(String, f64)>,
    /// Why it stopped early, where it did.
    pub stopped: Option<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_due_once() {
        let output = Output {
            times: vec![0.25],
            every: Some(1.0),
            ..Output::default()
        };
        let step = |k: usize| 0.1 * k as f64;
        let due: Vec<usize> = (1..=20)
            .filter(|&k| output.due(step(k - 1), step(k)))
            .collect();
        assert_eq!(due, [3, 10, 20]);
        assert_eq!(output.next_due(0.1), Some(0.25));
        assert_eq!(output.next_due(0.25), Some(1.0));
        assert_eq!(output.next_due(1.0), Some(2.0));
    }
}
