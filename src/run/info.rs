//! Owns `info`: what is known of a scan, without segmenting it.

use crate::error::Result;
use crate::run::not_available;
use serde::Serialize;
use std::path::Path;

/// What a scan's header says.
#[derive(Debug, Clone, Serialize)]
pub struct ScanInfo {
    /// One line per fact, for people.
    pub lines: Vec<String>,
}

pub fn info(_file: &Path) -> Result<ScanInfo> {
    Err(not_available("info"))
}
