//! Owns one scan of a run: where it is, how it is segmented, and the group it belongs to.

use crate::pipeline::segment::SegmentParams;
use std::path::PathBuf;

/// One scan of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanJob {
    /// Unique in the run; names its folder and its rows.
    pub name: String,
    /// Path of the scan: a file, or a folder of slices.
    pub input: PathBuf,
    /// Settings of its segmentation: the recipe's, with what the manifest says of this scan.
    pub segment: SegmentParams,
    /// From a manifest, for statistics.
    pub group: Option<String>,
    /// From a manifest: who the scan is of.
    pub subject: Option<String>,
}
