//! Owns the rows that follow from others: means of floppy and firm, limits of several resolutions, checked by voxel FE.

use crate::result::extrapolate::with_extrapolated;
use crate::result::ffb::with_ffb;
use crate::result::row::Row;
use crate::result::voxel_check;

/// The rows with those that follow from them, in their places. Rows of voxel FE among `known`, which may hold more of the same
/// scan, are witnesses against them.
pub fn with_derived(rows: &[Row], known: &[Row]) -> Vec<Row> {
    let mut all = with_extrapolated(&with_ffb(rows, known));
    voxel_check::check_limits(&mut all, known);
    all
}
