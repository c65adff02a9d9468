//! Owns `segment` on disk: a scan in, `mask.nii.gz`, `segment.json` and `segment.png` out, and reading them back.

use crate::error::Result;
use crate::run::not_available;
use crate::run::session::Session;
use crate::stage::segment::SegmentParams;
use crate::volume::Specimen;
use serde::Serialize;
use std::path::Path;

/// What `--json` prints and `segment.json` holds.
#[derive(Debug, Clone, Serialize)]
pub struct SegmentSummary {}

/// Segments `input` (a file, or a folder of slices) into `dir`.
pub fn segment(
    _input: &Path,
    _dir: &Path,
    _params: &SegmentParams,
    _session: &Session,
) -> Result<SegmentSummary> {
    Err(not_available("segment"))
}

/// The specimen that `segment` left in `dir`.
pub fn load(_dir: &Path) -> Result<Specimen> {
    Err(not_available("reading a segmented scan"))
}
