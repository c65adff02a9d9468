//! Owns `segment` and `solve` of one scan in memory.

use crate::arrays::{fields, given, taken};
use crate::call::{computed, raised};
use crate::settings::laid_over;
use bonepd_ct::command::solve::{InMemory, OpenScan};
use bonepd_ct::command::{adaptive, answer};
use bonepd_ct::error::Result;
use bonepd_ct::format::orient;
use bonepd_ct::machine::session::Session;
use bonepd_ct::pipeline::apparent::checks::needs_modulus;
use bonepd_ct::pipeline::segment::SegmentParams;
use bonepd_ct::recipe::Recipe;
use bonepd_ct::record::answer::Answer;
use bonepd_ct::record::specimen::{SegmentRecord, SegmentedScan};
use bonepd_ct::result::answer::best;
use bonepd_ct::result::derived::with_derived;
use bonepd_ct::result::details::Details;
use bonepd_ct::result::row::Row;
use bonepd_ct::volume::Volume;
use numpy::PyReadonlyArray3;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Serialize;
use serde_json::json;

/// A scan in memory: its voxels, x fastest, and its volume of interest where that is a mask.
struct Scan {
    n: [usize; 3],
    values: Vec<f32>,
    voi: Option<Vec<u8>>,
    name: String,
}

impl Scan {
    fn taken(
        values: &PyReadonlyArray3<f32>,
        voi: Option<&PyReadonlyArray3<u8>>,
        name: String,
    ) -> PyResult<Scan> {
        let (n, values) = taken(values)?;
        let voi = voi.map(taken).transpose()?.map(|(_, voxels)| voxels);
        Ok(Scan {
            n,
            values,
            voi,
            name,
        })
    }

    fn segmented(self, params: &SegmentParams, session: &Session) -> Result<SegmentedScan> {
        let values = (self.n, self.values);
        bonepd_ct::command::segment::of_values(values, self.voi, &self.name, params, session)
    }
}

/// The mask of the scan, in the order of its array.
fn mask_of(scan: &SegmentedScan) -> Volume<u8> {
    let back = scan.record.input.axes.inverse();
    orient::turned_copy(&scan.specimen.bone, &back).into_owned()
}

/// Segments an array. Returns the mask and, as JSON, the record and the warnings.
///
/// # Errors
/// Settings that do not fit, in the program's words.
#[pyfunction]
pub fn segment<'py>(
    py: Python<'py>,
    values: PyReadonlyArray3<'py, f32>,
    voi: Option<PyReadonlyArray3<'py, u8>>,
    name: String,
    settings: &str,
    threads: Option<i64>,
) -> PyResult<(Bound<'py, PyAny>, String)> {
    let scan = Scan::taken(&values, voi.as_ref(), name)?;
    let recipe = laid_over(&Recipe::default(), settings).map_err(|e| raised(py, &e))?;
    let session = Session::of_caller(false);
    let own = session.clone();
    let (mask, record) = computed(py, &session.stop, threads, move || {
        let segmented = scan.segmented(&recipe.segment, &own)?;
        Ok((mask_of(&segmented), segmented.record))
    })?;
    let said = json!({ "record": record, "warnings": session.warnings() });
    Ok((given(py, mask), said.to_string()))
}

/// What a solve came to.
struct Solved {
    mask: Volume<u8>,
    said: Said,
    left: InMemory,
}

/// The part of it that is no array.
#[derive(Serialize)]
struct Said {
    /// All rows of `results.csv`.
    rows: Vec<Row>,
    /// Of each row.
    details: Vec<Details>,
    /// Which row answers.
    answers: Option<usize>,
    answer: Option<Answer>,
    segment: SegmentRecord,
    /// Whether the error target is met; true where there is none.
    met: bool,
}

/// The mask, fields with the number of their row, and all else as JSON.
type Returned<'py> = (Bound<'py, PyAny>, Vec<(usize, Bound<'py, PyDict>)>, String);

/// Segments and solves an array.
///
/// # Errors
/// Settings that do not fit, in the program's words.
#[pyfunction]
pub fn solve<'py>(
    py: Python<'py>,
    values: PyReadonlyArray3<'py, f32>,
    voi: Option<PyReadonlyArray3<'py, u8>>,
    name: String,
    settings: &str,
    threads: Option<i64>,
    progress: bool,
) -> PyResult<Returned<'py>> {
    let scan = Scan::taken(&values, voi.as_ref(), name)?;
    let recipe = laid_over(&Recipe::default(), settings).map_err(|e| raised(py, &e))?;
    let session = Session::of_caller(progress);
    let own = session.clone();
    let Solved { mask, said, left } = computed(py, &session.stop, threads, move || {
        solved(scan, &recipe, &own)
    })?;
    let text = json!({
        "solved": said,
        "stiffness": left.stiffness,
        "warnings": session.warnings(),
    });
    let of_row = |(key, own)| {
        let row = said.rows.iter().position(|row| row.key == key);
        row.map(|row| Ok((row, fields(py, own)?)))
    };
    let fields: PyResult<Vec<_>> = left.fields.into_iter().filter_map(of_row).collect();
    Ok((given(py, mask), fields?, text.to_string()))
}

fn solved(scan: Scan, recipe: &Recipe, session: &Session) -> Result<Solved> {
    let segmented = scan.segmented(&recipe.segment, session)?;
    session.stop.obey();
    let (mask, record) = (mask_of(&segmented), segmented.record.clone());
    let (met, mut scan) = match recipe.error {
        Some(target) => {
            if recipe.solve.plasticity.is_none() {
                needs_modulus(recipe.solve.load, "error")?;
            }
            let widest = adaptive::widest(&recipe.solve);
            let mut scan = OpenScan::in_memory(segmented, &widest)?;
            let found = adaptive::solve_open_to(&mut scan, target, &recipe.solve, session)?;
            (found.met, scan)
        }
        None => {
            let mut scan = OpenScan::in_memory(segmented, &recipe.solve)?;
            scan.solve(&recipe.lattice, &recipe.solve, session)?;
            (true, scan)
        }
    };
    let results = scan.results();
    let own = results.solved();
    let rows = with_derived(&own, &own);
    let details = rows
        .iter()
        .map(|row| results.details_of(&row.key))
        .collect();
    let carrying = rows.iter().filter(|row| row.load_carried().is_some());
    let answering = best(carrying).or(rows.last());
    Ok(Solved {
        mask,
        left: scan.take_in_memory(),
        said: Said {
            details,
            answers: rows
                .iter()
                .position(|row| answering.is_some_and(|a| std::ptr::eq(a, row))),
            answer: answer::of_rows(&rows, &record, recipe.error),
            segment: record,
            met,
            rows,
        },
    })
}
