//! Owns the check of lattices by voxel FE: whether floppy and firm bracket it, whether a limit of lattices agrees with it.
//!
//! The witness is a row of one element a voxel under the same conditions. It is no truth, but it keeps the cracks and the
//! connections of the voxels, which lattices of larger cells may bridge or lose. A row that it contradicts states no error.

use crate::result::cautions::WARNING;
use crate::result::notes;
use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Elements, Method};

/// How the note of a row begins whose error would be wrong.
const NO_ERROR: &str = "no error is stated: ";

/// The converged row of one element a voxel under the conditions of `row`, the most exact one; None where there is none.
pub fn witness<'a>(row: &Row, known: &'a [Row]) -> Option<&'a Row> {
    let conditions = row.key.without_discretisation();
    let voxels = known.iter().filter(|other| {
        other.key.method == Method::VoxelFe
            && other.key.elements == Some(Elements::Voxels)
            && other.key.boundary.is_none()
            && other.converged() == Some(true)
            && other.e_app_mpa().is_some()
            && other.key.without_discretisation() == conditions
    });
    voxels.min_by(|a, b| solver_error(a).total_cmp(&solver_error(b)))
}

/// Why a floppy and a firm row are no bracket of the answer, in words; None where nothing known says so.
pub fn bracket_fault(floppy: &Row, firm: &Row, witness: Option<&Row>) -> Option<String> {
    let (low, high) = (floppy.e_app_mpa()?, firm.e_app_mpa()?);
    if high + solver_error(firm) < low - solver_error(floppy) {
        return Some(format!(
            "firm ({high:.3} MPa) lies below floppy ({low:.3} MPa), so the answer need not lie between them"
        ));
    }
    let voxels = witness?.e_app_mpa()?;
    let open = solver_error(witness?);
    let below = voxels + open < low - solver_error(floppy);
    let above = voxels - open > high + solver_error(firm);
    (below || above).then(|| {
        format!(
            "voxel FE at one element a voxel ({voxels:.3} MPa) lies outside floppy ({low:.3} MPa) and firm ({high:.3} MPa), so the answer need not lie between them"
        )
    })
}

/// Marks the limits of lattices in `rows` that a row of `known` contradicts by more than they state.
pub fn check_limits(rows: &mut [Row], known: &[Row]) {
    for row in rows.iter_mut().filter(|row| is_lattice_limit(row)) {
        if let Some(why) = witness(row, known).and_then(|voxels| limit_fault(row, voxels)) {
            state_no_error(row, &why);
        }
    }
}

fn is_lattice_limit(row: &Row) -> bool {
    row.key.method == Method::Lattice && row.key.boundary == Some(BoundaryRule::Extrapolated)
}

fn limit_fault(limit: &Row, witness: &Row) -> Option<String> {
    let (e, voxels) = (limit.e_app_mpa()?, witness.e_app_mpa()?);
    let stated = limit.error_mpa()?;
    ((e - voxels).abs() > stated + solver_error(witness)).then(|| {
        format!(
            "voxel FE at one element a voxel ({voxels:.3} MPa) contradicts this limit of lattices by more than the stated {stated:.3} MPa, which happens where coarse lattices bridge cracks or lose thin struts"
        )
    })
}

/// Takes the errors of model and shape out of a row and says why.
pub fn state_no_error(row: &mut Row, why: &str) {
    if let Some(solved) = &mut row.solved {
        (solved.discretization_error_mpa, solved.shape_error_mpa) = (None, None);
    }
    notes::add(&mut row.marks.note, &format!("{WARNING}{NO_ERROR}{why}"));
}

/// What the rows say of errors that are not stated: method, lattice parameter and reason, without doubles.
pub fn warnings(rows: &[Row]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for row in rows {
        let parts = notes::parts(row.marks.note.as_deref());
        let why = parts.filter_map(|part| part.strip_prefix(WARNING)?.strip_prefix(NO_ERROR));
        for why in why {
            let method = row.key.boundary.map_or("", BoundaryRule::name);
            let (structure, lp) = (row.key.structure.name(), row.key.lp_mm);
            let line = format!("{structure} {method} {lp} mm: {NO_ERROR}{why}");
            if !found.contains(&line) {
                found.push(line);
            }
        }
    }
    found
}

fn solver_error(row: &Row) -> f64 {
    row.stated_errors_mpa()[0].unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Solution;
    use crate::result::settings::Settings;

    fn row(boundary: Option<BoundaryRule>, e: f64) -> Row {
        Row {
            key: Settings {
                method: match boundary {
                    Some(_) => Method::Lattice,
                    None => Method::VoxelFe,
                },
                elements: boundary.is_none().then_some(Elements::Voxels),
                boundary,
                lp_mm: 0.1,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                algebraic_error_mpa: Some(0.1),
                converged: Some(true),
                ..Solution::default()
            }),
            ..Row::default()
        }
    }

    fn fault(floppy: f64, firm: f64, voxels: f64) -> Option<String> {
        let [floppy, firm] = [(BoundaryRule::Floppy, floppy), (BoundaryRule::Firm, firm)]
            .map(|(boundary, e)| row(Some(boundary), e));
        bracket_fault(&floppy, &firm, Some(&row(None, voxels)))
    }

    #[test]
    fn a_bracket_holds_the_witness_up_to_solver_errors() {
        for (floppy, firm, voxels, said) in [
            (10.0, 30.0, 20.0, None),
            (10.0, 30.0, 30.15, None),
            (10.0, 9.85, 9.9, None),
            (10.0, 9.7, 9.9, Some("firm (9.700 MPa) lies below floppy")),
            (10.0, 30.0, 30.3, Some("(30.300 MPa) lies outside")),
            (10.0, 30.0, 9.7, Some("(9.700 MPa) lies outside")),
        ] {
            let found = fault(floppy, firm, voxels);
            let as_said = match (&found, said) {
                (Some(found), Some(said)) => found.contains(said),
                (found, said) => found.is_none() && said.is_none(),
            };
            assert!(as_said, "{floppy} {firm} {voxels}: {found:?}");
        }
    }

    #[test]
    fn a_witness_is_one_element_a_voxel_under_the_same_conditions() {
        let floppy = row(Some(BoundaryRule::Floppy), 1.0);
        let with = |change: fn(&mut Row)| {
            let mut voxels = row(None, 1.0);
            change(&mut voxels);
            witness(&floppy, &[voxels]).is_some()
        };
        assert!(with(|_| ()));
        assert!(with(|r| (r.key.lp_mm, r.key.tolerance) = (0.02, Some(1e-6))));
        assert!(!with(|r| r.key.elements = Some(Elements::BlockMeans)));
        assert!(!with(|r| r.key.grip_mm = 0.6));
        assert!(!with(|r| r.key.scan = "another".to_owned()));
        assert!(!with(|r| r.solved.as_mut().unwrap().converged = Some(false)));
    }

    #[test]
    fn a_limit_that_is_contradicted_states_no_error() {
        let limit = |e: f64| {
            let mut limit = row(Some(BoundaryRule::Extrapolated), e);
            let solved = limit.solved.as_mut().unwrap();
            solved.discretization_error_mpa = Some(2.0);
            solved.shape_error_mpa = Some(1.0);
            limit
        };
        let known = [row(None, 50.0)];
        let mut rows = [limit(53.1), limit(46.7), known[0].clone()];
        check_limits(&mut rows, &known);
        // 2 + 1 + 0.1 are stated, and 0.1 of the witness.
        assert_eq!(rows[0], limit(53.1));
        assert_eq!(rows[1].error_mpa(), None);
        assert_eq!(rows[1].e_app_mpa(), Some(46.7));
        let said = warnings(&rows);
        assert!(
            said.len() == 1 && said[0].starts_with("sc extrapolated 0.1 mm: no error is stated"),
            "{said:?}"
        );
        let once = rows.clone();
        check_limits(&mut rows, &known);
        assert_eq!(rows, once);
    }
}
