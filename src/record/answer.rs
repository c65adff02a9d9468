//! Owns `answer.json`: the answer of a scan under the condition of its last solve, and the errors asked for so far.

use crate::error::Result;
use crate::io::atomic;
use crate::result::answer::found_by::FoundBy;
use crate::result::answer::targets::Targets;
use crate::result::answer::{AnswerLine, ScanFacts, best, failure_load, line};
use crate::result::condition::{Condition, shared};
use crate::result::row::Row;
use serde::{Deserialize, Serialize};
use std::path::Path;

pub const ANSWER: &str = "answer.json";

/// What is written. `error_mpa` is everything that is stated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub scan: String,
    pub subject: Option<String>,
    pub group: Option<String>,
    pub bv_tv: f64,
    pub e_app_mpa: Option<f64>,
    pub error_mpa: Option<f64>,
    /// Relative error asked for under these conditions.
    pub target: Option<f64>,
    pub met: Option<bool>,
    pub method: FoundBy,
    pub element_mm: f64,
    pub young_mpa: f64,
    pub poisson: f64,
    /// Load, ends and tissue in words.
    pub conditions: String,
    /// Relative change of E_app per relative change of BV.
    pub threshold_sensitivity: Option<f64>,
    pub stiffness_n_per_mm: Option<f64>,
    pub force_n: Option<f64>,
    pub failure_load_n: Option<f64>,
    /// Of bending and torsion.
    #[serde(default)]
    pub angle_deg: Option<f64>,
    #[serde(default)]
    pub moment_nmm: Option<f64>,
    #[serde(default)]
    pub failure_moment_nmm: Option<f64>,
    /// Of tissue that yields.
    #[serde(default)]
    pub yield_stress_mpa: Option<f64>,
    #[serde(default)]
    pub yield_stress_error_mpa: Option<f64>,
    #[serde(default)]
    pub max_stress_mpa: Option<f64>,
    #[serde(default)]
    pub max_stress_error_mpa: Option<f64>,
    /// Stated error of `failure_load_n`.
    #[serde(default)]
    pub failure_load_error_n: Option<f64>,
    /// What a reader must know of the number.
    pub note: Option<String>,
    /// Of all rows of the condition together.
    pub wall_s: Option<f64>,
    /// Relative errors asked for, by conditions.
    #[serde(default)]
    pub targets: Targets,
}

/// The answer of rows of one condition; None where none has a modulus, force or moment.
pub fn answer(rows: &[Row], facts: &ScanFacts) -> Option<Answer> {
    let solved: Vec<&Row> = rows
        .iter()
        .filter(|row| row.load_carried().is_some())
        .collect();
    let condition = shared(&solved)?;
    let own = || {
        solved
            .iter()
            .filter(|row| Condition::of(&row.key) == condition)
    };
    let failure = own().filter_map(|row| failure_load(row)).next_back();
    let AnswerLine {
        scan,
        subject,
        group,
        bv_tv,
        e_app_mpa,
        error_mpa,
        met,
        method,
        element_mm,
        young_mpa,
        poisson,
        threshold_sensitivity,
        stiffness_n_per_mm,
        force_n,
        failure_load_n,
        note,
        angle_deg,
        moment_nmm,
        failure_moment_nmm,
        yield_stress_mpa,
        yield_stress_error_mpa,
        max_stress_mpa,
        max_stress_error_mpa,
        failure_load_error_n,
        ..
    } = line(best(own().copied())?, facts);
    let wall_s = own()
        .filter(|row| !row.key.is_derived())
        .filter_map(|row| row.wall_s());
    Some(Answer {
        scan,
        subject,
        group,
        bv_tv,
        e_app_mpa,
        error_mpa,
        target: facts.targets.of(&condition),
        met,
        method,
        element_mm,
        young_mpa,
        poisson,
        conditions: condition.in_words(),
        threshold_sensitivity,
        stiffness_n_per_mm,
        force_n,
        failure_load_n: failure_load_n.or(failure.map(|f| f.0)),
        angle_deg,
        moment_nmm,
        failure_moment_nmm,
        yield_stress_mpa,
        yield_stress_error_mpa,
        max_stress_mpa,
        max_stress_error_mpa,
        failure_load_error_n: match failure_load_n {
            Some(_) => failure_load_error_n,
            None => failure.and_then(|f| f.1),
        },
        note,
        wall_s: Some(wall_s.sum()),
        targets: facts.targets.clone(),
    })
}

/// Writes `answer.json`, whole or not at all.
pub fn write(dir: &Path, answer: &Answer) -> Result<()> {
    let text = serde_json::to_string_pretty(answer).expect("plain data");
    atomic::write(&dir.join(ANSWER), text + "\n")
}

/// The errors asked for in `dir` so far.
pub fn targets(dir: &Path) -> Targets {
    let Some(answer) = read(dir) else {
        return Targets::default();
    };
    let mut targets = answer.targets;
    // Older files have that of the last solve alone.
    if let Some(target) = answer.target {
        targets.set_in_words(answer.conditions, target);
    }
    targets
}

/// What the last solve in `dir` left; None where there is nothing of this version.
pub fn read(dir: &Path) -> Option<Answer> {
    serde_json::from_slice(&std::fs::read(dir.join(ANSWER)).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;

    #[test]
    fn an_answer_survives_writing_and_no_modulus_has_none() {
        let dir = tempfile::tempdir().unwrap();
        let mut row = Row::default();
        assert_eq!(answer(&[row.clone()], &ScanFacts::default()), None);
        row.solved = Some(Solution {
            e_app_mpa: Some(1.0 / 3.0),
            wall_s: Some(0.5),
            ..Solution::default()
        });
        let found = answer(&[row], &ScanFacts::default()).unwrap();
        assert_eq!((found.wall_s, found.error_mpa), (Some(0.5), None));
        write(dir.path(), &found).unwrap();
        assert_eq!(read(dir.path()), Some(found));
    }
}
