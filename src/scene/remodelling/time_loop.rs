//! Owns the loop over time steps: steps that halve when they do not converge, and grow back afterwards.

use crate::error::Result;
use crate::scene::conditions::Time;
use crate::scene::frame::{Observer, Summary};
use crate::scene::remodelling::marcher::{Marcher, Model};
use crate::scene::remodelling::solver::Advance;
use crate::scene::remodelling::step_size::StepSize;
use crate::scene::setting::{Inputs, Setting};
use crate::scene::state::State;
use crate::scene::step_statistics::StepStatistics;
use crate::solver::newton::NotConverged;

/// Successful steps after which a halved step is doubled.
const GROW_AFTER: u32 = 4;

/// Time in ticks of the smallest step, so that halved steps still end on the planned ones.
struct Clock {
    step: f64,
    /// Planned steps, and ticks of each.
    steps: u64,
    whole: u64,
    /// Halvings down to one tick.
    finest: u32,
}

impl Clock {
    fn new(time: &Time) -> Result<Self> {
        let steps = time.steps()?;
        let finest = (1.0 / time.smallest_share).log2().ceil().clamp(0.0, 40.0) as u32;
        Ok(Clock {
            step: time.step,
            steps,
            whole: 1 << finest,
            finest,
        })
    }

    /// Without what rounding adds: three steps of 0.1 end at 0.3.
    fn at(&self, ticks: u64) -> f64 {
        let (planned, rest) = (ticks / self.whole, ticks % self.whole);
        rounded(planned as f64 * self.step + self.step * rest as f64 / self.whole as f64)
    }

    /// Length of so many ticks: the same wherever they begin.
    fn span(&self, ticks: u64) -> f64 {
        self.step * (ticks as f64 / self.whole as f64)
    }

    fn length(&self, level: u32) -> f64 {
        self.step / (1u64 << level) as f64
    }
}

/// To twelve digits: more than any step needs, less than rounding spoils.
pub fn rounded(t: f64) -> f64 {
    format!("{t:.11e}").parse().unwrap_or(t)
}

/// How far a run has come, and what it took.
#[derive(Default)]
struct Progress {
    ticks: u64,
    /// Halvings in force, and steps accepted since the last change.
    level: u32,
    streak: u32,
    steps: usize,
    iterations: usize,
    factorisations: usize,
    worst: f64,
    step_statistics: StepStatistics,
}

impl Progress {
    fn accepted(&mut self, clock: &Clock, length: u64, advance: &Advance) {
        self.ticks += length;
        self.step_statistics.accepted(clock.span(length));
        self.streak += 1;
        self.steps += 1;
        self.iterations += advance.iterations;
        self.factorisations += advance.factorisations;
        self.worst = self.worst.max(advance.error);
    }

    fn save(&self, clock: &Clock, state: &mut State) {
        let counts = [
            (self.ticks / clock.whole) as f64,
            (self.ticks % clock.whole) as f64,
            f64::from(self.level),
            f64::from(self.streak),
            self.steps as f64,
            self.iterations as f64,
            self.factorisations as f64,
            self.worst,
        ];
        state.put("march", counts);
        self.step_statistics.save(state);
    }

    fn restore(&mut self, clock: &Clock, state: &State) -> Result<()> {
        let counts = state.array("march", 8)?;
        *self = Progress {
            ticks: counts[0] as u64 * clock.whole + counts[1] as u64,
            level: counts[2] as u32,
            streak: counts[3] as u32,
            steps: counts[4] as usize,
            iterations: counts[5] as usize,
            factorisations: counts[6] as usize,
            worst: counts[7],
            step_statistics: StepStatistics::restore(state)?,
        };
        Ok(())
    }

    fn report(&self, summary: &mut Summary) {
        summary.steps = self.steps;
        summary.converged = summary.stopped.is_none();
        summary.step_statistics = Some(self.step_statistics.clone());
        let total = |name: &str, value: f64| (name.to_owned(), value);
        summary.numbers.extend([
            total("iterations", self.iterations as f64),
            total("factorisations", self.factorisations as f64),
            total("largest_residual", self.worst),
        ]);
    }
}

/// # Errors
/// Times that no run can take.
pub fn check(scene: &Setting) -> Result<()> {
    Clock::new(scene.marching_time()?).map(|_| ())
}

/// Marches to the end of the scene's time, from rest or from the state the observer kept. A step that fails at its smallest stops the
/// run: the last good state is reported with its fields and the summary says why.
pub fn run<M: Model>(
    mut model: Marcher<M>,
    scene: &Setting,
    inputs: &Inputs,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let (time, output) = (scene.marching_time()?, &scene.output);
    let mut summary = model.summary();
    observer.start(
        &scene.points(inputs)?,
        (time.end / time.step).round() as usize,
    )?;
    let clock = Clock::new(time)?;
    let mut step_size = StepSize::new(time, model.corners());
    let mut progress = Progress::default();
    match observer.resume()? {
        Some(state) => {
            progress.restore(&clock, &state)?;
            step_size.restore(&state)?;
            model.restore(&state)?;
            observer.say(&format!("resumed at t = {:.6}", clock.at(progress.ticks)));
        }
        None => observer.frame(&model.frame(0.0, true))?,
    }
    let mut densities = model.densities();
    let end = clock.steps * clock.whole;
    while progress.ticks < end {
        let ticks = progress.ticks;
        let length = match progress.level {
            0 if ticks % clock.whole == 0 => {
                step_size.next(ticks / clock.whole, clock.steps, output) * clock.whole
            }
            level => clock.whole >> level,
        };
        let (before, now) = (clock.at(ticks), clock.at(ticks + length));
        match model.advance(before, now) {
            Ok(advance) => {
                progress.accepted(&clock, length, &advance);
                if step_size.is_adaptive() {
                    let old = std::mem::replace(&mut densities, model.densities());
                    step_size.accepted(now, now - before, &old, &densities);
                }
                let due = progress.ticks == end || output.due(before, now);
                observer.frame(&model.frame(now, due))?;
                grow(&mut progress, &clock, observer);
                observer.keep(&|| {
                    let mut state = State::default();
                    progress.save(&clock, &mut state);
                    step_size.save(&mut state);
                    model.save(&mut state);
                    state
                })?;
            }
            Err(why) if length > clock.whole => {
                step_size.failed();
                progress.step_statistics.halved();
                let why = in_words(why);
                observer.say(&format!("t = {now:.6}: {why}; a shorter step is tried"));
            }
            Err(why) if progress.level < clock.finest => {
                progress.level += 1;
                progress.streak = 0;
                progress.step_statistics.halved();
                let (why, length) = (in_words(why), clock.length(progress.level));
                observer.say(&format!("t = {now:.6}: {why}; step halved to {length:.3e}"));
            }
            Err(why) => {
                observer.again(&model.frame(before, true))?;
                summary.stopped = Some(format!(
                    "at t = {before:.6} no step down to {:.3e} converged: {}; the last good state is written",
                    now - before,
                    in_words(why)
                ));
                break;
            }
        }
    }
    progress.report(&mut summary);
    Ok(summary)
}

/// Why a step failed, and what a user can do.
fn in_words(why: NotConverged) -> String {
    match why {
        NotConverged::Inadmissible => {
            "a density would go negative or an element turn inside out: bone is resorbed faster than its load sustains (set \
             growth.least, raise the load, lower growth.stimulus, or end sooner), or the load changes too much at once"
                .to_owned()
        }
        other => other.to_string(),
    }
}

/// Doubles a halved step that has done well, where the longer one ends on the planned steps.
fn grow(progress: &mut Progress, clock: &Clock, observer: &mut dyn Observer) {
    let Progress { level, streak, .. } = *progress;
    if level > 0
        && streak >= GROW_AFTER
        && progress.ticks.is_multiple_of(clock.whole >> (level - 1))
    {
        progress.level -= 1;
        progress.streak = 0;
        observer.say(&format!(
            "t = {:.6}: step grown to {:.3e}",
            clock.at(progress.ticks),
            clock.length(progress.level)
        ));
    }
}
