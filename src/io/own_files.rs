//! Owns the names of the files that commands leave in a scan's folder and in that of a run, so that they are not taken for scans.

use std::path::Path;

pub const MASK: &str = "mask.nii.gz";
pub const RECORD: &str = "segment.json";
pub const GREY: &str = "grey.nii.gz";
/// The volume of interest, where it is not the whole box.
pub const VOI: &str = "voi.nii.gz";
pub const PICTURE: &str = "segment.png";
/// The bone in three dimensions.
pub const STILL: &str = "bone.png";
/// The same, to turn in a browser.
pub const VIEW: &str = "view.html";
/// Sites of the coarsest lattices over the bone.
pub const SITES: &str = "sites.png";
/// Rows of all solves, of a scan and of a run.
pub const RESULTS: &str = "results.csv";
/// One line a scan of a run.
pub const ANSWERS: &str = "answers.csv";
/// Scans of a run that have no results.
pub const FAILED: &str = "failed.csv";
/// The settings of a run, and those that it replaced.
pub const RECIPE: &str = "recipe.toml";
pub const OLD_RECIPE: &str = "recipe.old.toml";

/// Whether a file was left by `segment` or `solve` in its folder: no scan, and no slice of one.
pub fn is_result(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let own =
        [MASK, GREY, VOI, PICTURE, STILL, SITES].contains(&&*name) || name.starts_with("field-");
    own && path.parent().is_some_and(|dir| dir.join(RECORD).is_file())
}
