//! Owns `solve --error`: models from cheap to dear until the stated error meets its target.
//!
//! One element a voxel first. Then, of a grey scan, finer elements of interpolated grey values, with what the step and a
//! smoother image say of the shape. The best answer so far is kept. Lattices and coarser elements are not tried: a body whose
//! cracks they bridge looks converged.

use crate::command::estimate;
use crate::command::ladder::{COARSENED, REFINED, smoothed_again, voxel_fe};
use crate::command::solve::{in_words, loaded, solve};
use crate::error::Result;
use crate::machine::session::Session;
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::SolveParams;
use crate::pipeline::apparent::resolution::image;
use crate::pipeline::lattice::LatticeParams;
use crate::record::error_target_note::Missed;
use crate::record::results::Results;
use crate::result::row::Row;
use crate::result::shape::{Image, Learnt, of_interpolated, state, surface};
use crate::volume::Specimen;
use std::path::Path;

/// What came of it.
pub struct Found {
    /// The rows of all that was tried.
    pub rows: Vec<Row>,
    /// Whether one of them met the target.
    pub met: bool,
}

/// Solves the specimen in `dir` until the stated error is below `target` (0.03 is 3 %), and says which row it is. What was
/// tried stands in the results.
///
/// # Errors
/// As [`solve`].
pub fn solve_to(dir: &Path, target: f64, params: &SolveParams, session: &Session) -> Result<Found> {
    if !session.dry_run {
        // Of an earlier target.
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
    let params = SolveParams {
        // A tenth of the whole error is left to the solver.
        tolerance: params.tolerance.min(0.1 * target),
        ..params.clone()
    };
    let specimen = loaded(dir, &smoothed_again(&params))?;
    let rows = climb(dir, &specimen, target, &params, session)?;
    finish(dir, rows, target, session)
}

fn climb(
    dir: &Path,
    specimen: &Specimen,
    target: f64,
    params: &SolveParams,
    session: &Session,
) -> Result<Vec<Row>> {
    let step = |params: &SolveParams| solve(dir, &LatticeParams::default(), params, session);
    let fits = |p: &SolveParams| estimate::refuse_what_does_not_fit(specimen, None, p);
    let native = voxel_fe(params, 1, 1);
    if let Err(refused) = fits(&native) {
        for coarse in COARSENED.map(|n| voxel_fe(params, n, 1)) {
            if fits(&coarse).is_ok() {
                session.warn(format!("one element a voxel does not fit: {refused}"));
                return step(&coarse);
            }
        }
        return Err(refused);
    }
    let mut rows = step(&native)?;
    let Image::Grey { blur_voxels } = image(specimen) else {
        return Ok(rows);
    };
    let broken = |rows: &[Row]| rows.iter().all(Row::is_disconnected);
    let done = |rows: &[Row]| !session.dry_run && (meets(rows, target) || broken(rows));
    if done(&rows) || params.material.is_some() {
        return Ok(rows);
    }
    let again = step(&smoothed_again(params))?;
    for refined in REFINED.map(|n| voxel_fe(params, 1, n)) {
        if let Err(refused) = fits(&refined) {
            session.warn(format!("finer elements do not fit: {refused}"));
            break;
        }
        let mut fine = step(&refined)?;
        if let Some(learnt) = learnt(specimen, rows.first(), again.first(), fine.first()) {
            let stated = Some(of_interpolated(blur_voxels, &learnt));
            fine.iter_mut().for_each(|row| state(row, stated));
            let keys: Vec<_> = fine.iter().map(|row| row.key.clone()).collect();
            Results::open(dir, false)?.renote(|row| {
                if keys.contains(&row.key) {
                    state(row, stated);
                }
            })?;
        }
        rows.extend(fine);
        if done(&rows) {
            break;
        }
    }
    rows.extend(again);
    Ok(rows)
}

/// What one element a voxel, the smoother image and finer elements say together.
fn learnt(
    specimen: &Specimen,
    native: Option<&Row>,
    again: Option<&Row>,
    fine: Option<&Row>,
) -> Option<Learnt> {
    let one = native?.e_app_mpa()?;
    let change = |row: Option<&Row>| Some((row?.e_app_mpa()? / one - 1.0).abs());
    let sensitivity = native?.solved.as_ref()?.threshold_sensitivity;
    let voxel_mm = specimen.bone.grid.voxel_mm3().cbrt();
    let thickness = plate_thickness_mm(&specimen.bone)? / voxel_mm;
    Some(Learnt {
        surface: surface(sensitivity, thickness),
        again: change(again)?,
        refined: change(fine)?,
    })
}

fn best(rows: &[Row]) -> Option<(&Row, f64)> {
    let stated = rows.iter().filter_map(|row| Some((row, row.error()?)));
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
        let missed = Missed::of(
            nearest.map(|(row, _)| row).or(rows.last()),
            said(target, nearest),
        );
        rows.iter_mut().for_each(|row| missed.note(row));
        Results::open(dir, false)?.renote(|row| missed.note(row))?;
    }
    Ok(Found { rows, met })
}
