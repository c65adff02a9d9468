//! Owns `run`: one recipe over scans and folders of scans, each scan on its own.

#[doc(hidden)]
pub mod earlier;
pub mod job;
pub mod manifest;
pub mod outcome;
mod plan;
#[doc(hidden)]
pub mod queue;
pub mod scans;

use crate::cohort::job::ScanJob;
use crate::cohort::outcome::{ScanResult, Solved, State, in_words, outcome, result, said_of_kept};
use crate::cohort::scans::Selection;
use crate::command::estimate::{Estimate, estimate};
use crate::command::solve::{OpenScan, in_vivo, supports};
use crate::command::{Outcome, adaptive, answer, lattice, report, segment};
use crate::error::{Error, Result};
use crate::io::{atomic, own_files, table};
use crate::machine::host;
use crate::machine::session::Session;
use crate::pipeline::apparent::Field;
use crate::recipe::Recipe;
use crate::record::failures;
use crate::record::failures::Failure;
use crate::record::in_vivo::remove as remove_daily_loads;
use crate::record::results;
use crate::result::row::Row;
use indicatif::ProgressBar;
use std::collections::HashMap;
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
    let mut names = earlier::names(out, &all);
    earlier::say(&names, session);
    names.extend(all.iter().map(|job| job.name.clone()));
    let jobs = match only {
        Some(name) => scans::only(&all, name)?,
        None => all,
    };
    let estimates: Vec<Estimate> = jobs
        .iter()
        .map(|job| estimate(&job.input, job.segment.spacing_mm, recipe))
        .collect::<Result<_>>()?;
    if session.dry_run {
        let results = plan::plan(recipe, &jobs, &estimates, out, session);
        return Ok((outcome(&results), results));
    }
    atomic::sweep(out);
    let session = &Session {
        shares_process: resources.jobs.min(jobs.len()) > 1,
        ..session.with_warnings_once()
    };
    let run = Run {
        recipe,
        out,
        names,
        jobs: &jobs,
        session,
        bar: session.bar(jobs.len() as u64, "all scans"),
        done: Mutex::new(vec![None; jobs.len()]),
        tables: Mutex::default(),
    };
    run.bar
        .set_message(format!("0 of {} scans done", jobs.len()));
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
    session.stop.obey();
    session.repeated_warnings();
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
    done: Mutex<Vec<Option<Result<Solved>>>>,
    /// All rows in the folders of the scans that are done, by name.
    tables: Mutex<HashMap<String, Vec<Row>>>,
}

impl Run<'_> {
    /// One scan, whatever happens to it.
    fn scan(&self, i: usize) {
        if self.session.stop.is_asked() {
            return;
        }
        let job = &self.jobs[i];
        let dir = self.out.join(&job.name);
        let own = self.session.logged(&job.name, dir.join("log.txt"));
        own.note(&format!(
            "{} {}: {}",
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            job.input.display()
        ));
        let before: Vec<Row> = table::read(&dir.join(own_files::RESULTS)).unwrap_or_default();
        let solved = catch_unwind(AssertUnwindSafe(|| steps(self.recipe, job, &dir, &own)));
        if solved.is_err() && self.session.stop.is_asked() {
            return;
        }
        let solved = solved.unwrap_or_else(|_| {
            Err(Error::specimen(
                "the program failed on this scan (a bug)",
                "report it with the scan's log",
            ))
        });
        match &solved {
            Ok(Solved { rows, answer }) => {
                own.note("done");
                let place = format!("{} ({} of {})", job.name, i + 1, self.jobs.len());
                self.session.result(format!(
                    "{place}: {}{}",
                    in_words(rows, answer.as_ref()),
                    said_of_kept(rows, &before)
                ));
            }
            Err(e) => {
                own.note(&format!("failed: {e}"));
                if results::set_aside(&dir) || results::has_old(&dir) {
                    own.warn(format!(
                        "its results are from an earlier run with another recipe: they are kept as {}",
                        dir.join(results::OLD_TABLE).display()
                    ));
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
        let finished = done.iter().flatten().count();
        self.bar
            .set_message(format!("{finished} of {} scans done", done.len()));
    }

    /// All rows so far, in the order of the scans: all that the folders of the scans hold, also of earlier runs.
    fn write_rows(&self, done: &[Option<Result<Solved>>]) -> Result<Vec<Row>> {
        let mut rows = Vec::new();
        let mut tables = self.tables.lock().expect("tables are read without panic");
        for name in &self.names {
            let is_done = |i: usize| matches!(done[i], Some(Ok(_)));
            let file = self.out.join(name).join(own_files::RESULTS);
            if self.job(name).is_some_and(|i| !is_done(i)) || !file.is_file() {
                continue;
            }
            if let Some(own) = tables.get(name) {
                rows.extend_from_slice(own);
                continue;
            }
            let read: Vec<Row> = table::read(&file)?;
            rows.extend_from_slice(&read);
            // Another process may be at work on a scan that is not of this run.
            if self.job(name).is_some() {
                tables.insert(name.clone(), read);
            }
        }
        match rows.is_empty() {
            true => drop(results::set_aside(self.out)),
            false => results::write_table(self.out, &rows)?,
        }
        Ok(rows)
    }

    /// The recipe as it is run. One of an earlier run that differs is kept too.
    fn write_recipe(&self) -> Result<String> {
        let recipe = toml::to_string(self.recipe).expect("settings are plain data");
        let file = self.out.join(own_files::RECIPE);
        if std::fs::read_to_string(&file).is_ok_and(|old| old != recipe) {
            let _ = std::fs::rename(&file, self.out.join(own_files::OLD_RECIPE));
            self.session.say(format!(
                "note: an earlier run in {} had another recipe: its rows are kept with the new ones, its recipe is {}",
                self.out.display(),
                own_files::OLD_RECIPE
            ));
        }
        atomic::write(&file, &recipe)?;
        Ok(recipe)
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
        if rows.is_empty() {
            self.set_earlier_report_aside();
        } else {
            let recipe = self.write_recipe()?;
            let dirs = [self.out.to_path_buf()];
            let folders = &report::Folders::of(&rows, &dirs);
            let answers = report::answers(&rows, folders);
            table::write(&self.out.join(own_files::ANSWERS), &answers.lines)?;
            let sources = report::Sources {
                rows: &rows,
                answers,
                failures: &failures,
                params: &self.recipe.report,
                folders,
                recipe: Some(recipe),
            };
            report::write(sources, &self.out.join("report"), self.session)?;
            self.say_where();
        }
        let results: Vec<ScanResult> = self
            .jobs
            .iter()
            .zip(estimates)
            .zip(done.drain(..))
            .map(|((job, estimate), solved)| result(job, *estimate, solved, self.recipe.error))
            .collect();
        self.say_what_fell_short(&results);
        Ok((outcome(&results), results))
    }

    /// No scan has results: what an earlier run made of its own is not this run's.
    fn set_earlier_report_aside(&self) {
        let moved =
            |from: &str, to: &str| std::fs::rename(self.out.join(from), self.out.join(to)).is_ok();
        if moved(own_files::ANSWERS, "answers.old.csv") | moved("report", "report.old") {
            self.session.warn(format!(
                "no scan has results: those of an earlier run in {} are kept as answers.old.csv, {} and report.old",
                self.out.display(),
                results::OLD_TABLE
            ));
        }
    }

    fn say_where(&self) {
        self.session.result(format!(
            "answers, one line a scan: {}; page: {}",
            self.out.join(own_files::ANSWERS).display(),
            self.out.join("report/report.html").display()
        ));
    }

    /// Names the scans that fell short.
    fn say_what_fell_short(&self, results: &[ScanResult]) {
        for state in [State::NotConverged, State::ErrorNotMet] {
            let names: Vec<&str> = results
                .iter()
                .filter(|r| r.state == state)
                .map(|r| r.scan.as_str())
                .collect();
            if !names.is_empty() {
                self.session
                    .warn(format!("{}: {}", state.name(), names.join(", ")));
            }
        }
    }
}

/// The steps of one scan.
fn steps(recipe: &Recipe, job: &ScanJob, dir: &Path, session: &Session) -> Result<Solved> {
    segment::segment(&job.input, dir, Some(&job.name), &job.segment, session)?;
    if lattice::settings(dir).ok().as_ref() != Some(&recipe.lattice) || session.force {
        lattice::remember(dir, &recipe.lattice)?;
    }
    // Loads differ, the tissue does not: the scan is opened once for all of them.
    let opened_for = match recipe.error {
        Some(_) => adaptive::widest(&recipe.solve),
        None => recipe.solve.clone(),
    };
    let mut scan = OpenScan::open(dir, &opened_for, session.force, session)?;
    let daily = recipe.in_vivo_mpa.filter(|_| !session.dry_run);
    if !session.dry_run {
        remove_daily_loads(dir);
    }
    if daily.is_some() {
        scan.keep_unit_fields();
    }
    let mut rows = Vec::new();
    let solves = recipe.solves();
    // Solves to an error choose their elements one by one.
    scan.keep_models(solves.len() > 1 && recipe.error.is_none());
    for mut params in solves {
        supports::lay(dir, &mut params)?;
        if daily.is_some() {
            params.fields = vec![Field::Sed];
        }
        rows.extend(match recipe.error {
            Some(target) => adaptive::solve_open_to(&mut scan, target, &params, session)?.rows,
            None => scan.solve(&recipe.lattice, &params, session)?,
        });
    }
    scan.keep_models(false);
    if let Some(target_mpa) = daily {
        let criterion = recipe.solve.pistoia.unwrap_or_default();
        in_vivo::combine(
            &mut scan,
            dir,
            (target_mpa, criterion),
            recipe.solve.axis,
            session,
        )?;
    }
    for row in &mut rows {
        row.marks.group.clone_from(&job.group);
        row.marks.subject.clone_from(&job.subject);
    }
    scan.results().label(&job.group, &job.subject)?;
    let answer = answer::keep(dir, &rows, recipe.error)?;
    Ok(Solved { rows, answer })
}

fn failures(jobs: &[ScanJob], done: &[Option<Result<Solved>>]) -> Vec<Failure> {
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
