//! Owns `solve --error`: resolutions tried from cheap to dear until the stated error meets its target.
//!
//! First three connected lattices (LP from the strut thickness to half of it), then pairs of voxel-FE solves whose elements
//! differ by a factor of two, beginning at the coarsest pair that can be expected to suffice.

use crate::command::ladder::{PAIRS, element_mm, suffices, voxel_fe};
use crate::command::solve::{OpenScan, in_words};
use crate::error::Result;
use crate::machine::session::Session;
use crate::pipeline::apparent::{Method, SolveParams};
use crate::pipeline::lattice::{BoundaryWord, LatticeParams, Structure};
use crate::record::error_target_note::ErrorTargetNote;
use crate::result::extrapolate::{is_extrapolated, with_extrapolated};
use crate::result::row::Row;
use std::path::Path;

/// Lattice parameters tried, in strut thicknesses.
const LP_OVER_THICKNESS: [f64; 3] = [1.0, 0.75, 0.5];

/// Elements that a voxel-FE solve may have at most: some 8 GiB.
const MOST_ELEMENTS: f64 = 2.5e7;

/// The outcome of `solve --error`.
pub struct Found {
    /// The rows of all that was tried.
    pub rows: Vec<Row>,
    /// Whether one of them met the target.
    pub met: bool,
}

/// Solves the specimen in `dir` until the algebraic and the discretisation error together are below `target` (0.03 is
/// 3 %), and says which row it is. What was tried stands in the results.
///
/// # Errors
/// As [`solve`].
pub fn solve_to(dir: &Path, target: f64, params: &SolveParams, session: &Session) -> Result<Found> {
    let mut scan = OpenScan::open(dir, params, false, session)?;
    if !session.dry_run {
        // Notes of an earlier target.
        scan.results().edit_rows(ErrorTargetNote::remove_note)?;
        if session.force {
            scan.results().clear()?;
        }
    }
    let mut rows = Vec::new();
    let params = SolveParams {
        // A tenth of the whole error is left to the solver.
        tolerance: params.tolerance.min(0.1 * target),
        ..params.clone()
    };
    let Some(thickness) = scan.plate_thickness_mm() else {
        // A block of bone without a surface: one element a voxel is exact.
        let whole = voxel_fe(&params, 1, 1);
        rows = scan.solve(&LatticeParams::default(), &whole, session)?;
        return Ok(Found { rows, met: true });
    };
    let shortest = scan
        .bone()
        .grid
        .size_mm()
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let lattices = LatticeParams {
        structure: vec![Structure::Sc],
        lp_mm: LP_OVER_THICKNESS
            .map(|f| (1e4 * f * thickness.min(0.1 * shortest)).round() / 1e4)
            .to_vec(),
        boundary: vec![BoundaryWord::Connected],
        ..LatticeParams::default()
    };
    if lattices.lp_mm.iter().all(|lp| *lp > 0.0) {
        let lattice = SolveParams {
            method: Method::Lattice,
            ..params.clone()
        };
        rows.extend(scan.solve(&lattices, &lattice, session)?);
        if !session.dry_run && (meets(&rows, target) || rows.iter().all(Row::is_disconnected)) {
            return finish(&mut scan, rows, target, session);
        }
    }
    let elements = scan.bone().as_slice().iter().filter(|b| **b != 0).count() as f64;
    let expected = PAIRS.map(|pair| suffices(scan.bone(), pair, thickness, target));
    let any = expected.contains(&true);
    for ((coarsen, refine), suffices) in PAIRS.into_iter().zip(expected) {
        let element = element_mm(scan.bone(), (coarsen, refine));
        // Where none can be expected to suffice, one element a voxel says how far one gets.
        if !suffices && (any || (coarsen, refine) != (1, 1)) {
            continue;
        }
        if elements * (refine as f64).powi(3) > MOST_ELEMENTS {
            session.warn(format!(
                "elements of {element:.4} mm would be {:.0} million, too many: the specimen must be cropped for a smaller error",
                elements * (refine as f64).powi(3) / 1e6
            ));
            break;
        }
        let twice = if refine > 1 {
            (1, refine / 2)
        } else {
            (2 * coarsen, 1)
        };
        let none = LatticeParams::default();
        let pair = [twice, (coarsen, refine)];
        let mut own = Vec::new();
        for (coarsen, refine) in pair {
            let elements = voxel_fe(&params, coarsen, refine);
            own.extend(scan.solve(&none, &elements, session)?);
        }
        // Neighbouring pairs share a size.
        let new = with_extrapolated(&own);
        rows.extend(
            new.into_iter()
                .filter(|row| !rows.contains(row))
                .collect::<Vec<_>>(),
        );
        if meets(&rows, target) {
            break;
        }
    }
    finish(&mut scan, rows, target, session)
}

/// Algebraic and discretisation error of a row together, relative; None where either is not stated.
fn stated(row: &Row) -> Option<f64> {
    let [algebraic, discretization] = row.stated_errors_mpa();
    let error = algebraic? + discretization?;
    let limit = is_extrapolated(row) || row.key.boundary.is_none();
    row.e_app_mpa()
        .filter(|e| *e > 0.0 && limit)
        .map(|e| error / e)
}

fn best(rows: &[Row]) -> Option<(&Row, f64)> {
    let stated = rows.iter().filter_map(|row| Some((row, stated(row)?)));
    stated.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Whether the stated error of one of the rows is at most `target`.
pub fn meets(rows: &[Row], target: f64) -> bool {
    best(rows).is_some_and(|(_, error)| error <= target)
}

fn said(target: f64, best: Option<(&Row, f64)>) -> String {
    let least = best.map_or("no error could be stated".to_owned(), |(_, error)| {
        format!("the least stated is {}", percent(error))
    });
    format!("{}, is not met: {least}", percent(target))
}

fn percent(x: f64) -> String {
    format!("{:.2} %", 100.0 * x)
}

/// Reports the outcome. Where the target is missed, the rows get a note, here and in the results.
fn finish(
    scan: &mut OpenScan,
    mut rows: Vec<Row>,
    target: f64,
    session: &Session,
) -> Result<Found> {
    if session.dry_run || rows.iter().all(Row::is_disconnected) {
        return Ok(Found { rows, met: true });
    }
    let met = meets(&rows, target);
    match best(&rows) {
        Some((row, error)) if met => session.say(format!(
            "error {} of {} asked for: {}",
            percent(error),
            percent(target),
            in_words(row)
        )),
        Some((row, error)) => session.warn(format!(
            "the error asked for, {}, could not be met: the least that can be stated is {} ({})",
            percent(target),
            percent(error),
            in_words(row)
        )),
        None => session.warn("no error could be stated: no solve converged"),
    }
    if !met {
        let nearest = best(&rows);
        let note = ErrorTargetNote::of(
            nearest.map(|(row, _)| row).or(rows.last()),
            said(target, nearest),
        );
        rows.iter_mut().for_each(|row| note.add_to(row));
        scan.results().edit_rows(|row| note.add_to(row))?;
    }
    Ok(Found { rows, met })
}
