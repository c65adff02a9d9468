//! Owns the methods section of a paper: what was done to these scans, with the numbers of their settings and results.
//!
//! Each part is a plain function from settings to a paragraph; what does not apply is left out.

mod load;
mod model;
mod references;
mod scans;
mod solution;
mod statistics;
mod words;

use crate::measure::pistoia::Pistoia;
use crate::report::Report;
use crate::result::answer::AnswerLine;
use crate::result::answer::found_by::FoundBy;
use crate::result::cautions::WARNING;
use crate::result::condition::{Condition, shared};
use crate::result::notes::{Alikes, parts};
use crate::result::row::Row;
use serde::Serialize;

/// What the methods section says, before it takes a format.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Methods {
    /// Title and text.
    pub sections: Vec<(String, String)>,
    /// Those that the text cites.
    pub references: Vec<String>,
    /// What a paper needs and the program does not know.
    pub to_add: Vec<String>,
}

/// What is known apart from rows and answers.
#[derive(Debug, Clone, Default)]
pub struct Known {
    pub version: String,
    /// One for each scan whose folder was found.
    pub segmented: Vec<Segmented>,
    /// Criteria of failure that were used.
    pub criteria: Vec<Criterion>,
    /// Relative error asked for.
    pub target: Option<f64>,
    /// Scans that failed.
    pub failed: usize,
}

/// How one scan was segmented.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Segmented {
    pub scan: String,
    /// Voxel edges of the mask, along x, y, z.
    pub voxel_mm: [f64; 3],
    /// What was done to the scan before its bone was found, each a clause in the past tense: "cropped", ...
    pub placed: Vec<String>,
    /// σ of the Gaussian; 0 is none.
    pub gaussian_voxels: f64,
    pub threshold: Threshold,
    /// Unit of the grey values, where the file states it.
    pub unit: Option<String>,
    /// Volume of interest.
    pub tv_definition: String,
    /// Edge of the tiles, where the ends were cut flat.
    pub plane_cut_mm: Option<f64>,
    /// Every voxel was kept, connected or not.
    pub keep_all: bool,
    /// Voxels removed as unconnected, over those of all components.
    pub removed_share: f64,
    pub has_morphometry: bool,
}

/// How bone was found.
#[derive(Debug, Clone, PartialEq)]
pub enum Threshold {
    /// Bounds, in the image's unit, inclusive.
    Window {
        lower: Option<f64>,
        upper: Option<f64>,
    },
    Otsu {
        at: Option<f64>,
    },
    Labels(Vec<i32>),
}

impl Default for Threshold {
    fn default() -> Self {
        Threshold::Window {
            lower: None,
            upper: None,
        }
    }
}

/// Pistoia's criterion, and the labels whose bone counts; all bone where there are none.
#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    pub pistoia: Pistoia,
    pub labels: Vec<i32>,
}

/// An answer with the rows behind it.
pub(crate) struct Answered<'a> {
    pub line: &'a AnswerLine,
    /// The row that answers.
    pub row: &'a Row,
}

fn solved(report: &Report) -> Vec<&Row> {
    let rows = report.rows.iter();
    rows.filter(|row| row.load_carried().is_some()).collect()
}

/// The condition that the section describes; None where nothing was solved.
pub fn condition(report: &Report) -> Option<Condition> {
    shared(&solved(report))
}

/// The methods section of `report`; empty where nothing was solved.
pub fn methods(report: &Report, known: &Known) -> Methods {
    let solved = solved(report);
    let Some(condition) = condition(report) else {
        return Methods::default();
    };
    let answered = answered(report, &condition);
    let others = solved.iter().filter(|row| {
        Condition::of(&row.key) != condition && !report.answers.apart.contains(&row.key.scan)
    });
    let others = super::distinct(others.map(|row| Condition::of(&row.key)));
    let mut lines = report.answers.lines.iter();
    let has_subjects = lines.any(|line| line.subject.is_some());
    let parts = [
        ("Scans and segmentation", scans::text(report, known)),
        ("Model", model::text(report, &answered)),
        ("Tissue", model::tissue(&condition, &answered)),
        ("Loads and ends", load::text(&condition, &others)),
        (
            "Solution and stated error",
            solution::text(&answered, &solved, &condition, known.target),
        ),
        ("Failure", solution::failure(&answered, known)),
        (
            "Statistics",
            statistics::text(&report.groups, &report.answers, has_subjects),
        ),
    ];
    let sections: Vec<(String, String)> = parts
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(title, text)| (title.to_owned(), text))
        .collect();
    let all: String = sections.iter().map(|(_, text)| text.as_str()).collect();
    Methods {
        references: references::cited(&all, &known.version),
        to_add: to_add(report, known, &condition),
        sections,
    }
}

/// The answers of the shared condition, each with its row.
fn answered<'a>(report: &'a Report, condition: &Condition) -> Vec<Answered<'a>> {
    let of = |line: &'a AnswerLine| {
        let row = report.rows.iter().rfind(|row| {
            row.key.scan == line.scan
                && Condition::of(&row.key) == *condition
                && FoundBy::of(row) == line.method
                && row.key.lp_mm == line.element_mm
                && row.e_app_mpa() == line.e_app_mpa
        })?;
        Some(Answered { line, row })
    };
    report.answers.lines.iter().filter_map(of).collect()
}

fn to_add(report: &Report, known: &Known, condition: &Condition) -> Vec<String> {
    let mut add = vec![
        "Scanner, anatomical site, tube voltage and current, integration time; how the specimens were obtained and prepared; ethics approval.".to_owned(),
        "Why this threshold: how it was chosen and checked.".to_owned(),
    ];
    add.extend(model::source_of(condition));
    add.extend(
        cautions(report)
            .map(|caution| format!("What this warning means for the study: {caution}.")),
    );
    let unknown: Vec<&str> = (report.answers.lines.iter())
        .map(|line| line.scan.as_str())
        .filter(|scan| known.segmented.iter().all(|s| s.scan != *scan))
        .collect();
    if !unknown.is_empty() {
        add.push(format!(
            "The segmentation of {}: the folder was not found.",
            words::scans(&unknown)
        ));
    }
    add
}

/// Warnings of the answers, one line a matter.
fn cautions(report: &Report) -> impl Iterator<Item = String> {
    let mut found = Alikes::default();
    for line in &report.answers.lines {
        let warnings = parts(line.note.as_deref()).filter_map(|part| part.strip_prefix(WARNING));
        for warning in warnings {
            found.add(warning, &line.scan);
        }
    }
    let words: Vec<String> = found
        .groups()
        .map(|group| {
            let names: Vec<&str> = group.scans.iter().map(String::as_str).collect();
            format!("{} ({})", group.of_all(), words::scans(&names))
        })
        .collect();
    words.into_iter()
}

impl Methods {
    /// The section as Markdown; empty where nothing was solved.
    pub fn markdown(&self) -> String {
        if self.sections.is_empty() {
            return "# Methods\n\nNothing was solved.\n".to_owned();
        }
        let mut text = "# Methods\n\nWritten from the settings and results of this report. Check it, and fill in what is listed at the end.\n".to_owned();
        for (title, words) in &self.sections {
            text += &format!("\n## {title}\n\n{words}\n");
        }
        for (title, lines) in [("References", &self.references), ("To add", &self.to_add)] {
            let list: String = lines.iter().map(|line| format!("- {line}\n")).collect();
            text += &format!("\n## {title}\n\n{list}");
        }
        text
    }
}
