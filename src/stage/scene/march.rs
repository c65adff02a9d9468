//! Owns marching a body through time: implicit steps, halved when they fail and grown back, reported as accepted.

use crate::error::{Error, Result};
use crate::solve::newton::NotConverged;
use crate::stage::scene::conditions::Time;
use crate::stage::scene::frame::{Frame, Observer, Output, Summary};
use crate::stage::scene::stride::Stride;

/// A model that can be advanced one step.
pub trait Marching {
    /// Tries to step from `before` to `now`; on failure the state is unchanged.
    fn advance(&mut self, before: f64, now: f64) -> std::result::Result<Advance, NotConverged>;
    /// Times at which supports or loads jump or bend.
    fn corners(&self) -> Vec<f64>;
    /// Relative densities, as far as they change.
    fn densities(&self) -> Vec<f64>;
    /// The current state at time `t`.
    fn frame(&self, t: f64, with_fields: bool) -> Frame;
}

/// What one accepted step took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Advance {
    pub iterations: usize,
    pub factorisations: usize,
    /// Largest dimensionless residual left.
    pub error: f64,
}

/// Successful steps after which a halved step is doubled.
const GROW_AFTER: usize = 4;

/// Marches to `time.end`. A step that fails at its smallest stops the march: the last good state is reported with its
/// fields and the summary says why.
pub fn march(
    model: &mut impl Marching,
    time: &Time,
    output: &Output,
    observer: &mut dyn Observer,
    summary: &mut Summary,
) -> Result<()> {
    time.check()?;
    let finest = (1.0 / time.smallest_share).log2().ceil().clamp(0.0, 40.0) as u32;
    let steps = (time.end / time.step).round() as u64;
    if steps == 0 || ((steps as f64 * time.step - time.end) / time.end).abs() > 1e-9 {
        return Err(Error::setting(
            "time.end",
            format!(
                "{} is not a whole number of steps of {}",
                time.end, time.step
            ),
            "change one of them",
        ));
    }
    // Time counts in ticks of the smallest step, so that halved steps still end on the planned ones.
    let whole = 1u64 << finest;
    let at = |ticks: u64| {
        (ticks / whole) as f64 * time.step + time.step * (ticks % whole) as f64 / whole as f64
    };
    let (mut ticks, mut level, mut streak) = (0, 0, 0);
    let mut stride = Stride::new(time, model.corners());
    let mut densities = model.densities();
    let mut worst: f64 = 0.0;
    let (mut iterations, mut factorisations) = (0, 0);
    observer.frame(&model.frame(0.0, true))?;
    while ticks < steps * whole {
        let length = match level {
            0 if ticks % whole == 0 => stride.next(ticks / whole, steps, output) * whole,
            _ => whole >> level,
        };
        let (before, now) = (at(ticks), at(ticks + length));
        match model.advance(before, now) {
            Ok(advance) => {
                ticks += length;
                if stride.is_adaptive() {
                    let old = std::mem::replace(&mut densities, model.densities());
                    stride.accepted(now, now - before, &old, &densities);
                }
                streak += 1;
                summary.steps += 1;
                iterations += advance.iterations;
                factorisations += advance.factorisations;
                worst = worst.max(advance.error);
                let last = ticks == steps * whole;
                observer.frame(&model.frame(now, last || output.due(before, now)))?;
                if level > 0 && streak >= GROW_AFTER && ticks % (whole >> (level - 1)) == 0 {
                    level -= 1;
                    streak = 0;
                    observer.say(&format!(
                        "t = {now:.6}: step grown to {:.3e}",
                        time.step / (1u64 << level) as f64
                    ));
                }
            }
            Err(why) if length > whole => {
                stride.failed();
                observer.say(&format!("t = {now:.6}: {why}; a shorter step is tried"));
            }
            Err(why) if level < finest => {
                level += 1;
                streak = 0;
                observer.say(&format!(
                    "t = {now:.6}: {why}; step halved to {:.3e}",
                    time.step / (1u64 << level) as f64
                ));
            }
            Err(why) => {
                observer.frame(&model.frame(before, true))?;
                summary.stopped = Some(format!(
                    "at t = {before:.6} no step down to {:.3e} converged: {why}; the last good state is written",
                    now - before
                ));
                break;
            }
        }
    }
    summary.converged = summary.stopped.is_none();
    let total = |name: &str, value: f64| (name.to_owned(), value);
    summary.numbers.extend([
        total("iterations", iterations as f64),
        total("factorisations", factorisations as f64),
        total("largest_residual", worst),
    ]);
    Ok(())
}
