//! Owns what the report compares: each method's moduli of all scans solved alike, and which rows cannot be compared.

use super::table::{condition, varying_settings};
use super::{Model, distinct};
use crate::result::row::Row;
use crate::result::settings::CellType;

/// Fewer scans than this make no statistics.
pub(super) const LEAST_SCANS: usize = 3;

/// One scan by one method, at its finest lattice parameter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Case {
    pub scan: String,
    pub group: Option<String>,
    pub bv_tv: f64,
    /// Of the cells or elements that carry load; None for means and limits, which have none.
    pub model_bv_tv: Option<f64>,
    pub e_app_mpa: f64,
    /// All that is stated of the error, over the modulus.
    pub stated: Option<f64>,
}

/// One method's moduli of the scans that have them: three scans or more.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    pub method: String,
    pub(super) model: Model,
    pub(super) structure: CellType,
    pub(super) cases: Vec<Case>,
}

impl Sample {
    pub(super) fn of(&self, scan: &str) -> Option<&Case> {
        self.cases.iter().find(|case| case.scan == scan)
    }

    pub(super) fn e_app_mpa(&self) -> Vec<f64> {
        self.cases.iter().map(|case| case.e_app_mpa).collect()
    }

    /// BV/TV of the mask and of the model, of the scans whose model has one.
    pub(super) fn bone_volumes(&self) -> [Vec<f64>; 2] {
        let both = |case: &Case| Some((case.bv_tv, case.model_bv_tv?));
        let (mask, model) = self.cases.iter().filter_map(both).unzip();
        [mask, model]
    }

    /// Mean over scans; infinite where one of them states none.
    pub(super) fn stated(&self) -> f64 {
        let all = self.cases.iter().map(|c| c.stated.unwrap_or(f64::INFINITY));
        all.sum::<f64>() / self.cases.len() as f64
    }
}

/// The methods to compare, and a line on each reason for which rows are left out. Both empty for fewer than three scans.
///
/// Scans that carry no load by any method are left out: all methods agree on them. Only converged rows of the settings that most scans share are compared (of the first, where several are shared alike).
pub fn samples(rows: &[Row]) -> (Vec<Sample>, Vec<String>) {
    let usable = |row: &&Row| row.converged() != Some(false) && row.e_app_mpa().is_some();
    let carries_load = |scan: &str| {
        let own = |row: &&Row| row.key.scan == scan;
        let mut moduli = rows.iter().filter(own).filter_map(Row::e_app_mpa);
        moduli.any(|e| e > 0.0)
    };
    let known = rows
        .iter()
        .filter(|row| Model::of(row).is_some() && carries_load(&row.key.scan));
    // Where a lattice falls is chance, no setting: limits are over all registrations.
    let comparable: Vec<Row> = known
        .clone()
        .filter(usable)
        .map(|row| {
            let mut row = row.clone();
            row.key.registration_mm = None;
            row
        })
        .collect();
    let scans = distinct(known.map(|row| &row.key.scan));
    if scans.len() < LEAST_SCANS {
        return (Vec::new(), Vec::new());
    }
    let (kept, other_settings) = of_shared_settings(&comparable);
    let mut samples = by_method(&kept);
    let elsewhere = |scan: &str| {
        let has = |rows: &[&Row]| rows.iter().any(|row| row.key.scan == scan);
        !has(&kept) && comparable.iter().any(|row| row.key.scan == scan)
    };
    let mut scans: Vec<&str> = scans.into_iter().map(String::as_str).collect();
    scans.retain(|scan| !elsewhere(scan));
    let lacking = lacking(&samples, &scans);
    samples.retain(|sample| sample.cases.len() >= LEAST_SCANS);
    let notes = other_settings.into_iter().chain(lacking).collect();
    (samples, notes)
}

/// The rows of the settings that most scans share, and what is left out.
fn of_shared_settings(rows: &[Row]) -> (Vec<&Row>, Option<String>) {
    let varying = varying_settings(rows);
    let words = |row: &Row| condition(row, &varying).unwrap_or_default();
    let scans_with = |settings: &String| {
        let own = rows.iter().filter(|row| words(row) == *settings);
        distinct(own.map(|row| &row.key.scan))
    };
    let all = distinct(rows.iter().map(words));
    // The last of equals is taken: reversed, the first.
    let Some(shared) = all.iter().rev().max_by_key(|s| scans_with(s).len()) else {
        return (Vec::new(), None);
    };
    let kept: Vec<&Row> = rows.iter().filter(|row| words(row) == *shared).collect();
    let in_it = scans_with(shared);
    let mut left_out = Vec::new();
    for other in all.iter().filter(|s| *s != shared) {
        let (also, only): (Vec<&String>, Vec<&String>) = scans_with(other)
            .into_iter()
            .partition(|s| in_it.contains(s));
        left_out.extend(only.iter().map(|scan| format!("{scan} ({other})")));
        left_out.extend((!also.is_empty()).then(|| format!("further rows with {other}")));
    }
    let note = format!(
        "Statistics are over rows with {shared}, which most scans share; left out: {}",
        left_out.join("; ")
    );
    (kept, (all.len() > 1).then_some(note))
}

/// Each method with the scans that it was used on, in order of first appearance.
fn by_method(rows: &[&Row]) -> Vec<Sample> {
    let method = |row: &Row| Some((Model::of(row)?, row.key.structure));
    let methods = distinct(rows.iter().filter_map(|row| method(row)));
    let lattices = distinct(
        methods
            .iter()
            .filter(|(_, s)| s.is_lattice())
            .map(|(_, s)| s),
    )
    .len();
    let scans = distinct(rows.iter().map(|row| &row.key.scan));
    let sample = |(model, structure): &(Model, CellType)| {
        let own = |row: &&&Row| Model::of(row) == Some(*model) && row.key.structure == *structure;
        let finest = |scan: &&String| {
            let of_scan = rows.iter().filter(own).filter(|row| row.key.scan == **scan);
            case(of_scan.min_by(|a, b| a.key.lp_mm.total_cmp(&b.key.lp_mm))?)
        };
        let prefix = match lattices > 1 && structure.is_lattice() {
            true => format!("{} ", structure.name().to_uppercase()),
            false => String::new(),
        };
        Sample {
            method: format!("{prefix}{}", model.name_on(*structure)),
            model: *model,
            structure: *structure,
            cases: scans.iter().filter_map(finest).collect(),
        }
    };
    methods.iter().map(sample).collect()
}

fn case(row: &Row) -> Option<Case> {
    let e_app_mpa = row.e_app_mpa()?;
    let errors = row.stated_errors_mpa();
    let stated = errors[1].map(|_| {
        let sum: f64 = errors.iter().flatten().map(|e| e.abs()).sum();
        sum / e_app_mpa
    });
    Some(Case {
        scan: row.key.scan.clone(),
        group: row.marks.group.clone(),
        bv_tv: row.key.bv_tv,
        model_bv_tv: row.solved.as_ref().and_then(|s| s.model_bv_tv),
        e_app_mpa,
        stated: stated.filter(|s| s.is_finite()),
    })
}

/// Which scans lack which methods, in one line.
fn lacking(samples: &[Sample], scans: &[&str]) -> Option<String> {
    let lacks: Vec<String> = scans
        .iter()
        .filter_map(|scan| {
            let compared = samples.iter().filter(|s| s.cases.len() >= LEAST_SCANS);
            let without = compared.filter(|s| s.of(scan).is_none());
            let methods: Vec<&str> = without.map(|s| s.method.as_str()).collect();
            (!methods.is_empty()).then(|| format!("{scan} (no converged {})", methods.join("; ")))
        })
        .collect();
    let few = samples.iter().filter(|s| s.cases.len() < LEAST_SCANS);
    let few: Vec<&str> = few.map(|s| s.method.as_str()).collect();
    let few = match few.is_empty() {
        true => String::new(),
        false => format!(
            "; fewer than {LEAST_SCANS} scans, in no comparison: {}",
            few.join("; ")
        ),
    };
    let line = "Statistics compare two methods over the scans that have both";
    match (lacks.is_empty(), few.is_empty()) {
        (true, true) => None,
        (true, false) => Some(format!("{line}{few}")),
        _ => Some(format!(
            "{line}, so n differs; left out: {}{few}",
            lacks.join(", ")
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::super::statistics::cases::{cohort, scans_of};
    use super::*;
    use crate::grid::Axis;
    use crate::result::settings::{BoundaryRule, Method, Settings};

    #[test]
    fn two_scans_make_no_statistics() {
        assert_eq!(samples(&cohort(2)), (Vec::new(), Vec::new()));
    }

    #[test]
    fn methods_are_compared_at_the_finest_lattice_parameter() {
        let (samples, notes) = samples(&cohort(4));
        assert_eq!(samples.len(), 3);
        assert_eq!(samples[1].e_app_mpa(), [20.2, 40.2, 60.2, 80.2]);
        assert_eq!(notes, Vec::<String>::new());
    }

    #[test]
    fn a_scan_without_one_of_the_methods_is_left_out_of_that_one_only() {
        let mut rows = cohort(4);
        rows.retain(|row| !(row.key.scan == "s2" && row.key.boundary == Some(BoundaryRule::Firm)));
        let (samples, notes) = samples(&rows);
        assert_eq!(scans_of(&samples[0]), ["s1", "s2", "s3", "s4"]);
        assert_eq!(scans_of(&samples[1]), ["s1", "s3", "s4"]);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(
            notes[0].ends_with("left out: s2 (no converged firm)"),
            "{notes:?}"
        );
    }

    #[test]
    fn one_solve_more_of_one_scan_takes_nothing_away() {
        let mut rows = cohort(4);
        let (before, _) = samples(&rows);
        let mut more = rows[0].clone();
        more.key = Settings {
            method: Method::VoxelFe,
            structure: CellType::Hex8,
            boundary: None,
            ..more.key
        };
        rows.push(more);
        let (after, notes) = samples(&rows);
        assert_eq!(after, before);
        assert!(notes[0].contains("in no comparison: voxel FE"), "{notes:?}");
    }

    #[test]
    fn rows_of_settings_that_most_scans_do_not_share_are_left_out() {
        let mut rows = cohort(4);
        let (before, _) = samples(&rows);
        // Finer than what is compared, but along another axis; and a scan of another tissue.
        let mut sideways = rows[0].clone();
        (sideways.key.axis, sideways.key.lp_mm) = (Axis::X, 0.01);
        rows.insert(0, sideways);
        let stiffer = |row: &Row| {
            let mut row = row.clone();
            (row.key.scan, row.key.young_mpa) = ("s9".to_owned(), 5.0);
            row
        };
        let more: Vec<Row> = rows[1..7].iter().map(stiffer).collect();
        rows.extend(more);
        let (after, notes) = samples(&rows);
        assert_eq!(after, before);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(
            notes[0].contains("further rows with axis x, E 0 MPa"),
            "{notes:?}"
        );
        assert!(notes[0].contains("s9 (axis z, E 5 MPa)"), "{notes:?}");
    }

    #[test]
    fn what_is_not_converged_is_left_out() {
        let mut rows = cohort(4);
        for row in rows.iter_mut().filter(|row| row.key.scan == "s1") {
            row.solved.as_mut().unwrap().converged = Some(false);
        }
        let (samples, notes) = samples(&rows);
        assert!(samples.iter().all(|s| scans_of(s) == ["s2", "s3", "s4"]));
        assert!(
            notes[0].contains("s1 (no converged floppy; firm; FFB mean)"),
            "{notes:?}"
        );
    }
}
