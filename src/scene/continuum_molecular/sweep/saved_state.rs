//! Owns the state that a stopped sweep resumes from: how many values are finished, and the summary so far.

use crate::error::Result;
use crate::scene::frame::Summary;
use crate::scene::state::State;

const SUMS: &str = "sweep.sums";
/// Numbered, so that they come back in their order.
const NUMBER: &str = "sweep.number.";
const STOPPED: &str = "sweep.stopped.";

pub fn state(total: &Summary, finished: usize) -> State {
    let mut state = State::default();
    let counts = [
        finished,
        total.steps,
        usize::from(total.converged),
        total.points,
        total.unknowns,
        total.bonds,
    ];
    state.put(SUMS, counts.map(|n| n as f64));
    for (k, (name, value)) in total.numbers.iter().enumerate() {
        state.put(&format!("{NUMBER}{k:06}.{name}"), [*value]);
    }
    if let Some(why) = &total.stopped {
        state.put(&format!("{STOPPED}{why}"), []);
    }
    state
}

/// The summary so far, and how many values are finished.
pub fn restore(state: &State) -> Result<(Summary, usize)> {
    let sums = state.array(SUMS, 6)?;
    let number = |(name, value): (&str, &[f64])| {
        let (_, name) = name.strip_prefix(NUMBER)?.split_once('.')?;
        Some((name.to_owned(), *value.first()?))
    };
    let mut stopped = state
        .arrays()
        .filter_map(|(name, _)| name.strip_prefix(STOPPED));
    let total = Summary {
        steps: sums[1] as usize,
        converged: sums[2] != 0.0,
        points: sums[3] as usize,
        unknowns: sums[4] as usize,
        bonds: sums[5] as usize,
        numbers: state.arrays().filter_map(number).collect(),
        stopped: stopped.next().map(str::to_owned),
        step_statistics: None,
    };
    Ok((total, sums[0] as usize))
}
