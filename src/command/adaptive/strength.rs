//! Owns `solve --error` of tissue that yields: two load steps and two element sizes, then finer ones, until the stated error of the strength
//! meets its target.
//!
//! Load steps are compared on one element a voxel, where they are cheap. Elements are voxels, whole and split: one body.

use crate::command::estimate::FreeMemory;
use crate::command::ladder::split_voxels;
use crate::command::solve::OpenScan;
use crate::error::Result;
use crate::machine::session::Session;
use crate::pipeline::apparent::{LoadSteps, SolveParams, of_voxels};
use crate::pipeline::lattice::LatticeParams;
use crate::result::notes;
use crate::result::row::Row;
use crate::result::strength_error::{HOLDS, of_steps, stated};

/// Share of the target that is left to the load steps.
const STEPS_SHARE: f64 = 0.25;

/// Lengths of load steps are halved so many times at most.
const HALVINGS: u32 = 4;

/// Elements a voxel along each axis, after one.
const SPLIT: [usize; 2] = [2, 3];

/// All that is solved until the stated error of the strength is below `target`.
///
/// # Errors
/// As [`crate::command::solve::solve`].
pub fn rows(
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

struct Climb<'a> {
    scan: &'a mut OpenScan,
    target: f64,
    params: &'a SolveParams,
    session: &'a Session,
    rows: Vec<Row>,
}

impl Climb<'_> {
    fn climb(&mut self) -> Result<()> {
        let mut steps = self.params.steps;
        self.step(1, steps)?;
        if self.is_disconnected() {
            return Ok(());
        }
        self.step(1, steps.halved())?;
        for _ in 1..HALVINGS {
            if !self.steps_leave_open(steps) {
                break;
            }
            steps = steps.halved();
            self.step(1, steps.halved())?;
        }
        for split in SPLIT {
            if let Err(refused) = self.fits(split) {
                let words = format!("finer elements do not fit: {refused}");
                self.session.warn(words);
                break;
            }
            self.step(split, steps)?;
            if !self.session.dry_run && super::meets(&self.rows, self.target) {
                break;
            }
        }
        Ok(())
    }

    fn params(&self, split: usize, steps: LoadSteps) -> SolveParams {
        SolveParams {
            steps,
            ..split_voxels(self.params, split)
        }
    }

    /// Solves, and states the errors that the rows so far say together.
    fn step(&mut self, split: usize, steps: LoadSteps) -> Result<()> {
        let params = self.params(split, steps);
        let rows = self
            .scan
            .solve(&LatticeParams::default(), &params, self.session)?;
        self.rows
            .extend(rows.into_iter().filter(|row| !row.key.is_derived()));
        let known = self.rows.clone();
        let put = |row: &mut Row| {
            let is_known = known.iter().any(|own| own.key == row.key);
            let Some(strength) = stated(row, &known).filter(|_| is_known) else {
                return;
            };
            if let Some(solved) = &mut row.solved {
                solved.strength = strength;
            }
            notes::add(&mut row.marks.note, HOLDS);
        };
        self.rows.iter_mut().for_each(put);
        if self.session.dry_run {
            return Ok(());
        }
        self.scan.results().edit_rows(put)
    }

    fn steps_leave_open(&self, steps: LoadSteps) -> bool {
        of_steps(&self.rows, steps).is_some_and(|open| open > STEPS_SHARE * self.target)
    }

    fn is_disconnected(&self) -> bool {
        !self.rows.is_empty() && self.rows.iter().all(Row::is_disconnected)
    }

    fn fits(&self, split: usize) -> Result<()> {
        let params = self.params(split, self.params.steps);
        of_voxels().fits(self.scan.prepared(), &params, &FreeMemory::now())
    }
}
