//! Owns the tidy tables next to `results.csv`: forces at the ends, failure at other volumes, sections, tissue by label. Each line
//! says which solve it is of.

use crate::error::Result;
use crate::grid::Axis;
use crate::io::{atomic, table};
use crate::result::details::{
    Details, EndForces, FailureAt, LabelForces, SectionShare, TissueSpread,
};
use crate::result::settings::load_steps::LoadSteps;
use crate::result::settings::{BoundaryRule, CellType, Load, Method, Sed, Settings, Supports};
use crate::result::strength::{CurvePoint, YieldedShare};
use serde::Serialize;
use std::path::Path;

pub const REACTIONS: &str = "reactions.csv";
pub const LABELS: &str = "labels.csv";
pub const FAILURE: &str = "failure.csv";
pub const SECTIONS: &str = "sections.csv";
pub const TISSUE: &str = "tissue.csv";
pub const YIELDED: &str = "yielded.csv";
pub const CURVE: &str = "curve.csv";

/// One line of such a table: the solve, and what it says.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Line<T> {
    #[serde(flatten)]
    of: Of,
    #[serde(flatten)]
    says: T,
}

/// Which solve a line is of, by the columns of `results.csv`.
#[derive(Debug, Clone, Default, Serialize)]
struct Of {
    scan: String,
    method: Method,
    structure: CellType,
    boundary: Option<BoundaryRule>,
    lp_mm: f64,
    young_mpa: f64,
    poisson: f64,
    load: Load,
    ends: Supports,
    axis: Axis,
    strain: f64,
    angle_deg: Option<f64>,
    grip_mm: f64,
    tolerance: Option<f64>,
    sed: Option<Sed>,
    /// Of tissue that yields.
    steps: Option<LoadSteps>,
}

impl Of {
    fn row(key: &Settings) -> Of {
        Of {
            scan: key.scan.clone(),
            method: key.method,
            structure: key.structure,
            boundary: key.boundary,
            lp_mm: key.lp_mm,
            young_mpa: key.young_mpa,
            poisson: key.poisson,
            load: key.load,
            ends: key.supports,
            axis: key.axis,
            strain: key.strain,
            angle_deg: key.angle_deg,
            grip_mm: key.grip_mm,
            tolerance: key.tolerance,
            sed: key.sed,
            steps: key.steps,
        }
    }
}

/// Writes the tables of all rows into `dir`; one that no row has a line for goes.
///
/// # Errors
/// Files that cannot be written.
pub fn write<'a>(
    dir: &Path,
    rows: impl Iterator<Item = (&'a Settings, &'a Details)> + Clone,
) -> Result<()> {
    table_of::<EndForces>(&dir.join(REACTIONS), rows.clone(), |d| &d.ends)?;
    table_of::<LabelForces>(&dir.join(LABELS), rows.clone(), |d| &d.labels)?;
    table_of::<FailureAt>(&dir.join(FAILURE), rows.clone(), |d| &d.failure)?;
    table_of::<SectionShare>(&dir.join(SECTIONS), rows.clone(), |d| &d.sections)?;
    table_of::<YieldedShare>(&dir.join(YIELDED), rows.clone(), |d| &d.yielded)?;
    table_of::<TissueSpread>(&dir.join(TISSUE), rows, |d| &d.tissue)
}

/// Removes the tables in `dir`, whose rows are set aside.
pub fn remove(dir: &Path) {
    for table in [REACTIONS, LABELS, FAILURE, SECTIONS, TISSUE, YIELDED, CURVE] {
        let _ = std::fs::remove_file(dir.join(table));
    }
}

/// Writes the stress–strain curve of one solve.
///
/// # Errors
/// A file that cannot be written.
pub fn write_curve(dir: &Path, curve: &[CurvePoint]) -> Result<()> {
    atomic::write(&dir.join(CURVE), table::to_csv(curve))
}

/// The curve that the last solve in `dir` left.
pub fn curve(dir: &Path) -> Option<Vec<CurvePoint>> {
    table::read(&dir.join(CURVE)).ok()
}

fn table_of<'a, T: Clone + Default + Serialize + 'a>(
    path: &Path,
    rows: impl Iterator<Item = (&'a Settings, &'a Details)>,
    lines: impl Fn(&'a Details) -> &'a [T],
) -> Result<()> {
    let line = |(key, details): (&'a Settings, &'a Details)| {
        let of = Of::row(key);
        lines(details).iter().map(move |says| Line {
            of: of.clone(),
            says: says.clone(),
        })
    };
    let all: Vec<Line<T>> = rows.flat_map(line).collect();
    if all.is_empty() {
        let _ = std::fs::remove_file(path);
        return Ok(());
    }
    atomic::write(path, table::to_csv(&all))
}
