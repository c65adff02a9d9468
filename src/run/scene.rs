//! Owns `scene` on disk: a two-dimensional pair-potential scene file in, results and pictures out.

use crate::error::Result;
use crate::run::session::Session;
use crate::run::{Outcome, not_available};
use std::path::Path;

pub fn scene(_scene: &Path, _out: &Path, _session: &Session) -> Result<Outcome> {
    Err(not_available("scene"))
}
