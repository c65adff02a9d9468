//! Owns `solve --error`: models from cheap to dear until the stated error meets its target.
//!
//! One element a voxel first. Then, of a grey scan, finer elements of interpolated grey values, with what the step and a
//! smoother image say of the shape. The best answer so far is kept. Lattices and coarser elements are not tried: a body whose
//! cracks they bridge looks converged.

mod strength;

use crate::command::answer;
use crate::command::estimate::FreeMemory;
use crate::command::in_words::{answer_in_words, in_words};
use crate::command::ladder::{
    COARSENED, ONE_REFINEMENT, REFINED, smoothed_again, split_voxels, voxel_fe,
};
use crate::command::solve::OpenScan;
use crate::error::Result;
use crate::machine::session::Session;
use crate::pipeline::apparent::{SolveParams, of_voxels};
use crate::pipeline::lattice::LatticeParams;
use crate::record::error_target_note::ErrorTargetNote;
use crate::result::answer::{ScanFacts, line};
use crate::result::row::Row;
use crate::result::shape::{self, Image, Learnt, Stated};
use std::path::Path;

/// The outcome of `solve --error`.
pub struct Found {
    /// The rows of all that was tried.
    pub rows: Vec<Row>,
    /// Whether one of them met the target.
    pub met: bool,
}

/// Solves the specimen in `dir` until the stated error is below `target` (0.03 is 3 %), and says which row it is. All that was
/// tried stands in the results.
///
/// # Errors
/// As [`crate::command::solve::solve`].
pub fn solve_to(dir: &Path, target: f64, params: &SolveParams, session: &Session) -> Result<Found> {
    let mut scan = OpenScan::open(dir, &widest(params), session.force, session)?;
    solve_open_to(&mut scan, target, params, session)
}

/// Settings of the solve that needs the most of a scan, of all that a target may take: those to open it with.
pub fn widest(params: &SolveParams) -> SolveParams {
    match params.plasticity {
        Some(_) => split_voxels(params, 1),
        None => smoothed_again(params),
    }
}

/// [`solve_to`] of a scan that was opened with the settings of [`widest`].
///
/// # Errors
/// As [`crate::command::solve::solve`].
pub fn solve_open_to(
    scan: &mut OpenScan,
    target: f64,
    params: &SolveParams,
    session: &Session,
) -> Result<Found> {
    let params = SolveParams {
        // A tenth of the whole error is left to the solver.
        tolerance: params.tolerance.min(0.1 * target),
        ..params.clone()
    };
    if !session.dry_run {
        // Notes of an earlier target.
        scan.results().edit_rows(ErrorTargetNote::remove_note)?;
    }
    let rows = match params.plasticity {
        Some(_) => strength::rows(scan, target, &params, session)?,
        None => rows(scan, target, &params, session)?,
    };
    finish(scan, rows, target, session)
}

/// All that is solved until the error of the modulus meets its target.
fn rows(
    scan: &mut OpenScan,
    target: f64,
    params: &SolveParams,
    session: &Session,
) -> Result<Vec<Row>> {
    let mut climb = Climb {
        scan,
        target,
        params,
        session,
        rows: Vec::new(),
    };
    climb.climb()?;
    Ok(climb.rows)
}

/// One specimen on its way to a target.
struct Climb<'a> {
    scan: &'a mut OpenScan,
    target: f64,
    params: &'a SolveParams,
    session: &'a Session,
    /// All that was solved so far.
    rows: Vec<Row>,
}

impl Climb<'_> {
    fn climb(&mut self) -> Result<()> {
        let native = voxel_fe(self.params, 1, 1);
        if let Err(refused) = self.fits(&native) {
            for coarse in COARSENED.map(|n| voxel_fe(self.params, n, 1)) {
                if self.fits(&coarse).is_ok() {
                    let words = format!("one element a voxel does not fit: {refused}");
                    self.session.warn(words);
                    self.step(&coarse)?;
                    return Ok(());
                }
            }
            return Err(refused);
        }
        let one = self.step(&native)?;
        match self.scan.image() {
            Image::Grey { blur_voxels } if !self.is_done() && self.params.material.is_none() => {
                self.refine(one.as_ref(), blur_voxels)
            }
            _ => Ok(()),
        }
    }

    /// Finer elements of interpolated grey values, after `one` element a voxel.
    fn refine(&mut self, one: Option<&Row>, blur_voxels: f64) -> Result<()> {
        let again = self.step(&smoothed_again(self.params))?;
        for refined in REFINED.map(|n| voxel_fe(self.params, 1, n)) {
            if let Err(refused) = self.fits(&refined) {
                let words = format!("finer elements do not fit: {refused}");
                self.session.warn(words);
                break;
            }
            let fine = self.step(&refined)?;
            let stated = self
                .learnt(one, again.as_ref(), fine.as_ref())
                .map(|learnt| shape::of_interpolated(blur_voxels, &learnt));
            if let Some((fine, stated)) = fine.zip(stated) {
                self.state(&fine, stated)?;
                self.contradict(one, &fine, stated)?;
            }
            let left_open = stated.map_or(0.0, |stated| stated.shape);
            if self.is_done() || (self.target >= ONE_REFINEMENT && left_open > self.target) {
                break;
            }
        }
        Ok(())
    }

    /// Solves, keeps the row and the best answer so far, and returns the row.
    fn step(&mut self, params: &SolveParams) -> Result<Option<Row>> {
        let rows = self
            .scan
            .solve(&LatticeParams::default(), params, self.session)?;
        let own = rows.iter().find(|row| !row.key.is_derived()).cloned();
        self.rows.extend(rows);
        self.answer()?;
        Ok(own)
    }

    /// Puts the stated errors into the rows with the settings of `row`, here and in the results.
    fn state(&mut self, row: &Row, stated: Stated) -> Result<()> {
        let put = |other: &mut Row| {
            if other.key == row.key {
                shape::state(other, Some(stated));
            }
        };
        self.rows.iter_mut().for_each(put);
        self.scan.results().edit_rows(put)?;
        let now = self.rows.iter().find(|other| other.key == row.key);
        if let Some(now) = now.filter(|now| now.error_mpa() != row.error_mpa()) {
            self.session.result(format!(
                "{}  [all solves so far together: this error replaces the one above]",
                in_words(now)
            ));
        }
        self.answer()
    }

    /// Where finer elements lie outside the stated error of `one` element a voxel, that error becomes the difference and the
    /// finer elements' error together: cracks that voxels bridge look like stiff bone.
    fn contradict(&mut self, one: Option<&Row>, fine: &Row, of_fine: Stated) -> Result<()> {
        let Some((one, moduli)) = one.zip(one.and_then(Row::e_app_mpa).zip(fine.e_app_mpa()))
        else {
            return Ok(());
        };
        match shape::contradicted(one.error(), moduli, of_fine) {
            Some(stated) => self.state(one, stated),
            None => Ok(()),
        }
    }

    fn answer(&self) -> Result<()> {
        if let Some(dir) = self.scan.dir().filter(|_| !self.session.dry_run) {
            answer::keep(dir, &self.rows, Some(self.target))?;
        }
        Ok(())
    }

    fn fits(&self, params: &SolveParams) -> Result<()> {
        of_voxels().fits(self.scan.prepared(), params, &FreeMemory::now())
    }

    fn is_done(&self) -> bool {
        let broken = self.rows.iter().all(Row::is_disconnected);
        !self.session.dry_run && (broken || meets(&self.rows, self.target))
    }

    /// What one element a voxel, the smoother image and finer elements say together.
    fn learnt(&self, one: Option<&Row>, again: Option<&Row>, fine: Option<&Row>) -> Option<Learnt> {
        let e_app_mpa = one?.e_app_mpa()?;
        let change = |row: Option<&Row>| Some((row?.e_app_mpa()? / e_app_mpa - 1.0).abs());
        Some(Learnt {
            surface: self
                .scan
                .surface(one?.solved.as_ref()?.surface_energy_ratio),
            again: change(again)?,
            refined: change(fine)?,
        })
    }
}

fn best(rows: &[Row]) -> Option<(&Row, f64)> {
    let converged = rows.iter().filter(|row| row.converged() == Some(true));
    let stated = converged.filter_map(|row| Some((row, row.answered_error()?)));
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
            answer_in_words(&line(row, &ScanFacts::default()))
        )),
        None => {
            session.warn("no error could be stated: no solve converged, or the rows' notes say why")
        }
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
