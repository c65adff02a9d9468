//! Owns the report as Markdown: the tables of the page, the figures by file name, the notes.

use crate::report::cells::digits;
use crate::report::figure::Figure;
use crate::report::statistics::{AgreementLine, RegressionLine, Statistics};
use crate::report::{Report, answers, group_tables, html};

/// The report's text, with the tables of the page. Figures are `STEM.svg` beside it.
pub fn render(report: &Report) -> String {
    let list =
        |lines: &[String]| -> String { lines.iter().map(|line| format!("- {line}\n")).collect() };
    let mut text = format!("# {}\n\n## Answers\n\n", report.title);
    text += &list(&report.answers.conditions);
    text += &format!("\n{}", answers::table(&report.answers).markdown());
    if !report.notes.is_empty() {
        text += &format!("\n## Notes\n\n{}", list(&report.notes));
    }
    if !report.groups.lines.is_empty() {
        text += &format!(
            "\n## Groups\n\n{}",
            group_tables::lines_table(&report.groups).markdown()
        );
    }
    if !report.groups.comparisons.is_empty() {
        let table = group_tables::comparisons_table(&report.groups);
        text += &format!("\n{}\n{}\n", table.markdown(), group_tables::ON_ERRORS);
    }
    text += &format!("\n## All solves\n\n{}", html::solves(report).markdown());
    if !report.method_notes.is_empty() {
        text += &format!("\n{}", list(&report.method_notes));
    }
    text += &statistics_text(&report.statistics);
    if !report.figures.is_empty() {
        text += "\n## Figures\n";
        report
            .figures
            .iter()
            .for_each(|figure| text += &figure_text(figure));
    }
    text
}

/// Regressions and agreements; empty for fewer than three scans.
fn statistics_text(statistics: &Statistics) -> String {
    if statistics.regressions.is_empty() {
        return String::new();
    }
    let mut text = "\n## Statistics of methods\n\n| y | x | n | slope | intercept | R² | p of slope |\n| --- | --- | --- | --- | --- | --- | --- |\n".to_owned();
    for RegressionLine { y, x, fit } in &statistics.regressions {
        let numbers = [fit.slope, fit.intercept, fit.r2].map(|v| digits(Some(v)));
        text += &format!(
            "| {y} | {x} | {} | {} | {:.2e} |\n",
            fit.n,
            numbers.join(" | "),
            fit.slope_p
        );
    }
    if !statistics.agreements.is_empty() {
        text += "\n| method | reference | n | bias (MPa) | limits of agreement (MPa) | p of bias |\n| --- | --- | --- | --- | --- | --- |\n";
    }
    for AgreementLine {
        method,
        reference,
        found,
    } in &statistics.agreements
    {
        let [bias, low, high] =
            [found.bias, found.lower_limit, found.upper_limit].map(|v| digits(Some(v)));
        text += &format!(
            "| {method} | {reference} | {} | {bias} | {low} to {high} | {} |\n",
            found.n,
            found.bias_p.map_or("NA".to_owned(), |p| format!("{p:.2e}"))
        );
    }
    text
}

fn figure_text(figure: &Figure) -> String {
    let Figure {
        stem,
        title,
        caption,
        ..
    } = figure;
    format!("\n### {title}\n\n![{title}]({stem}.svg)\n\n{caption}\n")
}
