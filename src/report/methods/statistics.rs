//! Owns what a methods section says of groups and tests.

use super::words::{list, scans};
use crate::report::answers::{Answers, comparable};
use crate::report::distinct;
use crate::report::groups::{Groups, MODULUS};

/// The tests that were made; empty where there is one scan only. `has_subjects`: a manifest names some.
pub fn text(groups: &Groups, answers: &Answers, has_subjects: bool) -> String {
    if groups.lines.iter().all(|line| line.found.n < 2) {
        return String::new();
    }
    let mut text = match has_subjects {
        true => {
            "Values are mean ± standard deviation over subjects; the value of a subject is the mean of its scans."
        }
        false => "Values are mean ± standard deviation over scans; no subjects were named.",
    }
    .to_owned();
    text += &left_out(groups, answers);
    if groups.comparisons.is_empty() {
        return text;
    }
    for design in distinct(groups.comparisons.iter().map(|c| c.design.as_str())) {
        text += match design {
            "paired" => " Groups of the same subjects were compared by the paired t test.",
            _ => {
                " Groups of different subjects were compared by Welch's t test and the Mann–Whitney test."
            }
        };
    }
    if groups.comparisons.iter().any(|c| c.p_t_holm.is_some()) {
        text += " p values were corrected by Holm's method for all pairs of groups.";
    }
    if groups.comparisons.iter().any(|c| c.hedges_g.is_some()) {
        text += " Effect sizes are Hedges' g with 95 % confidence intervals.";
    }
    text
}

/// The scans that are in no group, and how many are left; empty where all are in.
fn left_out(groups: &Groups, answers: &Answers) -> String {
    let (kept, _) = comparable(answers);
    let all = answers.lines.iter().map(|line| line.scan.as_str());
    let out: Vec<&str> = all
        .filter(|scan| kept.iter().all(|line| line.scan != *scan))
        .collect();
    if out.is_empty() {
        return String::new();
    }
    let of_moduli = groups.lines.iter().filter(|line| line.quantity == MODULUS);
    let left: Vec<String> = of_moduli
        .map(|line| format!("{} in {}", line.found.n, line.group))
        .collect();
    format!(
        " What carries no load or had other conditions ({}) is in no group or test, which leaves {}.",
        scans(&out),
        list(&left)
    )
}
