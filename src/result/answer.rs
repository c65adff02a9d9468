//! Owns the answer of a scan: of the rows of one condition the one of the least stated error, as a line of `answers.csv`.

pub mod found_by;
pub mod targets;

use crate::result::answer::found_by::FoundBy;
use crate::result::answer::targets::Targets;
use crate::result::condition::Condition;
use crate::result::notes;
use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Elements, Load, Method};
use serde::{Deserialize, Serialize};

/// One line of `answers.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct AnswerLine {
    /// Name of the scan.
    pub scan: String,
    /// From the manifest: who the scan is of.
    pub subject: Option<String>,
    /// From the manifest.
    pub group: Option<String>,
    /// Bone volume fraction, 0 to 1.
    pub bv_tv: f64,
    /// Apparent modulus `K L / A`, pores included in A. None under loads that have no modulus.
    pub e_app_mpa: Option<f64>,
    /// All that is stated; None where the resolution's error is not.
    pub error_mpa: Option<f64>,
    /// `error_mpa` over `e_app_mpa`, in percent; None where either is, or the modulus is 0.
    pub error_percent: Option<f64>,
    /// None where no error was asked for.
    pub met: Option<bool>,
    /// The method of the row that answers.
    pub method: FoundBy,
    /// Lattice parameter or element size; of a limit the finest that it follows from.
    pub element_mm: f64,
    /// Young's modulus of the tissue; of tissue that differs the bone's mean.
    pub young_mpa: f64,
    /// Poisson's ratio of the tissue.
    pub poisson: f64,
    /// Word of the load.
    pub load: String,
    /// How ends, or faces, are held, as a word.
    pub ends: String,
    /// The load axis: `x`, `y` or `z`.
    pub axis: String,
    /// Thickness that is held at each end; 0: end planes only.
    pub grip_mm: f64,
    /// Force over the displacement of the ends. None under bending and torsion.
    pub stiffness_n_per_mm: Option<f64>,
    /// Force at the strain applied, a magnitude. None under bending and torsion.
    pub force_n: Option<f64>,
    /// Force at failure by Pistoia's criterion, a magnitude; None where it was not asked for.
    pub failure_load_n: Option<f64>,
    /// Apparent yield stress by the 0.2 % offset; None where tissue stays elastic or the curve ends before.
    pub yield_stress_mpa: Option<f64>,
    /// Relative change of E_app per relative change of bone volume; None where it was not estimated.
    pub threshold_sensitivity: Option<f64>,
    /// What a reader must know of this number.
    pub note: Option<String>,
    /// Of bending and torsion.
    pub angle_deg: Option<f64>,
    /// Moment at the angle applied, a magnitude. None under other loads.
    pub moment_nmm: Option<f64>,
    /// Moment at failure by Pistoia's criterion, a magnitude. None under other loads.
    pub failure_moment_nmm: Option<f64>,
    /// Of tissue that yields.
    pub yield_stress_error_mpa: Option<f64>,
    /// Largest apparent stress of the curve, a magnitude.
    pub max_stress_mpa: Option<f64>,
    /// Stated error of `max_stress_mpa`; None where it was not asked for.
    pub max_stress_error_mpa: Option<f64>,
    /// Stated error of `failure_load_n`; None where the row that found it states none of its modulus.
    pub failure_load_error_n: Option<f64>,
}

/// Force at failure by Pistoia's criterion that a row found, and its stated error, N. The error is that of the row's modulus in relative
/// terms: on bodies of known failure load it holds as often (`reports/whole-bones.md`).
pub fn failure_load(row: &Row) -> Option<(f64, Option<f64>)> {
    let load = row.failure()?.load_n?;
    Some((load, row.error().map(|e| e * load)))
}

/// What is known of a scan apart from its rows.
#[derive(Debug, Clone, Default)]
pub struct ScanFacts {
    /// Of the volume along x, y, z.
    pub size_mm: Option<[f64; 3]>,
    /// Errors that were asked for.
    pub targets: Targets,
    /// Of the segmentation.
    pub warnings: Vec<String>,
}

/// How the note of a specimen begins whose loaded faces no bone joins.
pub const NO_PATH: &str = "no path of bone";

/// Order in which rows are answers: what carries load before what does not, converged before not, then the least stated error; among rows
/// that state none the more exact method, then the finer.
fn rank(row: &Row) -> (bool, bool, f64, u8, f64) {
    let exactness = match (row.key.method, row.key.boundary) {
        (_, Some(BoundaryRule::Extrapolated)) => 0,
        (Method::VoxelFe | Method::GeometryFe, _) => 1,
        (_, Some(BoundaryRule::Graded)) => 2,
        (_, Some(BoundaryRule::Ffb)) => 3,
        _ => 4,
    };
    (
        row.carries_nothing(),
        row.converged() == Some(false),
        row.answered_error().unwrap_or(f64::INFINITY),
        exactness,
        row.key.lp_mm,
    )
}

/// The row that answers; None where none has a modulus, force or moment. Rows that show only what a coarser image would change do not answer.
pub fn best<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Option<&'a Row> {
    let order = |a: &&Row, b: &&Row| {
        let (a, b) = (rank(a), rank(b));
        let places = (a.0, a.1).cmp(&(b.0, b.1));
        places
            .then(a.2.total_cmp(&b.2))
            .then(a.3.cmp(&b.3))
            .then(a.4.total_cmp(&b.4))
    };
    let answers = |row: &&Row| {
        row.load_carried().is_some() && row.key.elements != Some(Elements::SmoothedGrey)
    };
    rows.into_iter().filter(answers).min_by(order)
}

/// Force at the strain applied, a magnitude, and stiffness of the specimen between its loaded ends: the row's own, or
/// `F = E A ε`, `K = E A / L` of its modulus. None for a stiffness matrix, or where the size is not known.
fn force_and_stiffness(row: &Row, facts: &ScanFacts) -> Option<[f64; 2]> {
    let solved = row.solved.as_ref()?;
    if let Some((force, stiffness)) = solved.force_n.zip(solved.stiffness_n_per_mm) {
        return Some([force, stiffness]);
    }
    let key = &row.key;
    let height_mm = facts.size_mm?[key.axis.index()];
    let gauge_mm = height_mm - 2.0 * key.grip_mm;
    (key.load != Load::Stiffness && gauge_mm > 0.0).then_some(())?;
    let e_times_area = row.e_app_mpa()? * key.tv_mm3 / height_mm;
    Some([e_times_area * key.strain.abs(), e_times_area / gauge_mm])
}

/// The line of a row.
pub fn line(row: &Row, facts: &ScanFacts) -> AnswerLine {
    let key = &row.key;
    let forces = force_and_stiffness(row, facts);
    let mut note = row.marks.note.clone();
    for warning in &facts.warnings {
        notes::add(&mut note, &format!("warning: {warning}"));
    }
    // Of what does not join the loaded faces no error is stated, and no target is met or missed.
    let target = facts.targets.of(&Condition::of(key));
    let target = target.filter(|_| !row.is_disconnected());
    let answered = row.answered_error();
    let strength = row.solved.as_ref().map(|s| s.strength).unwrap_or_default();
    let failure = failure_load(row);
    AnswerLine {
        scan: key.scan.clone(),
        subject: row.marks.subject.clone(),
        group: row.marks.group.clone(),
        bv_tv: key.bv_tv,
        e_app_mpa: row.e_app_mpa(),
        error_mpa: row.error_mpa(),
        error_percent: row.error().map(|e| 100.0 * e),
        met: target.map(|target| answered.is_some_and(|e| e <= target)),
        method: FoundBy::of(row),
        element_mm: key.lp_mm,
        young_mpa: key.young_mpa,
        poisson: key.poisson,
        load: key.load.name().to_owned(),
        ends: key.supports.name().to_owned(),
        axis: key.axis.name().to_owned(),
        grip_mm: key.grip_mm,
        stiffness_n_per_mm: forces.map(|[_, k]| k),
        force_n: forces.map(|[f, _]| f),
        failure_load_n: failure.map(|f| f.0),
        yield_stress_mpa: strength.yield_stress_mpa,
        threshold_sensitivity: row
            .solved
            .as_ref()
            .filter(|s| s.e_app_mpa.is_some())
            .and_then(|s| s.threshold_sensitivity),
        note,
        angle_deg: key.angle_deg,
        moment_nmm: row.solved.as_ref().and_then(|s| s.moment_nmm),
        failure_moment_nmm: row.failure().and_then(|f| f.moment_nmm),
        yield_stress_error_mpa: strength.yield_stress_error_mpa,
        max_stress_mpa: strength.max_stress_mpa,
        max_stress_error_mpa: strength.max_stress_error_mpa,
        failure_load_error_n: failure.and_then(|f| f.1),
    }
}

/// One line a scan, in the order of the rows: of `condition` where a scan has it, else of its last. The failure load is
/// that of any row of the same condition.
pub fn answers(
    rows: &[Row],
    condition: &Condition,
    facts: impl Fn(&str) -> ScanFacts,
) -> Vec<AnswerLine> {
    let mut scans: Vec<&str> = Vec::new();
    for row in rows {
        if !scans.contains(&row.key.scan.as_str()) {
            scans.push(&row.key.scan);
        }
    }
    let answer = |scan: &str| {
        let of_scan = || rows.iter().filter(move |row| row.key.scan == scan);
        let has = |c: &Condition| {
            of_scan().any(|r| Condition::of(&r.key) == *c && r.load_carried().is_some())
        };
        let last = of_scan().next_back().map(|row| Condition::of(&row.key))?;
        let used = if has(condition) { condition } else { &last };
        let own: Vec<&Row> = of_scan()
            .filter(|r| Condition::of(&r.key) == *used)
            .collect();
        let mut answer = line(best(own.iter().copied())?, &facts(scan));
        if answer.e_app_mpa.or(answer.force_n).or(answer.moment_nmm) == Some(0.0) {
            let mut said = own
                .iter()
                .flat_map(|r| notes::parts(r.marks.note.as_deref()));
            let why = said.find(|part| part.starts_with(NO_PATH));
            if let Some(why) = why {
                notes::add(&mut answer.note, why);
            }
        }
        if answer.failure_load_n.is_none() {
            let failure = own.iter().filter_map(|r| failure_load(r)).next_back();
            answer.failure_load_n = failure.map(|f| f.0);
            answer.failure_load_error_n = failure.and_then(|f| f.1);
        }
        Some(answer)
    };
    scans.into_iter().filter_map(answer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::Settings;

    fn row(scan: &str, boundary: Option<BoundaryRule>, e: f64, error: Option<f64>) -> Row {
        Row {
            key: Settings {
                scan: scan.to_owned(),
                method: match boundary {
                    None => Method::VoxelFe,
                    Some(_) => Method::Lattice,
                },
                boundary,
                lp_mm: 0.1,
                tv_mm3: 8.0,
                strain: -0.01,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                algebraic_error_mpa: Some(0.1),
                discretization_error_mpa: error,
                shape_error_mpa: error.map(|_| 0.0),
                converged: Some(true),
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    fn answer_of(rows: &[Row]) -> AnswerLine {
        let condition = Condition::of(&rows[0].key);
        let facts = |_: &str| {
            let mut facts = ScanFacts {
                size_mm: Some([2.0; 3]),
                ..ScanFacts::default()
            };
            facts.targets.set(&condition, 0.05);
            facts
        };
        answers(rows, &condition, facts).remove(0)
    }

    #[test]
    fn the_least_stated_error_answers() {
        let limit = row("a", Some(BoundaryRule::Extrapolated), 50.0, Some(1.9));
        let rows = [
            row("a", Some(BoundaryRule::Floppy), 20.0, None),
            row("a", Some(BoundaryRule::Ffb), 60.0, Some(40.0)),
            row("a", None, 55.0, Some(9.0)),
            limit,
        ];
        let a = answer_of(&rows);
        assert_eq!(
            (a.e_app_mpa, a.error_mpa, a.met),
            (Some(50.0), Some(2.0), Some(true))
        );
        assert_eq!(
            (a.method.to_string(), a.error_percent),
            ("graded-extrapolated".to_owned(), Some(4.0))
        );
        // 4 mm², 1 %, 2 mm.
        assert_eq!((a.force_n, a.stiffness_n_per_mm), (Some(2.0), Some(100.0)));
        assert_eq!(answer_of(&rows[..3]).method.to_string(), "voxel-fe");
        // No error is stated: none is said.
        let a = answer_of(&rows[..1]);
        assert_eq!(
            (a.e_app_mpa, a.error_mpa, a.met),
            (Some(20.0), None, Some(false))
        );
    }

    #[test]
    fn what_carries_no_load_answers_only_where_all_rows_do() {
        let broken = row("a", Some(BoundaryRule::Floppy), 0.0, None);
        let graded = row("a", Some(BoundaryRule::Graded), 3.0, None);
        assert_eq!(
            answer_of(&[broken.clone(), graded]).method.to_string(),
            "graded"
        );
        let alone = answer_of(&[broken]);
        assert_eq!(
            (alone.e_app_mpa, alone.error_mpa, alone.met),
            (Some(0.0), None, None)
        );
    }

    #[test]
    fn a_row_that_is_not_converged_comes_last() {
        let mut stopped = row("a", None, 50.0, Some(0.1));
        stopped.solved.as_mut().unwrap().converged = Some(false);
        let rows = [stopped, row("a", Some(BoundaryRule::Graded), 40.0, None)];
        assert_eq!(answer_of(&rows).method.to_string(), "graded");
    }

    #[test]
    fn a_smoother_image_does_not_answer() {
        let mut smoother = row("a", None, 30.0, Some(0.1));
        smoother.key.elements = Some(Elements::SmoothedGrey);
        let mut own = row("a", None, 40.0, Some(4.0));
        own.solved.as_mut().unwrap().threshold_sensitivity = Some(1.5);
        let answer = answer_of(&[smoother, own]);
        assert_eq!(
            (answer.e_app_mpa, answer.threshold_sensitivity),
            (Some(40.0), Some(1.5))
        );
    }

    #[test]
    fn a_scan_without_the_shared_condition_has_its_own() {
        let mut other = row("b", None, 9.0, Some(0.1));
        other.key.grip_mm = 0.6;
        let rows = [row("a", None, 5.0, Some(0.1)), other];
        let found = answers(&rows, &Condition::of(&rows[0].key), |_| {
            ScanFacts::default()
        });
        let grips: Vec<f64> = found.iter().map(|a| a.grip_mm).collect();
        assert_eq!(grips, [0.0, 0.6]);
    }
}
