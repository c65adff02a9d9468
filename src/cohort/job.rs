//! Owns one scan of a run: where it is, how it is segmented, and the group it belongs to.

use crate::pipeline::segment::SegmentParams;
use std::path::PathBuf;

/// One scan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanJob {
    /// Unique in the run; names its folder and its rows.
    pub name: String,
    pub input: PathBuf,
    pub segment: SegmentParams,
    /// From a manifest, for statistics.
    pub group: Option<String>,
    pub subject: Option<String>,
}
