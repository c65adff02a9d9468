//! Owns the report as Markdown: the tables of the page, the figures by file name, the notes.

use crate::report::cells::records;
use crate::report::figure::Figure;
use crate::report::html::ScanPage;
use crate::report::statistics::Statistics;
use crate::report::{Report, answers, group_tables, html};

/// The report's text, with the tables of the page. Figures are `STEM.svg` in the same folder.
pub fn render(report: &Report, pages: &[ScanPage]) -> String {
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
    text += &stiffness_text(pages);
    text += &format!("\n## All solves\n\n{}", html::solves(report).markdown());
    if !report.method_notes.is_empty() {
        text += &format!("\n{}", list(&report.method_notes));
    }
    text += &statistics_text(&report.statistics);
    if let Some(words) = report.answers.subjects_repeat() {
        text += &format!("\n{words}\n");
    }
    if !report.figures.is_empty() {
        text += "\n## Figures\n";
        report
            .figures
            .iter()
            .for_each(|figure| text += &figure_text(figure));
    }
    text
}

/// The orthotropic constants of the scans that have a stiffness.
fn stiffness_text(pages: &[ScanPage]) -> String {
    let of = |page: &ScanPage| {
        let shown = page.stiffness.as_ref()?;
        let (conditions, constants) = (&shown.conditions, shown.constants.markdown());
        Some(format!(
            "\n### {}\n\n{conditions}.\n\n{}\n{constants}",
            page.scan,
            shown.matrix.markdown()
        ))
    };
    let all: Vec<String> = pages.iter().filter_map(of).collect();
    match all.is_empty() {
        true => String::new(),
        false => format!("\n## Apparent stiffness\n{}", all.concat()),
    }
}

/// Regressions and agreements, as on the page; empty for fewer than three scans.
fn statistics_text(statistics: &Statistics) -> String {
    let tables = [
        records(&statistics.regressions),
        records(&statistics.agreements),
        records(&statistics.boxes),
    ];
    let shown = tables.iter().filter(|table| !table.body.is_empty());
    let text: String = shown
        .map(|table| format!("\n{}", table.markdown()))
        .collect();
    match text.is_empty() {
        true => text,
        false => format!("\n## Statistics of methods\n{text}"),
    }
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
