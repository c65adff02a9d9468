//! Owns `solve --error`: resolutions tried from cheap to dear until the stated error meets its target.
//!
//! First three graded lattices (LP from the strut thickness to half of it), then pairs of voxel-FE solves whose elements
//! differ by a factor of two, beginning at the coarsest pair that can be expected to suffice.

use crate::command::in_words::in_words;
use crate::command::ladder::{PAIRS, element_mm, suffices, voxel_fe};
use crate::command::segment::load;
use crate::command::solve::solve;
use crate::error::Result;
use crate::machine::session::Session;
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::{Method, SolveParams};
use crate::pipeline::lattice::{Boundary, LatticeParams, Structure};
use crate::record::error_target_note::Missed;
use crate::record::results::Results;
use crate::result::extrapolate::{is_extrapolated, with_extrapolated};
use crate::result::row::Row;
use std::path::Path;

/// Lattice parameters tried, in strut thicknesses.
const LP_OVER_THICKNESS: [f64; 3] = [1.0, 0.75, 0.5];

/// Elements that a voxel-FE solve may have at most: some 8 GiB.
const MOST_ELEMENTS: f64 = 2.5e7;

/// What came of it.
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
    let specimen = load(dir)?;
    if !session.dry_run {
        // Of an earlier error asked for.
        Results::open(dir, false)?.renote(Missed::take_back)?;
    }
    if session.force && !session.dry_run {
        Results::begin_anew(dir)?;
    }
    // Dropped once: redone at every step, each would drop what the one before it solved.
    let session = &Session {
        force: false,
        ..session.clone()
    };
    let mut rows = Vec::new();
    let params = SolveParams {
        // A tenth of the whole error is left to the solver.
        tolerance: params.tolerance.min(0.1 * target),
        ..params.clone()
    };
    let bone = &specimen.bone;
    let Some(thickness) = plate_thickness_mm(bone) else {
        // A block of bone without a surface: one element a voxel is exact.
        rows = solve(
            dir,
            &LatticeParams::default(),
            &voxel_fe(&params, 1, 1),
            session,
        )?;
        return Ok(Found { rows, met: true });
    };
    let shortest = bone
        .grid
        .size_mm()
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    let lattices = LatticeParams {
        structure: vec![Structure::Sc],
        lp_mm: LP_OVER_THICKNESS
            .map(|f| (1e4 * f * thickness.min(0.1 * shortest)).round() / 1e4)
            .to_vec(),
        boundary: vec![Boundary::Graded],
        ..LatticeParams::default()
    };
    if lattices.lp_mm.iter().all(|lp| *lp > 0.0) {
        let lattice = SolveParams {
            method: Method::Lattice,
            ..params.clone()
        };
        rows.extend(solve(dir, &lattices, &lattice, session)?);
        if !session.dry_run && (meets(&rows, target) || rows.iter().all(Row::is_disconnected)) {
            return finish(dir, rows, target, session);
        }
    }
    let elements = bone.as_slice().iter().filter(|b| **b != 0).count() as f64;
    let suffices = |pair| suffices(bone, pair, thickness, target);
    let any = PAIRS.into_iter().any(suffices);
    for (coarsen, refine) in PAIRS {
        let element = element_mm(bone, (coarsen, refine));
        // Where none can be expected to suffice, one element a voxel says how far one gets.
        if !suffices((coarsen, refine)) && (any || (coarsen, refine) != (1, 1)) {
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
            own.extend(solve(
                dir,
                &none,
                &voxel_fe(&params, coarsen, refine),
                session,
            )?);
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
    finish(dir, rows, target, session)
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

/// Says what came of it; where the target is missed, so do the rows, here and in the results.
fn finish(dir: &Path, mut rows: Vec<Row>, target: f64, session: &Session) -> Result<Found> {
    if session.dry_run || rows.iter().all(Row::is_disconnected) {
        return Ok(Found { rows, met: true });
    }
    let met = meets(&rows, target);
    match best(&rows) {
        Some((row, error)) if met => session.result(format!(
            "error {} of {} asked for: {}",
            percent(error),
            percent(target),
            in_words(row)
        )),
        Some((row, error)) => session.warn(format!(
            "cannot reach the error asked for, {}: the best is {} ({})",
            percent(target),
            percent(error),
            in_words(row)
        )),
        None => session.warn("no error could be stated: no solve converged"),
    }
    if !met {
        let nearest = best(&rows);
        let missed = Missed::of(
            nearest.map(|(row, _)| row).or(rows.last()),
            said(target, nearest),
        );
        rows.iter_mut().for_each(|row| missed.note(row));
        Results::open(dir, false)?.renote(|row| missed.note(row))?;
    }
    Ok(Found { rows, met })
}
