//! Owns what a methods section says of groups and tests.

use crate::report::distinct;
use crate::report::groups::Groups;

/// The tests that were made; empty where there is one scan only. `has_subjects`: a manifest names some.
pub fn text(groups: &Groups, has_subjects: bool) -> String {
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
