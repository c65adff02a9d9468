//! Owns which couplings of elasticity and conduction a static scene may have.

use super::{ConductionFile, OUT, Thermal, refuse, refuse_conduction};
use crate::error::Result;

/// # Errors
/// Elasticity and conduction that do not act on each other, or both ways at a time; a rise of temperature from nowhere, or twice.
pub fn check(thermal: Option<&Thermal>, conduction: Option<&ConductionFile>) -> Result<()> {
    if thermal.is_some_and(|t| t.rise.is_some() && t.reference.is_some()) {
        return refuse(
            "elasticity.thermal.reference",
            "a reference temperature and a rise, which is one above it",
            OUT,
        );
    }
    let is_warmed = thermal.is_some_and(|t| t.rise.is_none());
    let Some(conduction) = conduction else {
        return match is_warmed {
            false => Ok(()),
            true => refuse(
                "elasticity.thermal.rise",
                "no temperature rise, and no conduction to take it from",
                "give rise = [T0, dT/dx, dT/dy], or the table of conduction",
            ),
        };
    };
    if conduction.capacity.is_some() {
        return refuse(
            "conduction.capacity",
            "a heat capacity with elasticity, where temperature and potential are steady",
            OUT,
        );
    }
    match (is_warmed, conduction.piezoresistance.is_some()) {
        (false, false) => refuse_conduction(true),
        (true, true) => refuse(
            "conduction.piezoresistance",
            "one conduction for the temperature of elasticity.thermal and for a potential that strain changes",
            "leave one of them out, or give elasticity.thermal.rise",
        ),
        _ => Ok(()),
    }
}
