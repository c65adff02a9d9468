//! Owns `run`: one recipe over scans and folders of scans, each scan on its own.

pub mod job;
pub mod manifest;
pub mod queue;
pub mod scans;

use crate::cohort::job::ScanJob;
use crate::cohort::scans::Selection;
use crate::command::estimate::{Estimate, estimate, of_specimen};
use crate::command::{Outcome, adaptive, lattice, report, segment, solve};
use crate::error::{Error, Result};
use crate::io::{atomic, table};
use crate::machine::host;
use crate::machine::session::Session;
use crate::recipe::Recipe;
use crate::record::failures;
use crate::record::failures::Failure;
use crate::record::results;
use crate::record::results::Results;
use crate::result::row::Row;
use crate::result::settings::BoundaryRule;
use indicatif::ProgressBar;
use serde::Serialize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// What a run may use.
#[derive(Debug, Clone)]
pub struct Resources {
    /// Scans at a time.
    pub jobs: usize,
    /// Memory all scans together may take by estimate; None: what is free, less a tenth.
    pub memory_mib: Option<f64>,
}

/// What became of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    Done,
    #[serde(rename = "not converged")]
    NotConverged,
    #[serde(rename = "error not met")]
    ErrorNotMet,
    Failed,
    /// In a dry run.
    Planned,
}

/// One scan of a run.
#[derive(Debug, Clone, Serialize)]
pub struct ScanResult {
    pub scan: String,
    pub input: PathBuf,
    pub state: State,
    pub error: Option<String>,
    pub rows: usize,
    pub estimate: Estimate,
}

/// Takes every scan under `inputs` through segment, lattice and solve into `out/<scan>/`, then writes `out/results.csv`
/// and `out/report/`. What is up to date is kept. A scan that fails is named in the outcome; the others finish. With `only`,
/// one scan is run, and the others keep what they have in the tables.
///
/// # Errors
/// No scans, none of the name, an output folder that cannot be written; with a single scan, what is wrong with it.
pub fn cohort(
    recipe: &Recipe,
    inputs: &[PathBuf],
    out: &Path,
    selection: &Selection,
    only: Option<&str>,
    resources: &Resources,
    session: &Session,
) -> Result<(Outcome, Vec<ScanResult>)> {
    let mut segment = recipe.segment.clone();
    segment.keep_grey |= recipe.solve.material.is_some();
    let all = scans::find(inputs, &segment, selection, session)?;
    let names = all.iter().map(|job| job.name.clone()).collect();
    let jobs = match only {
        Some(name) => scans::only(&all, name)?,
        None => all,
    };
    let estimates: Vec<Estimate> = jobs
        .iter()
        .map(|job| estimate(&job.input, job.segment.spacing_mm, recipe))
        .collect::<Result<_>>()?;
    if session.dry_run {
        let results = plan(recipe, &jobs, &estimates, out, session);
        return Ok((outcome(&results), results));
    }
    atomic::sweep(out);
    let session = &Session {
        shares_process: resources.jobs.min(jobs.len()) > 1,
        ..session.clone()
    };
    let run = Run {
        recipe,
        out,
        names,
        jobs: &jobs,
        session,
        bar: session.bar(jobs.len() as u64, "scans"),
        done: Mutex::new(vec![None; jobs.len()]),
    };
    let memory: Vec<f64> = estimates.iter().map(|e| e.memory_mib).collect();
    let limit = resources
        .memory_mib
        .or_else(|| host::available_mib().map(|free| 0.9 * free));
    queue::run(
        &memory,
        resources.jobs,
        limit.unwrap_or(f64::INFINITY),
        |i| run.scan(i),
    );
    run.bar.finish_and_clear();
    run.finish(&estimates)
}

/// A run under way.
struct Run<'a> {
    recipe: &'a Recipe,
    out: &'a Path,
    /// All scans, in the order of the inputs; some may not be run this time, but were before.
    names: Vec<String>,
    jobs: &'a [ScanJob],
    session: &'a Session,
    bar: ProgressBar,
    /// By scan, in the order of the inputs.
    done: Mutex<Vec<Option<Result<Vec<Row>>>>>,
}

impl Run<'_> {
    /// One scan, whatever happens to it.
    fn scan(&self, i: usize) {
        let job = &self.jobs[i];
        let dir = self.out.join(&job.name);
        let own = self.session.logged(&job.name, dir.join("log.txt"));
        own.note(&format!(
            "{} {}: {}",
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            job.input.display()
        ));
        let solved = catch_unwind(AssertUnwindSafe(|| steps(self.recipe, job, &dir, &own)))
            .unwrap_or_else(|_| {
                Err(Error::specimen(
                    "the program failed on this scan (a bug)",
                    "report it with the scan's log",
                ))
            });
        match &solved {
            Ok(rows) => {
                own.note("done");
                self.session
                    .say(format!("{}: {}", job.name, in_words(rows)));
            }
            Err(e) => {
                own.note(&format!("failed: {e}"));
                if results::set_aside(&dir) {
                    own.note("the results of an earlier run are set aside");
                }
                if self.jobs.len() > 1 {
                    own.flush();
                    self.session.warn(format!("{} failed: {e}", job.name));
                }
            }
        }
        let mut done = self.done.lock().expect("scans do not panic here");
        done[i] = Some(solved);
        if let Err(e) = self.write_rows(&done) {
            self.session.warn(e.to_string());
        }
        self.bar.inc(1);
    }

    /// All rows so far, in the order of the scans.
    fn write_rows(&self, done: &[Option<Result<Vec<Row>>>]) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        for name in &self.names {
            match self.job(name) {
                Some(i) => rows.extend(done[i].iter().flatten().flatten().cloned()),
                None => {
                    let file = self.out.join(name).join(results::TABLE);
                    if file.is_file() {
                        rows.extend(table::read::<Row>(&file)?);
                    }
                }
            }
        }
        match rows.is_empty() {
            true => drop(results::set_aside(self.out)),
            false => results::write_table(self.out, &rows)?,
        }
        Ok(rows)
    }

    fn job(&self, name: &str) -> Option<usize> {
        self.jobs.iter().position(|job| job.name == name)
    }

    /// The table, the report, and what became of each scan.
    fn finish(self, estimates: &[Estimate]) -> Result<(Outcome, Vec<ScanResult>)> {
        let mut done = self.done.lock().expect("scans do not panic here").clone();
        if let [Some(Err(only))] = &done[..] {
            return Err(only.clone());
        }
        atomic::create_dir(self.out)?;
        let rows = self.write_rows(&done)?;
        let mut failures = failures(self.jobs, &done);
        let left_out = |name: &String| self.names.contains(name) && self.job(name).is_none();
        let known = failures::failures_in(self.out).into_iter();
        failures.extend(known.filter(|failure| left_out(&failure.scan)));
        failures::write_failures(self.out, &failures)?;
        if !rows.is_empty() {
            let recipe = toml::to_string(self.recipe).expect("settings are plain data");
            atomic::write(&self.out.join(report::RECIPE), &recipe)?;
            let dirs = [self.out.to_path_buf()];
            report::write(
                &rows,
                &failures,
                &self.recipe.report,
                &dirs,
                Some(recipe),
                &self.out.join("report"),
                self.session,
            )?;
        }
        let results: Vec<ScanResult> = self
            .jobs
            .iter()
            .zip(estimates)
            .zip(done.drain(..))
            .map(|((job, estimate), solved)| result(job, *estimate, solved, self.recipe.error))
            .collect();
        Ok((outcome(&results), results))
    }
}

/// The steps of one scan.
fn steps(recipe: &Recipe, job: &ScanJob, dir: &Path, session: &Session) -> Result<Vec<Row>> {
    segment::segment(&job.input, dir, Some(&job.name), &job.segment, session)?;
    if lattice::settings(dir).ok().as_ref() != Some(&recipe.lattice) || session.force {
        lattice::remember(dir, &recipe.lattice)?;
    }
    let mut rows = match recipe.error {
        Some(target) => adaptive::solve_to(dir, target, &recipe.solve, session)?.rows,
        None => solve::solve(dir, &recipe.lattice, &recipe.solve, session)?,
    };
    for row in &mut rows {
        row.marks.group.clone_from(&job.group);
        row.marks.subject.clone_from(&job.subject);
    }
    Results::open(dir, false)?.label(&job.group, &job.subject)?;
    Ok(rows)
}

fn failures(jobs: &[ScanJob], done: &[Option<Result<Vec<Row>>>]) -> Vec<Failure> {
    let failed = jobs.iter().zip(done).filter_map(|(job, solved)| {
        let error = solved.as_ref()?.as_ref().err()?;
        Some(Failure {
            scan: job.name.clone(),
            input: job.input.display().to_string(),
            reason: error.to_string(),
        })
    });
    failed.collect()
}

/// How many rows, and the modulus of the last: the mean or the limit of the finest lattices, where there are several.
fn in_words(rows: &[Row]) -> String {
    let stalled = rows.iter().filter(|row| row.converged() == Some(false));
    let stalled = match stalled.count() {
        0 => String::new(),
        n => format!(", {n} not converged"),
    };
    let modulus = rows.last().and_then(|row| {
        let key = &row.key;
        let kind = key.boundary.map_or(key.method.name(), BoundaryRule::name);
        let e_app = row.e_app_mpa()?;
        Some(format!("; {kind} {} mm: E_app {e_app:.3} MPa", key.lp_mm))
    });
    format!(
        "{} rows{stalled}{}",
        rows.len(),
        modulus.unwrap_or_default()
    )
}

/// `target`: the stated error asked for, if any.
fn result(
    job: &ScanJob,
    estimate: Estimate,
    solved: Option<Result<Vec<Row>>>,
    target: Option<f64>,
) -> ScanResult {
    let missed = |rows: &[Row]| {
        let broken = rows.iter().all(Row::is_disconnected);
        target.is_some_and(|target| !broken && !adaptive::meets(rows, target))
    };
    let (state, error, rows) = match solved {
        Some(Ok(rows)) if missed(&rows) => (State::ErrorNotMet, None, rows.len()),
        Some(Ok(rows)) if rows.iter().any(|row| row.converged() == Some(false)) => {
            (State::NotConverged, None, rows.len())
        }
        Some(Ok(rows)) => (State::Done, None, rows.len()),
        Some(Err(e)) => (State::Failed, Some(e.to_string()), 0),
        None => (State::Planned, None, 0),
    };
    ScanResult {
        scan: job.name.clone(),
        input: job.input.clone(),
        state,
        error,
        rows,
        estimate,
    }
}

fn outcome(results: &[ScanResult]) -> Outcome {
    let in_state = |state: State| results.iter().filter(move |r| r.state == state);
    let failed: Vec<String> = in_state(State::Failed).map(|r| r.scan.clone()).collect();
    let short = [State::NotConverged, State::ErrorNotMet]
        .into_iter()
        .any(|state| in_state(state).next().is_some());
    match (failed.is_empty(), short) {
        (false, _) => Outcome::SomeFailed(failed),
        (true, true) => Outcome::NotConverged,
        (true, false) => Outcome::Done,
    }
}

/// What would run. Every scan is read and segmented, so what its solves need is known.
fn plan(
    recipe: &Recipe,
    jobs: &[ScanJob],
    estimates: &[Estimate],
    out: &Path,
    session: &Session,
) -> Vec<ScanResult> {
    let bar = session.bar(jobs.len() as u64, "scans");
    let mut results = Vec::new();
    for (job, first) in jobs.iter().zip(estimates) {
        let to = out.join(&job.name);
        let quiet = Session {
            quiet: true,
            ..session.clone()
        };
        let known = segment::in_memory(&job.input, Some(&job.name), &job.segment, &quiet)
            .and_then(|specimen| of_specimen(&specimen, first, recipe));
        bar.inc(1);
        let estimate = *known.as_ref().unwrap_or(first);
        results.push(match &known {
            Ok(e) => {
                let (to, from) = (to.display(), job.input.display());
                session.say(format!("{to} <- {from}: {e}"));
                result(job, estimate, None, None)
            }
            Err(e) => {
                session.warn(format!("{} would fail: {e}", job.name));
                result(job, estimate, Some(Err(e.clone())), None)
            }
        });
        if let Some(free) = host::available_mib().filter(|free| *free < estimate.memory_mib) {
            session.warn(format!("{} will not fit: {free:.0} MiB are free", job.name));
        }
    }
    bar.finish_and_clear();
    let estimates: Vec<Estimate> = results.iter().map(|r| r.estimate).collect();
    let seconds = estimates.iter().filter_map(|e| e.time_s).sum::<f64>();
    let time = match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    };
    let unknown = estimates.iter().filter(|e| e.time_s.is_none()).count();
    let rest = match unknown {
        0 => String::new(),
        n => format!(", and {n} whose time is not known before reading"),
    };
    session.say(format!(
        "scans: {}; about {time} one after the other{rest}",
        jobs.len()
    ));
    results
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_are_written_in_words() {
        let all = [
            State::Done,
            State::NotConverged,
            State::ErrorNotMet,
            State::Failed,
            State::Planned,
        ];
        let words = serde_json::to_value(all).unwrap();
        let expected = [
            "done",
            "not converged",
            "error not met",
            "failed",
            "planned",
        ];
        assert_eq!(words, serde_json::json!(expected));
    }
}
