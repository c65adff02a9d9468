//! Owns a scene repeated over the values of one parameter.

mod saved_state;

use super::setup::Setup;
use super::{KnownField, Molecular};
use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use crate::scene::frame::{Frame, Observer, Summary};
use serde::{Deserialize, Serialize};

/// Which parameter, over which values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    pub parameter: Parameter,
    pub values: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parameter {
    /// The material's angle in degrees.
    Angle,
    /// tan⁻¹(K_II/K_I) of a crack-tip field in degrees, the size of (K_I, K_II) kept.
    Mixity,
}

impl Sweep {
    /// The model at each value, refused where there is none.
    pub fn models(&self, model: &Molecular) -> Result<Vec<Molecular>> {
        if self.values.is_empty() {
            return Err(Error::setting(
                "sweep.values",
                "found none",
                "list at least one value",
            ));
        }
        Ok(self.values.iter().map(|v| self.apply(model, *v)).collect())
    }

    fn apply(&self, model: &Molecular, value: f64) -> Molecular {
        let mut model = model.clone();
        model.sweep = None;
        match self.parameter {
            Parameter::Angle => model.problem.turn(value),
            Parameter::Mixity => {
                for known in &mut model.known {
                    if let KnownField::CrackTip([k1, k2]) = &mut known.field {
                        let size = k1.hypot(*k2);
                        let (s, c) = value.to_radians().sin_cos();
                        [*k1, *k2] = [size * c, size * s];
                    }
                }
            }
        }
        model
    }
}

/// Passes nothing on but words and, at the end, the last fields. What is kept of a stopped sweep is its finished values:
/// the one under way starts again.
struct Quiet<'a> {
    inner: &'a mut dyn Observer,
    last: Frame,
    /// Warnings given: one that holds for all values is given once.
    warned: &'a mut Vec<String>,
}

impl Observer for Quiet<'_> {
    fn start(&mut self, _: &Points, _: usize) -> Result<()> {
        Ok(())
    }
    fn frame(&mut self, frame: &Frame) -> Result<()> {
        if !frame.fields.is_empty() {
            self.last = frame.clone();
        }
        Ok(())
    }
    fn say(&mut self, line: &str) {
        self.inner.say(line);
    }
    fn warn(&mut self, line: &str) {
        if !self.warned.iter().any(|w| w == line) {
            self.inner.warn(line);
            self.warned.push(line.to_owned());
        }
    }
}

/// Runs the scene for each value; `solve` does so for one.
pub fn run(
    model: &Molecular,
    sweep: &Sweep,
    setup: &Setup,
    observer: &mut dyn Observer,
    solve: impl Fn(&Molecular, &mut dyn Observer) -> Result<Summary>,
) -> Result<Summary> {
    let mut warned = Vec::new();
    observer.start(&setup.points, sweep.values.len())?;
    let (mut total, mut finished) = match observer.resume()? {
        Some(state) => saved_state::restore(&state)?,
        None => (
            Summary {
                converged: true,
                ..Summary::default()
            },
            0,
        ),
    };
    if finished > 0 {
        observer.say(&format!(
            "resumed after {finished} of {} values",
            sweep.values.len()
        ));
    }
    for &value in &sweep.values[finished.min(sweep.values.len())..] {
        let mut quiet = Quiet {
            inner: observer,
            last: Frame::default(),
            warned: &mut warned,
        };
        let one = solve(&sweep.apply(model, value), &mut quiet)?;
        let fields = std::mem::take(&mut quiet.last.fields);
        observer.frame(&Frame {
            time: value,
            numbers: one.numbers.clone(),
            fields,
        })?;
        total.steps += one.steps;
        total.converged &= one.converged;
        (total.points, total.unknowns, total.bonds) = (one.points, one.unknowns, one.bonds);
        total.stopped = one.stopped.or(total.stopped);
        for (name, number) in one.numbers {
            total.numbers.push((format!("{name}_at_{value}"), number));
        }
        finished += 1;
        observer.keep(&|| saved_state::state(&total, finished))?;
    }
    Ok(total)
}
