//! Owns the recipes and scenes that are in the program: those of `pipelines/`.

use crate::error::{Error, Result};

/// Name and text of files of `pipelines/`.
macro_rules! files {
    ($($name:literal),+ $(,)?) => {
        &[$(($name, include_str!(concat!("../../pipelines/", $name, ".toml")))),+]
    };
}

/// Recipes of `run`: name and text.
pub const BUILT_IN: &[(&str, &str)] = files![
    "paper",
    "quick",
    "to-an-error",
    "bcc-against-sc",
    "hrpqct",
    "hrpqct-1",
    "load-history-3",
    "load-history-6",
    "stiffness",
    "vertebra",
];

/// Scenes of `scene`: name and text. Files that they name lie in `sample_data/`.
pub const SCENES: &[(&str, &str)] = files![
    "femur-lc1-continuum",
    "femur-lc1-delta-0.301",
    "femur-lc1-delta-0.601",
    "femur-lc1-delta-0.901",
    "femur-lc1-delta-1.201",
    "femur-lc1-forces",
    "femur-lc2-continuum",
    "femur-lc2-delta-0.301",
    "femur-lc2-delta-0.601",
    "femur-lc2-delta-0.901",
    "femur-lc2-delta-1.201",
    "femur-lc2-forces",
    "scan-slice",
    "scene-compact-tension-0",
    "scene-compact-tension-45",
    "scene-compact-tension-60",
    "scene-compact-tension-90",
    "scene-crack-kinking-anisotropic",
    "scene-crack-kinking-silicon",
    "scene-crack-tip-I",
    "scene-crack-tip-II",
    "scene-energy-angle-anisotropic-extension",
    "scene-energy-angle-anisotropic-shear",
    "scene-energy-angle-square-extension",
    "scene-energy-angle-square-shear",
    "scene-heat-disc-calibrated",
    "scene-heat-disc",
    "scene-notched-plate",
    "scene-plate-modes",
    "scene-square-inclusion",
    "scene-tetrachiral-modes",
    "square-continuum",
    "square-fixed-horizon-10.05",
    "square-fixed-horizon-2.01",
    "square-fixed-horizon-2.5125",
    "square-fixed-horizon-4.02",
    "square-fixed-horizon-5.025",
    "square-fixed-horizon-8.04",
    "square-fixed-ratio-10",
    "square-fixed-ratio-160",
    "square-fixed-ratio-20",
    "square-fixed-ratio-320",
    "square-fixed-ratio-40",
    "square-fixed-ratio-80",
    "square",
];

/// The names of [`BUILT_IN`], in a sentence.
pub fn names() -> String {
    let names: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// The text of a recipe of `run`.
///
/// # Errors
/// None of this name.
pub fn built_in(name: &str) -> Result<&'static str> {
    find(BUILT_IN, name).ok_or_else(|| unknown(name))
}

/// The text of a recipe or of a scene.
///
/// # Errors
/// None of this name.
pub fn any(name: &str) -> Result<&'static str> {
    let found = find(BUILT_IN, name).or_else(|| find(SCENES, name));
    found.ok_or_else(|| unknown(name))
}

fn find(files: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    let found = files.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| *text)
}

fn unknown(name: &str) -> Error {
    Error::setting(
        "recipe",
        format!("no recipe in the program is named `{name}`"),
        format!(
            "name one of {}; `bonepd-ct recipe` lists scenes too",
            names()
        ),
    )
}
