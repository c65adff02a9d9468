//! Owns the tables of groups as the page and the Markdown show them.

use crate::report::cells::{Table, count, interval, number, p_value, text};
use crate::report::groups::Groups;

/// Description, as the page shows it.
pub fn lines_table(groups: &Groups) -> Table {
    let head = [
        "quantity",
        "group",
        "subjects",
        "scans",
        "mean",
        "SD",
        "95 % CI of the mean",
        "median",
        "mean stated error",
    ];
    let body = groups.lines.iter().map(|line| {
        vec![
            text(&line.quantity),
            text(&line.group),
            count(line.found.n as u64),
            count(line.scans as u64),
            number(Some(line.found.mean)),
            number(line.found.sd),
            interval(line.found.mean_low, line.found.mean_high),
            number(Some(line.found.median)),
            number(line.mean_error),
        ]
    });
    Table::new(&head, body.collect()).without_empty_columns()
}

/// Comparisons, as the page shows them.
pub fn comparisons_table(groups: &Groups) -> Table {
    let head = [
        "quantity",
        "groups",
        "difference",
        "p (t test)",
        "p (Mann–Whitney)",
        "95 % CI",
        "CI widened by stated errors",
        "ratio",
        "p (t test, Holm)",
        "p (Mann–Whitney, Holm)",
        "Hedges’ g",
        "95 % CI of g",
        "design",
    ];
    let body = groups.comparisons.iter().map(|c| {
        vec![
            text(&c.quantity),
            text(&format!("{} − {}", c.group, c.other)),
            number(Some(c.difference)),
            p_value(Some(c.p_t)),
            p_value(c.p_mann_whitney),
            interval(Some(c.difference_low), Some(c.difference_high)),
            interval(c.widened_low, c.widened_high),
            number(Some(c.ratio)),
            p_value(c.p_t_holm),
            p_value(c.p_mann_whitney_holm),
            number(c.hedges_g),
            interval(c.hedges_g_low, c.hedges_g_high),
            text(&c.design),
        ]
    });
    Table::new(&head, body.collect()).without_empty_columns()
}

/// What the stated errors of single scans do to a comparison, in words.
pub const ON_ERRORS: &str = "Random errors of single scans are already in the spread within a group, so tests and intervals include them. No interval includes an \
    error that all scans share. If it is the same percentage of every modulus, ratios and tests do not change. The widened interval is the worst case: all \
    scans of one group too high and all of the other too low by their stated errors.";
