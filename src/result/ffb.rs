//! Owns the firm and floppy boundary's mean (Zojaji et al. 2024): at one lattice parameter, FFB is the mean of the firm
//! and the floppy modulus. Its stated error is half their gap, which is a bracket, not a likely error.

use crate::result::cautions::WARNING;
use crate::result::notes;
use crate::result::row::{Marks, Row, Solution};
use crate::result::settings::{BoundaryRule, Settings};
use crate::result::shape;
use crate::result::voxel_check;

/// The rows of `rows` with one FFB row after each pair of firm and floppy that differ in nothing else. FFB rows already
/// there are replaced. A row of voxel FE among `known` may show that a pair is no bracket.
pub fn with_ffb(rows: &[Row], known: &[Row]) -> Vec<Row> {
    let mut all: Vec<Row> = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.key.boundary != Some(BoundaryRule::Ffb))
    {
        all.push(row.clone());
        let partner = all.iter().find(|other| are_a_pair(row, other));
        let mean = partner.map(|other| checked(mean_row(row, other), [row, other], known));
        all.extend(mean);
    }
    all
}

fn are_a_pair(a: &Row, b: &Row) -> bool {
    let [a, b] = [a, b].map(|row| &row.key);
    let boundaries = [a.boundary, b.boundary];
    let one_of_each = [BoundaryRule::Firm, BoundaryRule::Floppy]
        .into_iter()
        .all(|part| boundaries.contains(&Some(part)));
    // Without a modulus there is no bracket of it.
    let bracketed = one_of_each && a.load.has_modulus();
    bracketed && a.without_boundary() == b.without_boundary()
}

/// The mean states no error where its parts are no bracket.
fn checked(mut mean: Row, parts: [&Row; 2], known: &[Row]) -> Row {
    let part = |boundary| parts.into_iter().find(|r| r.key.boundary == Some(boundary));
    let pair = part(BoundaryRule::Floppy).zip(part(BoundaryRule::Firm));
    let fault = pair.and_then(|(floppy, firm)| {
        voxel_check::bracket_fault(floppy, firm, voxel_check::witness(&mean, known))
    });
    if let Some(why) = fault.filter(|_| mean.e_app_mpa().is_some()) {
        voxel_check::state_no_error(&mut mean, &why);
    }
    mean
}

/// Modulus over the tissue's below which a lattice only turns and shifts: a mechanism.
const MECHANISM: f64 = 1e-9;

/// Whether one of the two carries no load and the other does: half of the other is no estimate.
fn only_one_carries(a: &Row, b: &Row) -> bool {
    let carries = |row: &Row| row.e_app_mpa() > Some(MECHANISM * row.key.young_mpa);
    carries(a) != carries(b)
}

/// The modulus is the mean, sites and times are sums, it is converged where both are; the rest is missing, as the checks by
/// reaction and mean stress, which firm and floppy lattices do not share.
fn mean_row(a: &Row, b: &Row) -> Row {
    let solved = a.solved.as_ref().zip(b.solved.as_ref());
    let mut row = Row {
        key: Settings {
            boundary: Some(BoundaryRule::Ffb),
            ..a.key.clone()
        },
        solved: solved.map(|(s, t)| {
            let mean = match only_one_carries(a, b) || a.is_no_answer() || b.is_no_answer() {
                true => without_moduli(mean(s, t)),
                false => mean(s, t),
            };
            Solution {
                shape_error_mpa: mean.e_app_mpa.zip(shape::of_lattice(a)).map(|(e, s)| s * e),
                ..mean
            }
        }),
        marks: Marks {
            note: note(a, b),
            ..a.marks.clone()
        },
    };
    if row.is_disconnected() {
        row.state_no_errors();
    }
    row
}

fn mean(a: &Solution, b: &Solution) -> Solution {
    let both = |x: Option<f64>, y: Option<f64>| Some(x? + y?);
    let mean = |x, y| both(x, y).map(|sum| 0.5 * sum);
    Solution {
        sites: a.sites.zip(b.sites).map(|(x, y)| x + y),
        e_app_mpa: mean(a.e_app_mpa, b.e_app_mpa),
        // Of two errors that are halved and added, at most.
        algebraic_error_mpa: mean(a.algebraic_error_mpa, b.algebraic_error_mpa),
        // Half the bracket.
        discretization_error_mpa: a
            .e_app_mpa
            .zip(b.e_app_mpa)
            .map(|(x, y)| 0.5 * (x - y).abs()),
        wall_s: both(a.wall_s, b.wall_s),
        converged: both_converged(a, b),
        ..Solution::default()
    }
}

fn without_moduli(mean: Solution) -> Solution {
    Solution {
        e_app_mpa: None,
        algebraic_error_mpa: None,
        discretization_error_mpa: None,
        ..mean
    }
}

/// None where it is not known of either.
fn both_converged(a: &Solution, b: &Solution) -> Option<bool> {
    match (a.converged, b.converged) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (x, y) => x.and(y),
    }
}

/// A mean of an unconverged modulus must say so. It has the warnings of its parts, and why both carry nothing.
fn note(a: &Row, b: &Row) -> Option<String> {
    let mut note = None;
    let parts = || [a, b].into_iter();
    if parts().any(|row| row.converged() == Some(false)) {
        notes::add(&mut note, "mean of a modulus that is not converged");
    }
    if parts().any(Row::is_no_answer) {
        notes::add(
            &mut note,
            "no mean: one of its lattices carries no load although the bone does",
        );
    } else if only_one_carries(a, b) {
        notes::add(
            &mut note,
            "no mean: one of its lattices carries no load, so half of the other's modulus would be no estimate",
        );
    }
    let are_apart = parts().all(Row::is_disconnected);
    let all = parts().flat_map(|row| notes::parts(row.marks.note.as_deref()));
    let own = all.filter(|n| are_apart || n.starts_with(WARNING));
    own.for_each(|words| notes::add(&mut note, words));
    note
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(boundary: BoundaryRule, lp_mm: f64, e: f64) -> Row {
        let firm = boundary == BoundaryRule::Firm;
        Row {
            key: Settings {
                scan: "a".to_owned(),
                boundary: Some(boundary),
                lp_mm,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                e_app_stress_mpa: firm.then_some(e),
                sites: Some(10),
                wall_s: Some(2.0),
                converged: Some(!firm),
                mechanisms: Some(3),
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    #[test]
    fn the_mean_follows_the_second_of_its_pair() {
        let rows = [
            row(BoundaryRule::Firm, 0.1, 30.0),
            row(BoundaryRule::Firm, 0.2, 50.0),
            row(BoundaryRule::Floppy, 0.1, 10.0),
            row(BoundaryRule::Graded, 0.1, 19.0),
        ];
        let all = with_ffb(&rows, &[]);
        assert_eq!(all.len(), 5);
        let mean = &all[3];
        assert_eq!(mean.key.boundary, Some(BoundaryRule::Ffb));
        assert_eq!((mean.key.lp_mm, mean.e_app_mpa()), (0.1, Some(20.0)));
        let solved = mean.solved.as_ref().unwrap();
        assert_eq!((solved.sites, solved.wall_s), (Some(20), Some(4.0)));
        assert_eq!((solved.e_app_stress_mpa, solved.mechanisms), (None, None));
        assert_eq!(solved.converged, Some(false), "firm is not");
        assert!(mean.marks.note.as_ref().unwrap().contains("not converged"));
    }

    #[test]
    fn a_mean_is_converged_where_both_its_parts_are() {
        let with = |firm, floppy| {
            let part = |boundary, converged| {
                let mut row = row(boundary, 0.1, 1.0);
                row.solved.as_mut().unwrap().converged = converged;
                row
            };
            let rows = [
                part(BoundaryRule::Firm, firm),
                part(BoundaryRule::Floppy, floppy),
            ];
            with_ffb(&rows, &[])[2].converged()
        };
        let (yes, no) = (Some(true), Some(false));
        assert_eq!(
            [with(yes, yes), with(yes, no), with(no, yes)],
            [yes, no, no]
        );
        assert_eq!([with(None, yes), with(None, no)], [None, no]);
    }

    #[test]
    fn means_are_not_made_twice() {
        let rows = [
            row(BoundaryRule::Firm, 0.1, 3.0),
            row(BoundaryRule::Floppy, 0.1, 1.0),
        ];
        let once = with_ffb(&rows, &[]);
        assert_eq!(with_ffb(&once, &[]), once);
    }

    #[test]
    fn firm_below_floppy_states_no_error() {
        let rows = [
            row(BoundaryRule::Floppy, 0.1, 62.0),
            row(BoundaryRule::Firm, 0.1, 45.0),
        ];
        let mean = &with_ffb(&rows, &[])[2];
        assert_eq!((mean.e_app_mpa(), mean.error_mpa()), (Some(53.5), None));
        let note = mean.marks.note.as_ref().unwrap();
        assert!(
            note.contains("warning: no error is stated: firm (45.000 MPa)"),
            "{note}"
        );
    }

    #[test]
    fn no_mean_is_made_of_a_lattice_that_carries_nothing() {
        let rows = |is_no_answer: bool| {
            let mut floppy = row(BoundaryRule::Floppy, 0.1, 0.0);
            floppy.marks.is_no_answer = is_no_answer;
            with_ffb(&[floppy, row(BoundaryRule::Firm, 0.1, 45.0)], &[])
        };
        let apart = rows(true);
        assert_eq!((apart[2].e_app_mpa(), apart[2].error_mpa()), (None, None));
        let note = apart[2].marks.note.as_ref().unwrap();
        assert!(note.contains("although the bone does"), "{note}");
        assert!(!apart[0].is_disconnected() && apart[0].error_mpa().is_none());
        let gap = rows(false);
        assert_eq!(gap[2].e_app_mpa(), None);
        assert!(gap[0].is_disconnected());
        // No bone connects the faces: both are right.
        let mut none = [BoundaryRule::Floppy, BoundaryRule::Firm].map(|b| row(b, 0.1, 0.0));
        none[0].marks.note = Some("no path of bone".to_owned());
        let mean = &with_ffb(&none, &[])[2];
        assert_eq!((mean.e_app_mpa(), mean.error_mpa()), (Some(0.0), None));
        let note = mean.marks.note.as_ref().unwrap();
        assert!(note.contains("no path of bone"), "{note}");
    }

    #[test]
    fn other_settings_are_no_pair() {
        let mut stiffer = row(BoundaryRule::Floppy, 0.1, 1.0);
        stiffer.key.young_mpa = 2.0;
        assert_eq!(
            with_ffb(&[row(BoundaryRule::Firm, 0.1, 3.0), stiffer], &[]).len(),
            2
        );
    }
}
