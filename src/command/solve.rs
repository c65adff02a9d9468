//! Owns `solve` on disk: every lattice of a segmented scan, `results.csv` and `results.json` written after each.

use crate::command::fields::Fields;
use crate::command::in_words::in_words;
use crate::command::lattice::binned;
use crate::command::segment::load;
use crate::command::{estimate, stiffness};
use crate::error::Result;
use crate::export::inp;
use crate::io::atomic;
use crate::machine::meter::Meter;
use crate::machine::session::Session;
use crate::measure::morphometry::Morphometry;
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::fields::Recorded;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::{Load, Method, SolveParams, lattice, voxel_fe};
use crate::pipeline::lattice::{Boundary, Case, LatticeParams};
use crate::record::results::Results;
use crate::record::specimen;
use crate::result::cautions;
use crate::result::extrapolate::{is_extrapolated, voxel_fe_error, with_extrapolated};
use crate::result::ffb::with_ffb;
use crate::result::row::{FailureLoad, Marks, Row};
use crate::result::settings::{CellType, Settings};
use crate::solver::cg::CgStep;
use crate::volume::Specimen;
use indicatif::ProgressBar;
use std::path::Path;

/// Solves every structure × lattice parameter × boundary for the specimen in `dir`. Rows already there for the same
/// mask and settings are kept unless the session forces.
///
/// # Errors
/// A folder that is not a segmented scan, settings that do not fit it, an unwritable folder. Not converging is no error:
/// the row says so.
pub fn solve(
    dir: &Path,
    lattices: &LatticeParams,
    params: &SolveParams,
    session: &Session,
) -> Result<Vec<Row>> {
    lattices.check()?;
    params.check()?;
    if !session.dry_run {
        atomic::sweep(dir);
    }
    let reading = session.bar(1, "reading the mask");
    let specimen = loaded(dir, params)?;
    let tissue = Tissue::of(&specimen, params)?;
    let settings = tissue.label(params.key(&specimen), params);
    drop(tissue);
    let height_mm = specimen.length_mm(params.axis);
    warn_of_unusual(&settings, height_mm, session);
    if params.method == Method::Lattice {
        warn_of_coarse(dir, lattices, session);
    }
    let mean_thickness_mm = plate_thickness_mm(&specimen.bone);
    reading.finish_and_clear();
    let morphometry = specimen::record(dir).and_then(|record| record.results.morphometry);
    let mut results = Results::open(dir, session.force)?;
    let mut rows = Vec::new();
    for job in jobs(lattices, params) {
        let blank = Row {
            key: job.label(&specimen, params, settings.clone()),
            solved: None,
            marks: Marks {
                mean_thickness_mm,
                ..Marks::default()
            },
        };
        let kept = results.find(&blank, params);
        let kept = kept
            .filter(|_| !job.is_stiffness(params) || stiffness::is_there(dir, params))
            // Fields are written over by the next solve: whether those there are these is not known.
            .filter(|_| params.fields.is_empty());
        let is_kept = kept.is_some();
        let (mut row, fields) = match kept {
            Some(row) => (row, Fields::None),
            None if session.dry_run => {
                estimate::refuse_what_does_not_fit(&specimen, job.case(), params)?;
                let mib = estimate::of_solve_mib(&specimen, job.case(), params)?;
                session.say(format!(
                    "would solve {} {} mm, about {mib:.0} MiB",
                    job.name(),
                    blank.key.lp_mm
                ));
                continue;
            }
            None => {
                estimate::refuse_what_does_not_fit(&specimen, job.case(), params)?;
                solve_job(dir, &specimen, &job, &blank, params, session)?
            }
        };
        mark(&mut row, morphometry.as_ref());
        cautions::mark(&mut row, height_mm);
        session.result(format!("{}{}", in_words(&row), said_of_kept(is_kept)));
        // The row first: fields that cannot be written do not cost it.
        results.keep(&blank, params, &row)?;
        fields.write(dir)?;
        rows.push(row);
    }
    let all = with_extrapolated(&with_ffb(&rows));
    for row in all.iter().filter(|row| is_extrapolated(row)) {
        session.result(in_words(row));
    }
    Ok(all)
}

fn said_of_kept(is_kept: bool) -> &'static str {
    match is_kept {
        true => "  [solved before with the same settings: kept]",
        false => "",
    }
}

/// What is unusual of all rows of a solve alike.
fn warn_of_unusual(settings: &Settings, height_mm: f64, session: &Session) {
    let row = Row {
        key: settings.clone(),
        ..Row::default()
    };
    for caution in cautions::cautions(&row, height_mm) {
        session.warn(caution);
    }
}

/// With grey values where the material asks for them.
fn loaded(dir: &Path, params: &SolveParams) -> Result<Specimen> {
    let mut specimen = load(dir)?;
    if params.material.is_some() {
        specimen.grey = specimen::load_grey(dir, &specimen.bone)?;
    }
    Ok(specimen)
}

/// Writes the voxel elements of the specimen in `dir`, with materials (at most `bins` moduli), supports and load, to
/// `dir/voxel-fe.inp`.
///
/// # Errors
/// A method or load without such a model, an unwritable file.
pub fn export_inp(dir: &Path, params: &SolveParams, bins: usize, session: &Session) -> Result<()> {
    params.check()?;
    let path = dir.join("voxel-fe.inp");
    if session.dry_run {
        session.say(format!("would write {}", path.display()));
        return Ok(());
    }
    let worst = inp::write(&path, &loaded(dir, params)?, params, bins)?;
    session.say(binned(&path, worst));
    Ok(())
}

/// Struts thinner than two lattice parameters are one or two sites thick, which graded lattices make up for.
fn warn_of_coarse(dir: &Path, lattice: &LatticeParams, session: &Session) {
    if lattice.boundary.iter().all(|b| *b == Boundary::Graded) {
        return;
    }
    let thickness = specimen::record(dir).and_then(|record| record.results.mean_thickness_mm);
    let Some(thickness) = thickness else { return };
    let coarse = lattice.lp_mm.iter().filter(|lp| **lp > 0.5 * thickness);
    let coarse: Vec<String> = coarse.map(f64::to_string).collect();
    if !coarse.is_empty() {
        session.warn(format!(
            "lattice parameters {} mm exceed half the mean strut thickness ({thickness:.3} mm): E_app is far from converged there",
            coarse.join(", ")
        ));
    }
}

/// Puts the specimen's morphometry beside its modulus.
fn mark(row: &mut Row, measured: Option<&Morphometry>) {
    let marks = &mut row.marks;
    marks.tb_th_mm = measured.and_then(|m| Some(m.tb_th.as_ref()?.mean_mm));
    marks.tb_sp_mm = measured.and_then(|m| Some(m.tb_sp.as_ref()?.mean_mm));
    marks.conn_d_per_mm3 = measured.map(|m| m.conn_d_per_mm3);
    marks.da = measured.and_then(|m| Some(m.fabric.as_ref()?.da));
}

/// One row to solve.
enum Job {
    Lattice(Case),
    VoxelFe,
}

fn jobs(lattices: &LatticeParams, params: &SolveParams) -> Vec<Job> {
    match params.method {
        Method::Lattice => lattices.cases().into_iter().map(Job::Lattice).collect(),
        Method::VoxelFe => vec![Job::VoxelFe],
    }
}

impl Job {
    /// The columns that tell what was solved.
    fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        match self {
            Job::Lattice(case) => lattice::label(key, case),
            Job::VoxelFe => voxel_fe::label(key, specimen, params),
        }
    }

    fn case(&self) -> Option<&Case> {
        match self {
            Job::Lattice(case) => Some(case),
            Job::VoxelFe => None,
        }
    }

    fn is_stiffness(&self, params: &SolveParams) -> bool {
        matches!(self, Job::VoxelFe) && params.load == Load::Stiffness
    }

    fn name(&self) -> String {
        match self {
            Job::Lattice(case) => format!("{} {}", case.structure.name(), case.boundary.name()),
            Job::VoxelFe => CellType::Hex8.name().to_owned(),
        }
    }
}

/// The row with what its solve took.
fn metered(mut row: Row, meter: &Meter) -> Row {
    if let Some(solved) = &mut row.solved {
        solved.wall_s = Some(meter.wall_s());
        solved.peak_mib = meter.peak_mib();
    }
    row
}

fn solve_job(
    dir: &Path,
    specimen: &Specimen,
    job: &Job,
    blank: &Row,
    params: &SolveParams,
    session: &Session,
) -> Result<(Row, Fields)> {
    let meter = Meter::start();
    let bar = session.bar(1000, &format!("{} {} mm", job.name(), blank.key.lp_mm));
    if job.is_stiffness(params) {
        let observe = |load: usize, step| show_load(&bar, load, step, params.tolerance);
        let row = stiffness::solve(dir, specimen, params, blank, session, observe)?;
        bar.finish_and_clear();
        return Ok((metered(row, &meter), Fields::None));
    }
    let observe = |step| show(&bar, step, params.tolerance);
    let (solved, recorded, sites) = match job {
        Job::Lattice(case) => {
            let (solved, sites) = lattice::solve_recorded(specimen, case, params, observe)?;
            let named = sites.map(|sites| (case.stem(), sites));
            (solved, Recorded::default(), named)
        }
        Job::VoxelFe => {
            let (solved, recorded) = voxel_fe::solve_recorded(specimen, params, observe)?;
            (solved, recorded, None)
        }
    };
    bar.finish_and_clear();
    let mut row = solved.row(blank.clone());
    let discretization_error_mpa = voxel_fe_error(&row);
    if let Some(solved) = &mut row.solved {
        solved.discretization_error_mpa = discretization_error_mpa;
        solved.failure = recorded.failure.map(|f| FailureLoad {
            load_n: f.load_n,
            factor: f.factor,
        });
    }
    let fields = match sites {
        Some((stem, sites)) => Fields::OfSites(stem, sites),
        None => Fields::OfVoxels(recorded),
    };
    Ok((metered(row, &meter), fields))
}

/// Progress is the share of the error's decades already gained.
fn show(bar: &ProgressBar, step: CgStep, tolerance: f64) {
    if let Some(error) = step.energy_error.filter(|e| *e > 0.0) {
        let gained = (error.log10() / tolerance.log10()).clamp(0.0, 1.0);
        bar.set_position((1000.0 * gained) as u64);
        bar.set_message(format!("iteration {}, error {:.1e}", step.iteration, error));
    }
}

/// The same over six loads.
fn show_load(bar: &ProgressBar, load: usize, step: CgStep, tolerance: f64) {
    if let Some(error) = step.energy_error.filter(|e| *e > 0.0) {
        let gained = (error.log10() / tolerance.log10()).clamp(0.0, 1.0);
        bar.set_position((1000.0 * (load as f64 + gained) / 6.0) as u64);
        bar.set_message(format!("strain {} of 6, error {error:.1e}", load + 1));
    }
}
