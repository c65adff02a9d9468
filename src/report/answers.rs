//! Owns the answers of a report: one line a scan, what they have in common, and what is left out.

use crate::report::cells::{Cell, Table, length, link, number, text, with_error};
use crate::report::distinct;
use crate::result::answer;
use crate::result::answer::found_by::FoundBy;
use crate::result::answer::{AnswerLine, ScanFacts};
use crate::result::condition::{Condition, shared};
use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Method};
use serde::Serialize;

#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Answers {
    pub lines: Vec<AnswerLine>,
    /// Load and tissue in sentences; what the methods of the answers are.
    pub conditions: Vec<String>,
    /// Rows and scans that differ from the conditions, in words.
    pub left_out: Vec<String>,
    /// Scans of other conditions: in no comparison.
    pub apart: Vec<String>,
}

/// The answers of `rows`; `facts` has what is known of a scan.
pub fn answers(rows: &[Row], facts: impl Fn(&str) -> ScanFacts) -> Answers {
    let solved: Vec<&Row> = rows.iter().filter(|r| r.load_carried().is_some()).collect();
    let Some(condition) = shared(&solved) else {
        return Answers::default();
    };
    let lines = answer::answers(rows, &condition, facts);
    let mut left_out = Vec::new();
    let mut apart = Vec::new();
    for line in &lines {
        let own = solved.iter().filter(|row| row.key.scan == line.scan);
        let all = distinct(own.map(|row| Condition::of(&row.key)));
        let others: Vec<String> = all
            .iter()
            .filter(|c| **c != condition)
            .map(|c| c.difference(&condition))
            .collect();
        if !all.contains(&condition) {
            apart.push(line.scan.clone());
            left_out.push(format!(
                "{} was solved under other conditions only ({}): in no comparison",
                line.scan,
                others.join("; ")
            ));
        } else if !others.is_empty() {
            left_out.push(format!(
                "{} has rows of other conditions too, which are not its answer ({})",
                line.scan,
                others.join("; ")
            ));
        }
    }
    let mut conditions = vec![condition.load_in_words(), condition.tissue_in_words()];
    conditions.extend(failure_in_words(&lines));
    conditions.extend(strength_in_words(&lines));
    conditions.extend(methods_in_words(&lines));
    Answers {
        lines,
        conditions,
        left_out,
        apart,
    }
}

impl Answers {
    /// Says so where a subject has several scans: methods are compared scan by scan.
    pub(super) fn subjects_repeat(&self) -> Option<&'static str> {
        let named: Vec<&str> = self
            .lines
            .iter()
            .filter_map(|line| line.subject.as_deref())
            .collect();
        (distinct(named.iter().copied()).len() < named.len()).then_some(
            "Methods are compared scan by scan. Scans of one subject are not independent, so the p values here are too small where subjects have several scans.",
        )
    }
}

/// What a failure load is, where one was found.
fn failure_in_words(lines: &[AnswerLine]) -> Option<String> {
    lines.iter().any(|line| line.failure_load_n.is_some()).then(|| {
        "Failure load: by Pistoia's criterion, the force at which a share of the bone (2 % unless set otherwise) exceeds an effective strain (0.007). It is proportional to the tissue modulus. Its ± is that of E_app in relative terms, which held as often on bodies of known failure load; it does not hold what the criterion leaves open."
            .to_owned()
    })
}

/// What the stresses of tissue that yields are, where some does.
fn strength_in_words(lines: &[AnswerLine]) -> Option<String> {
    let yields = lines.iter().any(|line| line.max_stress_mpa.is_some());
    let is_stated = lines.iter().any(|line| line.max_stress_error_mpa.is_some());
    let error = match is_stated {
        true => {
            "the error asked for is theirs, and ± holds what finer load steps and finer elements would change and what the solver left, not what the image leaves open about the bone's surface"
        }
        false => "their error is not stated (--error asks for it)",
    };
    yields.then(|| {
        format!(
            "Yield stress: where the apparent stress-strain curve meets the elastic line shifted by 0.2 % strain; largest stress: of the curve, up to the strain applied. Both are magnitudes; {error}."
        )
    })
}

/// What each method of the answers is, in plain words.
fn methods_in_words(lines: &[AnswerLine]) -> Vec<String> {
    distinct(lines.iter().map(|line| line.method))
        .into_iter()
        .map(|method| format!("{}: {}.", method.in_words(), explained(method)))
        .collect()
}

fn explained(found: FoundBy) -> &'static str {
    match (found.boundary, found.method) {
        (Some(BoundaryRule::Floppy), _) => {
            "a lattice of springs whose sites lie in bone only; too soft while struts are a few sites thick"
        }
        (Some(BoundaryRule::Firm), _) => {
            "a lattice of springs padded by one layer of sites around the bone; too stiff while struts are a few sites thick"
        }
        (Some(BoundaryRule::Ffb), _) => {
            "the mean of the floppy lattice (sites in bone only, too soft) and the firm one (padded by a layer, too stiff) of one lattice parameter; ± includes half the gap between them and the uncertainty of the surface; no error is stated where voxel FE, or the order of the two, shows that the answer does not lie between them"
        }
        (Some(BoundaryRule::Graded), _) => {
            "a lattice of springs with one site for each connected component of bone in a cell (SC), or with sites weighted by bone fraction (BCC, FCC); one lattice parameter states no discretisation error"
        }
        (None, Method::VoxelFe) => {
            "hexahedral elements; ± includes the error of elements of this size and the uncertainty of the surface, for struts of this thickness"
        }
        (None, Method::GeometryFe) => {
            "tetrahedra of ten nodes inside the smooth surface of the bone; ± includes the error of elements of this size and the uncertainty of the surface"
        }
        (Some(BoundaryRule::Extrapolated), Method::Lattice) => {
            "the limit of such lattices (a site for every connected component of bone in a cell, or sites weighted by bone fraction) of several lattice parameters"
        }
        (Some(BoundaryRule::Extrapolated), _) => {
            "the limit of hexahedral elements of two sizes: that of the voxel staircase, not of the bone; no error is stated"
        }
        (None, _) => "see the solves",
    }
}

/// The first table of the page.
pub fn table(answers: &Answers) -> Table {
    let head = [
        "scan",
        "E_app ± error (MPa)",
        "error (%)",
        "error target",
        "group",
        "subject",
        "BV/TV",
        "how",
        "LP or element (mm)",
        "conditions",
        "stiffness (N/mm)",
        "force (N)",
        "moment (N mm)",
        "failure load (N)",
        "failure moment (N mm)",
        "yield stress (MPa)",
        "largest stress (MPa)",
    ];
    let body = answers.lines.iter().map(|line| cells(line, answers));
    Table::new(&head, body.collect()).without_empty_columns()
}

fn cells(line: &AnswerLine, answers: &Answers) -> Vec<Cell> {
    let words = |word: &Option<String>| text(word.as_deref().unwrap_or(""));
    let met = match line.met {
        Some(true) => "met",
        Some(false) => "not met",
        None => "",
    };
    vec![
        link(&line.scan),
        with_error(line.e_app_mpa, line.error_mpa),
        percent(line),
        text(met),
        words(&line.group),
        words(&line.subject),
        number(Some(line.bv_tv)),
        text(line.method.in_words()),
        length(line.element_mm),
        text(match answers.apart.contains(&line.scan) {
            true => "others (see notes)",
            false => "",
        }),
        number(line.stiffness_n_per_mm),
        number(line.force_n),
        number(line.moment_nmm),
        with_error(line.failure_load_n, line.failure_load_error_n),
        number(line.failure_moment_nmm),
        with_error(line.yield_stress_mpa, line.yield_stress_error_mpa),
        with_error(line.max_stress_mpa, line.max_stress_error_mpa),
    ]
}

fn percent(line: &AnswerLine) -> Cell {
    match line.error_percent {
        Some(p) => Cell {
            text: format!("{p:.1}"),
            ..number(Some(p))
        },
        None => text("not stated"),
    }
}

/// Answers that can be compared: of the shared conditions, with a modulus above 0. The others are named.
pub fn comparable(answers: &Answers) -> (Vec<&AnswerLine>, Vec<String>) {
    let mut notes = Vec::new();
    let mut kept = Vec::new();
    for line in &answers.lines {
        if answers.apart.contains(&line.scan) {
            continue;
        }
        match line.e_app_mpa {
            Some(e) if e > 0.0 => kept.push(line),
            None if line.force_n.or(line.moment_nmm).is_some_and(|f| f > 0.0) => {}
            _ => notes.push(format!(
                "{} carries no load (E_app 0): left out of groups and figures",
                line.scan
            )),
        }
    }
    (kept, notes)
}

/// Says so where answers that are compared were found in different ways: their errors differ.
pub fn unlike_methods(kept: &[&AnswerLine]) -> Option<String> {
    let methods = distinct(kept.iter().map(|line| line.method));
    let of = |method: FoundBy| {
        let scans = kept.iter().filter(|line| line.method == method);
        let scans: Vec<&str> = scans.map(|line| line.scan.as_str()).collect();
        format!("{}: {}", method.in_words(), scans.join(", "))
    };
    (methods.len() > 1).then(|| {
        let lists: Vec<String> = methods.iter().map(|method| of(*method)).collect();
        format!(
            "the answers were found in different ways ({}): their errors differ, solve all scans in one way before groups are compared",
            lists.join("; ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::{BoundaryRule, Settings};

    fn row(scan: &str, grip_mm: f64, e: f64) -> Row {
        Row {
            key: Settings {
                scan: scan.to_owned(),
                boundary: Some(BoundaryRule::Ffb),
                young_mpa: 1000.0,
                strain: -0.01,
                grip_mm,
                lp_mm: 0.1,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                discretization_error_mpa: Some(0.3 * e),
                shape_error_mpa: Some(0.2 * e),
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    #[test]
    fn a_scan_of_other_conditions_is_named_and_not_compared() {
        let rows = [
            row("a", 0.0, 10.0),
            row("b", 0.0, 20.0),
            row("c", 0.6, 90.0),
            row("d", 0.0, 0.0),
        ];
        let found = answers(&rows, |_| ScanFacts::default());
        assert_eq!(found.lines.len(), 4);
        assert_eq!(found.apart, ["c"]);
        assert!(
            found.left_out[0].contains("grips of 0.6 mm"),
            "{:?}",
            found.left_out
        );
        let (kept, notes) = comparable(&found);
        let names: Vec<&str> = kept.iter().map(|a| a.scan.as_str()).collect();
        assert_eq!(names, ["a", "b"]);
        assert!(notes[0].starts_with("d carries no load"));
        assert!(
            found.conditions[1].contains("1000 MPa"),
            "{:?}",
            found.conditions
        );
        assert!(
            found.conditions[2].starts_with("FFB mean"),
            "{:?}",
            found.conditions
        );
    }

    #[test]
    fn the_table_has_one_plus_minus() {
        let found = answers(&[row("a", 0.0, 10.0)], |_| ScanFacts::default());
        let table = table(&found);
        let at = table
            .head
            .iter()
            .position(|h| h.starts_with("E_app"))
            .unwrap();
        assert_eq!(table.body[0][at].text, "10.0 ± 5.0");
        assert!(!table.head.iter().any(|h| h == "failure load (N)"));
    }
}
