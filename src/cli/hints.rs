//! Owns hints for words that other programs would understand, or that stand in the wrong place.

use clap::error::{ContextKind, ContextValue, ErrorKind};

/// Flags that people try, without their dashes, and what is meant here.
const FLAGS: [(&[&str], &str); 13] = [
    (
        &["threshold", "thresh", "thr", "t", "global-threshold"],
        "--lower V (bone is V or more), with --upper V for a window, or --otsu",
    ),
    (
        &[
            "voxel-size",
            "voxel",
            "voxelsize",
            "voxel-mm",
            "resolution",
            "spacing-mm",
        ],
        "--spacing MM, one number or X,Y,Z in millimetres (0.0195, not 19.5)",
    ),
    (
        &[
            "e",
            "young",
            "youngs-modulus",
            "young-modulus",
            "e-mpa",
            "modulus",
            "elastic-modulus",
            "tissue-modulus",
        ],
        "--young-mpa E, in MPa (10 GPa is 10000)",
    ),
    (
        &["young-gpa", "e-gpa", "gpa"],
        "--young-mpa E, in MPa: 10 GPa is 10000",
    ),
    (
        &["nu", "v", "poissons-ratio", "poisson-ratio"],
        "--poisson NU",
    ),
    (
        &[
            "boundary-condition",
            "boundary-conditions",
            "bc",
            "bcs",
            "support",
            "supports",
        ],
        "--ends free or bonded for the loaded ends; --load confined holds the sides; --boundary is how a lattice meets the bone's surface",
    ),
    (
        &["lp-mm", "lattice-parameter", "spacing-lattice"],
        "--lp MM, comma-separated",
    ),
    (
        &["sigma", "smooth", "smoothing", "gauss", "blur"],
        "--gaussian VOXELS",
    ),
    (
        &["output", "outdir", "out-dir", "output-dir"],
        "-o FOLDER, or --out FOLDER",
    ),
    (&["grip", "grips", "cap", "caps"], "--grip-mm MM"),
    (
        &["target", "accuracy", "precision", "max-error"],
        "--error 3%",
    ),
    (&["label", "values"], "--labels VALUES, comma-separated"),
    (
        &["fe", "fem", "voxel-fe", "hex8", "solver"],
        "--method voxel-fe",
    ),
];

/// What clap guesses from the spelling of a word.
pub const GUESSES: [ContextKind; 3] = [
    ContextKind::Suggested,
    ContextKind::SuggestedArg,
    ContextKind::TrailingArg,
];

/// A line more on how words could not be understood; None where clap says it all.
pub fn hint(error: &clap::Error) -> Option<String> {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(vec![word.clone()]),
        Some(ContextValue::Strings(words)) => Some(words.clone()),
        _ => None,
    };
    let words = context(ContextKind::InvalidArg)?;
    match error.kind() {
        ErrorKind::UnknownArgument => flag(words.first()?),
        ErrorKind::MissingRequiredArgument if words.iter().any(|w| w.contains("<INPUT>")) => Some(
            "the recipe comes first, then the scans: bonepd-ct run quick SCAN -o OUT (`bonepd-ct recipe` lists the recipes in the program)".to_owned(),
        ),
        ErrorKind::MissingRequiredArgument if words.iter().any(|w| w.contains("--out")) => {
            Some("say where results go: -o FOLDER".to_owned())
        }
        _ => None,
    }
}

fn flag(word: &str) -> Option<String> {
    let bare = word.trim_start_matches('-');
    let bare = bare.split('=').next().unwrap_or(bare).to_lowercase();
    let bare = bare.replace('_', "-");
    let verb = |name: &str| std::env::args().any(|word| word == name);
    if ["o", "out", "output"].contains(&bare.as_str()) && verb("man") {
        return Some("give the folder itself: bonepd-ct man FOLDER".to_owned());
    }
    if ["o", "out"].contains(&bare.as_str()) {
        return Some("results go into the folder of the segmented scan itself: omit -o".to_owned());
    }
    let (_, meant) = FLAGS
        .iter()
        .find(|(names, _)| names.contains(&bare.as_str()))?;
    Some(format!("use {meant}"))
}
