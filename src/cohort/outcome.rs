//! Owns what became of each scan of a run, and of the run.

use crate::cohort::job::ScanJob;
use crate::command::estimate::Estimate;
use crate::command::in_words::answer_in_words;
use crate::command::{Outcome, adaptive};
use crate::error::Result;
use crate::result::answer::AnswerLine;
use crate::result::row::Row;
use serde::Serialize;
use std::path::PathBuf;

/// How a scan ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Solved: everything converged, and the error asked for is met.
    Done,
    /// At least one row did not converge; rows are written and marked.
    #[serde(rename = "not converged")]
    NotConverged,
    /// Rows are written, and their stated error is larger than the one asked for.
    #[serde(rename = "error not met")]
    ErrorNotMet,
    /// No results; `error` says why.
    Failed,
    /// In a dry run.
    Planned,
}

impl State {
    pub(super) fn name(self) -> &'static str {
        match self {
            State::Done => "done",
            State::NotConverged => "not converged",
            State::ErrorNotMet => "error not met",
            State::Failed => "failed",
            State::Planned => "planned",
        }
    }
}

/// One scan of a run.
#[derive(Debug, Clone, Serialize)]
pub struct ScanResult {
    /// Name of the scan.
    pub scan: String,
    /// Path of the scan.
    pub input: PathBuf,
    /// How it ended.
    pub state: State,
    /// The message of a scan that failed; None for all others.
    pub error: Option<String>,
    /// Number of rows in its table, those that follow from others among them.
    pub rows: usize,
    /// None where nothing was solved.
    pub answer: Option<AnswerLine>,
    /// What it was expected to take.
    pub estimate: Estimate,
}

/// The answer of the scan, how many rows were solved, and how many of them did not converge.
pub(super) fn in_words(rows: &[Row], answer: Option<&AnswerLine>) -> String {
    let stalled = rows.iter().filter(|row| row.converged() == Some(false));
    let stalled = match stalled.count() {
        0 => String::new(),
        n => format!(", {n} not converged"),
    };
    let answer = answer.map(answer_in_words);
    let plural = match rows.len() {
        1 => "",
        _ => "s",
    };
    format!(
        "{}; {} row{plural}{stalled}",
        answer.unwrap_or("no modulus".to_owned()),
        rows.len()
    )
}

/// Whether all that was solved is what an earlier run left.
pub(super) fn said_of_kept(rows: &[Row], before: &[Row]) -> &'static str {
    let mut solved = rows.iter().filter(|row| !row.key.is_derived()).peekable();
    let kept = |row: &Row| {
        before
            .iter()
            .any(|old| old.key == row.key && old.solved == row.solved)
    };
    match solved.peek().is_some() && solved.all(kept) {
        true => "  [up to date: kept from an earlier run]",
        false => "",
    }
}

/// What the steps of a scan found.
#[derive(Debug, Clone, Default)]
pub(super) struct Solved {
    pub rows: Vec<Row>,
    pub answer: Option<AnswerLine>,
}

/// `target` is the relative error asked for, if any.
pub(super) fn result(
    job: &ScanJob,
    estimate: Estimate,
    solved: Option<Result<Solved>>,
    target: Option<f64>,
) -> ScanResult {
    let missed = |rows: &[Row]| {
        let broken = rows.iter().all(Row::is_disconnected);
        target.is_some_and(|target| !broken && !adaptive::meets(rows, target))
    };
    let (state, error, found) = match solved {
        Some(Ok(found)) if missed(&found.rows) => (State::ErrorNotMet, None, found),
        Some(Ok(found)) if found.rows.iter().any(|row| row.converged() == Some(false)) => {
            (State::NotConverged, None, found)
        }
        Some(Ok(found)) => (State::Done, None, found),
        Some(Err(e)) => (State::Failed, Some(e.to_string()), Solved::default()),
        None => (State::Planned, None, Solved::default()),
    };
    ScanResult {
        scan: job.name.clone(),
        input: job.input.clone(),
        state,
        error,
        rows: found.rows.len(),
        answer: found.answer,
        estimate,
    }
}

pub(super) fn outcome(results: &[ScanResult]) -> Outcome {
    let in_state = |state: State| results.iter().filter(move |r| r.state == state);
    let failed: Vec<String> = in_state(State::Failed).map(|r| r.scan.clone()).collect();
    let short = [State::NotConverged, State::ErrorNotMet];
    match (
        failed.is_empty(),
        short.into_iter().any(|s| in_state(s).next().is_some()),
    ) {
        (false, _) => Outcome::SomeFailed(failed),
        (true, true) => Outcome::NotConverged,
        (true, false) => Outcome::Done,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_written_in_words() {
        for state in [
            State::Done,
            State::NotConverged,
            State::ErrorNotMet,
            State::Failed,
            State::Planned,
        ] {
            assert_eq!(serde_json::to_value(state).unwrap(), state.name());
        }
    }
}
