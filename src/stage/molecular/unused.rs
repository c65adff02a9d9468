//! Owns the refusal of physics that a scene names but none of its solutions would use.

use super::Molecular;
use crate::error::{Error, Result};

/// # Errors
/// Tables of `[physics.continuum-molecular]` that do not act on each other.
pub fn refuse(model: &Molecular) -> Result<()> {
    let [elastic, conducting] = [model.elasticity.is_some(), model.conduction.is_some()];
    let [breaking, vibrating] = [model.fracture.is_some(), model.vibration.is_some()];
    let (found, advice) = if !elastic && (breaking || vibrating) {
        (
            "fracture or vibration without elasticity",
            "add the table of elasticity",
        )
    } else if breaking && vibrating {
        (
            "both fracture and vibration",
            "keep one, or make two scenes",
        )
    } else if elastic && conducting && !breaking {
        (
            "elasticity and conduction without fracture, which do not act on each other",
            "make two scenes, or add the table of fracture: broken bonds stop conducting",
        )
    } else {
        return Ok(());
    };
    Err(Error::setting(
        "physics.continuum-molecular",
        format!("found {found}"),
        advice,
    ))
}
