//! Owns `run`: a recipe over scans on disk.

use crate::call::{computed, raised};
use crate::settings::laid_over;
use bonepd_ct::cohort::scans::Selection;
use bonepd_ct::cohort::{Resources, cohort};
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::io::{own_files, table};
use bonepd_ct::machine::session::Session;
use bonepd_ct::recipe::Recipe;
use bonepd_ct::result::row::Row;
use pyo3::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};

/// What a run takes besides its recipe.
#[derive(FromPyObject)]
pub struct Request {
    /// A file, or the name of a recipe in the program.
    #[pyo3(item)]
    recipe: PathBuf,
    /// Scans, folders, manifests.
    #[pyo3(item)]
    scans: Vec<PathBuf>,
    /// Folder for the results.
    #[pyo3(item)]
    out: PathBuf,
    /// Scans at a time.
    #[pyo3(item)]
    jobs: usize,
    /// Redo what is up to date.
    #[pyo3(item)]
    force: bool,
    /// Whether bars are shown.
    #[pyo3(item)]
    progress: bool,
}

/// Takes scans through a recipe. Returns the outcome, what became of each scan, and the warnings, as JSON.
///
/// # Errors
/// No scans, an output folder that cannot be written, settings that do not fit, in the program's words.
#[pyfunction]
pub fn run(py: Python<'_>, request: Request, settings: &str) -> PyResult<String> {
    let recipe = Recipe::read(&request.recipe)
        .and_then(|recipe| laid_over(&recipe, settings))
        .map_err(|e| raised(py, &e))?;
    let session = Session {
        force: request.force,
        ..Session::of_caller(request.progress)
    };
    let own = session.clone();
    let (outcome, scans, rows) = computed(py, &session.stop, None, move || {
        let resources = Resources {
            jobs: request.jobs,
            memory_mib: None,
        };
        let Request { scans, out, .. } = &request;
        let all = Selection::default();
        let (outcome, scans) = cohort(&recipe, scans, out, &all, None, &resources, &own)?;
        Ok((outcome, scans, rows_in(out)?))
    })?;
    let outcome = match outcome {
        Outcome::Done => "done",
        Outcome::NotConverged => "not converged",
        Outcome::SomeFailed(_) => "some failed",
    };
    let said = json!({
        "outcome": outcome,
        "scans": scans,
        "rows": rows,
        "warnings": session.warnings(),
    });
    Ok(said.to_string())
}

/// All rows of the run; none where no scan has results.
fn rows_in(out: &Path) -> Result<Vec<Row>> {
    let table = out.join(own_files::RESULTS);
    match table.is_file() {
        true => table::read(&table),
        false => Ok(Vec::new()),
    }
}
