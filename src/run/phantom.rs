//! Owns `phantom` on disk: a synthetic scan as an image file, or as a folder of TIFF slices.

use crate::error::Result;
use crate::run::not_available;
use crate::run::session::Session;
use std::path::Path;

/// What a phantom is made from.
#[derive(Debug, Clone)]
pub struct PhantomParams {
    pub size_mm: [f64; 3],
    pub spacing_mm: f64,
    /// Bone volume over total volume, between 0 and 1.
    pub bvtv: f64,
    pub seed: u64,
}

/// Writes the phantom to `file`.
pub fn phantom(_file: &Path, _params: &PhantomParams, _session: &Session) -> Result<()> {
    Err(not_available("phantom"))
}
