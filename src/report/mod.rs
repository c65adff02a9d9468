//! Owns the report: rows of solved scans in; tables, figures and notes out, as plain data.

pub mod answers;
pub mod cells;
mod group_tables;
pub mod groups;
pub mod html;
pub mod markdown;
pub mod methods;
pub mod plot;

mod answer_figures;
mod comparison;
mod curves;
pub(crate) use curves::file_name;
pub mod figure;
mod sample;
pub mod statistics;
pub mod table;

use crate::result::cautions::WARNING;
use crate::result::notes::{Alike, Alikes, parts};
use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, CellType, Elements, Method};
use crate::result::strength::CurvePoint;
use answers::Answers;
use figure::Figure;
use groups::Groups;
use serde::{Deserialize, Serialize};
use statistics::Statistics;
use table::Line;

/// Settings of `report`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportParams {
    /// Heading of the page.
    pub title: String,
}

impl Default for ReportParams {
    fn default() -> Self {
        ReportParams {
            title: "Apparent stiffness of trabecular bone".to_owned(),
        }
    }
}

/// What a report says, before it takes a format.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    pub title: String,
    pub rows: Vec<Row>,
    /// One line a scan.
    pub answers: Answers,
    pub groups: Groups,
    /// One line per scan, structure and lattice parameter: all solves.
    pub lines: Vec<Line>,
    /// Of methods against each other.
    pub statistics: Statistics,
    pub figures: Vec<Figure>,
    /// What a reader must know of the answers: one line a matter.
    pub notes: Vec<String>,
    /// What is of interest to those who compare methods: single rows, what statistics leave out.
    pub method_notes: Vec<String>,
}

/// Tables and figures of `rows`, in their order, and of their answers; `strength` has the stress–strain curves of scans.
pub fn report(
    rows: &[Row],
    answers: Answers,
    strength: &[(String, Vec<CurvePoint>)],
    params: &ReportParams,
) -> Report {
    let mut figures = answer_figures::figures(&answers);
    let strength = strength.iter();
    figures.extend(
        strength.filter_map(|(scan, curve)| curves::strength::stress_strain(scan, curve, rows)),
    );
    figures.extend(curves::convergence(rows));
    figures.extend(curves::wall_time(rows));
    figures.extend(curves::speed_error(rows));
    let (samples, left_out) = sample::samples(rows);
    figures.extend(comparison::figures(&samples));
    curves::with_own_files(&mut figures);
    let statistics = statistics::statistics(&samples);
    let (kept, no_load) = answers::comparable(&answers);
    let groups = groups::groups(&kept);
    let mut notes = warnings(rows, &answers);
    notes.extend(answers.left_out.iter().cloned());
    notes.extend(no_load);
    notes.extend(groups.notes.iter().cloned());
    notes.extend(answers::unlike_methods(&kept));
    let mut method_notes = row_notes(rows);
    method_notes.extend(left_out);
    method_notes.extend(statistics.analysis_of_variance());
    Report {
        title: params.title.clone(),
        rows: rows.to_vec(),
        lines: table::lines(rows),
        answers,
        groups,
        statistics,
        figures,
        notes,
        method_notes,
    }
}

/// How notes begin that a reader must see; others say how a number was found.
const SERIOUS: [&str; 7] = [
    WARNING,
    "not converged",
    "mean of a modulus",
    "no path",
    "only a mechanism",
    "the error asked for",
    "small strains",
];

/// Warnings of the answers' notes and of all rows, one line a matter, with the scans that they are of.
fn warnings(rows: &[Row], answers: &Answers) -> Vec<String> {
    let mut found = Alikes::default();
    let mut add = |part: &str, scan: &str| {
        if SERIOUS.iter().any(|s| part.starts_with(s)) {
            found.add(part.strip_prefix(WARNING).unwrap_or(part), scan);
        }
    };
    for line in &answers.lines {
        parts(line.note.as_deref()).for_each(|part| add(part, &line.scan));
    }
    // Cautions of rows that are no answer stand with those rows.
    for row in rows {
        let note = row.marks.note.as_deref();
        parts(note)
            .filter(|part| !part.starts_with(WARNING))
            .for_each(|part| add(part, &row.key.scan));
        if row.converged() == Some(false) && note.is_none() {
            add("not converged", &row.key.scan);
        }
    }
    let all = answers.lines.len();
    found.groups().map(|group| in_words(group, all)).collect()
}

/// A matter, of one scan, of some or of all.
fn in_words(group: &Alike, all: usize) -> String {
    match &group.scans[..] {
        [one] => format!("{one}: {}", group.first),
        scans => format!(
            "{} of {all} scans ({}): {}",
            scans.len(),
            scans.join(", "),
            group.of_all()
        ),
    }
}

/// One note per scan and matter, with the rows it is about.
fn row_notes(rows: &[Row]) -> Vec<String> {
    let found: Vec<(&str, String, String)> = rows.iter().filter_map(note).collect();
    let matters = distinct(found.iter().map(|(scan, words, _)| (*scan, words)));
    let one = |(scan, words): (&str, &String)| {
        let about: Vec<&str> = found
            .iter()
            .filter(|(s, w, _)| *s == scan && w == words)
            .map(|(_, _, row)| row.as_str())
            .collect();
        format!("{scan}: {words} ({})", about.join(", "))
    };
    matters.into_iter().map(one).collect()
}

/// Scan, what is to be known, which row.
fn note(row: &Row) -> Option<(&str, String, String)> {
    let model = Model::of(row)?;
    // Warnings stand above all tables.
    let said = parts(row.marks.note.as_deref()).filter(|part| !part.starts_with(WARNING));
    let said: Vec<&str> = said.collect();
    let words = match (said.is_empty(), row.converged()) {
        (false, _) => said.join("; "),
        (true, Some(false)) => "not converged".to_owned(),
        (true, _) => return None,
    };
    let structure = row.key.structure.name().to_uppercase();
    Some((
        &row.key.scan,
        words,
        format!(
            "{structure} {} {} mm",
            model.name(),
            cells::length(row.key.lp_mm).text
        ),
    ))
}

/// How a modulus was found: the columns of the table and the curves of the figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub enum Model {
    Floppy,
    Firm,
    Ffb,
    /// Connected on SC, weighted on BCC and FCC.
    Graded,
    VoxelFe,
    /// Limit of connected or weighted lattices.
    GradedLimit,
    /// Limit of voxel FE.
    VoxelFeLimit,
    GeometryFe,
}

impl Model {
    pub const ALL: [Model; 8] = [
        Model::Floppy,
        Model::Firm,
        Model::Ffb,
        Model::Graded,
        Model::VoxelFe,
        Model::GradedLimit,
        Model::VoxelFeLimit,
        Model::GeometryFe,
    ];

    /// None for a method without a column, and for elements of a smoother image, which answer nothing: their rows stand in the
    /// table of results alone.
    pub fn of(row: &Row) -> Option<Model> {
        if row.key.elements == Some(Elements::SmoothedGrey) {
            return None;
        }
        Some(match (row.key.boundary, row.key.method) {
            (Some(BoundaryRule::Floppy), _) => Model::Floppy,
            (Some(BoundaryRule::Firm), _) => Model::Firm,
            (Some(BoundaryRule::Graded), _) => Model::Graded,
            (Some(BoundaryRule::Ffb), _) => Model::Ffb,
            (Some(BoundaryRule::Extrapolated), Method::VoxelFe) => Model::VoxelFeLimit,
            (Some(BoundaryRule::Extrapolated), _) => Model::GradedLimit,
            (None, Method::VoxelFe) => Model::VoxelFe,
            (None, Method::GeometryFe) => Model::GeometryFe,
            (None, _) => return None,
        })
    }

    /// A value in the limit, without a lattice parameter of its own.
    pub fn is_limit(self) -> bool {
        matches!(self, Model::GradedLimit | Model::VoxelFeLimit)
    }

    /// Of one structure, whose own name the method has there.
    pub fn name_on(self, structure: CellType) -> String {
        let own = BoundaryRule::Graded.method_name(structure);
        match self {
            Model::Graded => own.to_owned(),
            Model::GradedLimit => format!("{own}, extrapolated"),
            _ => self.name().to_owned(),
        }
    }

    /// Of all structures together.
    pub fn name(self) -> &'static str {
        [
            "floppy",
            "firm",
            "FFB mean",
            "connected or weighted",
            "voxel FE",
            "connected or weighted, extrapolated",
            "voxel FE, extrapolated",
            "geometry-based FE",
        ][self as usize]
    }
}

/// Values in order of first appearance.
fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Axis;
    use crate::result::answer::ScanFacts;
    use crate::result::row::Solution;
    use crate::result::settings::{CellType, Settings};

    fn report_of(rows: &[Row]) -> Report {
        let answers = answers::answers(rows, |_| ScanFacts::default());
        report(rows, answers, &[], &ReportParams::default())
    }

    fn row(scan: &str, boundary: BoundaryRule, lp_mm: f64, e: f64) -> Row {
        Row {
            key: Settings {
                scan: scan.to_owned(),
                boundary: Some(boundary),
                lp_mm,
                young_mpa: 1000.0,
                bv_tv: 0.2,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                wall_s: Some(1.0),
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    #[test]
    fn a_line_holds_all_boundaries_of_one_lattice_parameter() {
        let rows = [
            row("a", BoundaryRule::Floppy, 0.1, 30.0),
            row("a", BoundaryRule::Firm, 0.1, 90.0),
            row("a", BoundaryRule::Ffb, 0.1, 60.0),
            row("a", BoundaryRule::Floppy, 0.2, 20.0),
        ];
        let report = report_of(&rows);
        assert_eq!(report.lines.len(), 2);
        let line = &report.lines[0];
        assert_eq!(
            (
                line.floppy_mpa,
                line.firm_mpa,
                line.ffb_mpa,
                line.graded_mpa
            ),
            (Some(30.0), Some(90.0), Some(60.0), None)
        );
        assert_eq!(line.ffb_over_tissue, Some(0.06));
        assert_eq!(line.condition, None);
    }

    #[test]
    fn settings_that_differ_are_told_apart() {
        let mut sideways = row("a", BoundaryRule::Floppy, 0.1, 12.0);
        sideways.key.axis = Axis::X;
        let lines = table::lines(&[row("a", BoundaryRule::Floppy, 0.1, 30.0), sideways]);
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[1].condition.as_deref(), Some("axis x"));
    }

    #[test]
    fn a_row_that_is_not_converged_is_noted() {
        let mut stalled = row("a", BoundaryRule::Floppy, 0.1, 30.0);
        stalled.solved.as_mut().unwrap().converged = Some(false);
        let report = report_of(&[stalled]);
        assert_eq!(report.notes, ["a: not converged"]);
        assert_eq!(report.method_notes, ["a: not converged (SC floppy 0.1 mm)"]);
    }

    #[test]
    fn a_warning_of_many_scans_is_one_line() {
        let rows: Vec<Row> = ["a", "b"]
            .iter()
            .flat_map(|scan| [0.1, 0.2].map(|lp| row(scan, BoundaryRule::Floppy, lp, 30.0)))
            .map(|mut row| {
                row.marks.mean_thickness_mm = Some(0.05 * (1.0 + row.key.lp_mm));
                crate::result::cautions::mark(&mut row, 5.0);
                row
            })
            .collect();
        let found: Vec<String> = report_of(&rows)
            .notes
            .into_iter()
            .filter(|note| note.contains("far from converged"))
            .collect();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("2 of 2 scans (a, b): the lattice parameter"),
            "{found:?}"
        );
    }

    #[test]
    fn scans_of_like_names_have_figures_of_their_own() {
        let names = ["scan 1", "scan_1", "SCAN_1", "scan_1-2"];
        let rows = names.map(|name| row(name, BoundaryRule::Floppy, 0.1, 30.0));
        let report = report_of(&rows);
        let mut stems: Vec<String> = report
            .figures
            .iter()
            .map(|figure| figure.stem.to_lowercase())
            .collect();
        let all = stems.len();
        stems.sort();
        stems.dedup();
        assert_eq!(stems.len(), all, "{stems:?}");
    }

    #[test]
    fn figures_come_only_where_there_is_something_to_show() {
        let stems = |rows: &[Row]| -> Vec<String> {
            let report = report_of(rows);
            report.figures.into_iter().map(|f| f.stem).collect()
        };
        let mut fine = row("a", BoundaryRule::Floppy, 0.02, 50.0);
        fine.key = Settings {
            method: Method::VoxelFe,
            structure: CellType::Hex8,
            boundary: None,
            ..fine.key
        };
        let coarse = row("a", BoundaryRule::Floppy, 0.1, 30.0);
        assert_eq!(stems(&[]), Vec::<String>::new());
        // One size shows no convergence.
        assert_eq!(stems(std::slice::from_ref(&coarse)), Vec::<String>::new());
        assert_eq!(
            stems(&[
                coarse.clone(),
                fine,
                row("b", BoundaryRule::Floppy, 0.1, 10.0)
            ]),
            ["bv-tv", "answers", "convergence-a", "speed-error"]
        );
    }
}
