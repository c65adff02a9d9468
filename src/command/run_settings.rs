//! Owns what a later `solve` in a run's folder takes from the run: its load, its ends and its tissue.

use crate::error::Result;
use crate::io::own_files::RECIPE;
use crate::pipeline::apparent::SolveParams;
use crate::recipe::Recipe;
use crate::record::specimen;
use std::path::{Path, PathBuf};

/// Settings of the run that segmented `dir`, and where they stand; None where no run did. Method, resolution and what is to be
/// recorded stay the defaults.
///
/// # Errors
/// The recipe of a run that this version cannot read.
pub fn of_run(dir: &Path) -> Result<Option<(PathBuf, SolveParams)>> {
    let Some((path, text)) = recipe(dir) else {
        return Ok(None);
    };
    let run = Recipe::parse(&text, &path)?.solve;
    let params = SolveParams {
        young_mpa: run.young_mpa,
        poisson: run.poisson,
        material: run.material,
        strain: run.strain,
        grip_mm: run.grip_mm,
        load: run.load,
        held: run.held,
        moved: run.moved,
        pushed: run.pushed,
        supports: run.supports,
        ends_depth_mm: run.ends_depth_mm,
        angle_deg: run.angle_deg,
        sed: run.sed,
        ends: run.ends,
        conditions: run.conditions,
        axis: run.axis,
        tolerance: run.tolerance,
        ..SolveParams::default()
    };
    Ok(Some((path, params)))
}

/// Path and text of the recipe of that run.
fn recipe(dir: &Path) -> Option<(PathBuf, String)> {
    let dir = dir.canonicalize().ok()?;
    specimen::record(&dir)?;
    let path = dir.parent()?.join(RECIPE);
    let text = std::fs::read_to_string(&path).ok()?;
    Some((path, text))
}

/// The settings in a line.
pub fn in_words(params: &SolveParams) -> String {
    let tissue = match &params.material {
        Some(_) => "the tissue's law".to_owned(),
        None => format!("E {} MPa", params.young_mpa),
    };
    let far = match params.load.is_by_angle() {
        true => format!("angle {}°", params.angle_deg),
        false => format!("strain {}", params.strain),
    };
    let held = params.supports_in_words();
    let held = held.map_or(String::new(), |words| format!(", {words}"));
    format!(
        "load {}, axis {}, {far}, grips {} mm, ends {}{held}, {tissue}, ν {}",
        params.load.name(),
        params.axis.name(),
        params.grip_mm,
        params.ends.name(),
        params.poisson
    )
}
