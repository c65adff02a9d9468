//! Owns settings on their way in: keys of a recipe, side by side, as JSON.

use bonepd_ct::error::{Error, Result};
use bonepd_ct::pipeline::segment::SegmentParams;
use bonepd_ct::recipe::Recipe;
use std::path::Path;

/// How errors call the settings of a call.
const WHOSE: &str = "the settings of this call";

/// Keys that say with which elements a scan is solved.
const RESOLUTION: [&str; 9] = [
    "method",
    "refine",
    "refine_mask",
    "coarsen",
    "coarsen_by",
    "element_mm",
    "structure",
    "lp_mm",
    "boundary",
];

/// `recipe` with the settings in `json`, an object, in place of its own.
///
/// # Errors
/// Unknown keys, unusable values, a resolution where an error target chooses it.
pub fn laid_over(recipe: &Recipe, json: &str) -> Result<Recipe> {
    let given: toml::Table = serde_json::from_str(json).map_err(|e| {
        let advice = "give numbers, words, lists and dicts, as a recipe has them";
        Error::setting(WHOSE, e.to_string(), advice).caused_by(e)
    })?;
    let resolution = RESOLUTION.into_iter().find(|key| given.contains_key(*key));
    let mut recipe = recipe.clone();
    make_way(&mut recipe.segment, &given);
    let recipe = recipe.with(given, Path::new(WHOSE)).map_err(of_call)?;
    match resolution.filter(|_| recipe.error.is_some()) {
        None => Ok(recipe),
        Some(key) => Err(Error::setting(
            key,
            "the error target chooses method and element size",
            format!("leave {key} out, or the error target"),
        )),
    }
}

/// A recipe's error names its file. Here there is none.
fn of_call(error: Error) -> Error {
    match error {
        Error::File { found, advice, .. } => Error::setting(WHOSE, found, advice),
        other => other,
    }
}

/// What finds the bone in a recipe gives way to another way that was given, as on the command line.
fn make_way(segment: &mut SegmentParams, given: &toml::Table) {
    let has = |key: &str| given.contains_key(key);
    let otsu = given.get("otsu").and_then(toml::Value::as_bool) == Some(true);
    if otsu || has("labels") {
        (segment.lower, segment.upper) = (None, None);
    }
    if has("labels") {
        segment.gaussian_voxels = 0.0;
    }
    if has("labels") || has("lower") || has("upper") {
        segment.otsu = false;
    }
    if otsu || has("lower") || has("upper") {
        segment.labels.clear();
    }
}
