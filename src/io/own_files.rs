//! Owns the names of the files that `segment` and `solve` leave in a scan's folder, so that they are not taken for scans.

use std::path::Path;

pub const MASK: &str = "mask.nii.gz";
pub const RECORD: &str = "segment.json";
pub const GREY: &str = "grey.nii.gz";
/// The volume of interest, where it is not the whole box.
pub const VOI: &str = "voi.nii.gz";
pub const PICTURE: &str = "segment.png";

/// Whether a file was left by `segment` or `solve` in its folder: no scan, and no slice of one.
pub fn is_result(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let own = [MASK, GREY, VOI, PICTURE].contains(&&*name) || name.starts_with("field-");
    own && path.parent().is_some_and(|dir| dir.join(RECORD).is_file())
}
