//! Owns the question whether a solve fits into memory: a solve asks, the machine answers.

use crate::error::Result;
use crate::pipeline::apparent::discretisation::{Cost, Discretisation, Known, Prepared};
use crate::pipeline::apparent::params::SolveParams;

/// The memory that a solve may take.
pub trait Memory {
    /// Whether there is so much memory for this many bytes that they need not be counted exactly.
    fn surely_holds(&self, bytes: f64) -> bool;

    /// Refuses a solve that takes more than there is.
    ///
    /// # Errors
    /// With what the solve needs, and what to change.
    fn refuse(&self, cost: &Cost) -> Result<()>;
}

/// Memory without a limit.
pub struct Unlimited;

impl Memory for Unlimited {
    fn surely_holds(&self, _: f64) -> bool {
        true
    }

    fn refuse(&self, _: &Cost) -> Result<()> {
        Ok(())
    }
}

/// The cost of a solve, its bytes counted in the bone; and the model, where counting is building it.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn counted<D: Discretisation>(
    case: &D::Case,
    prepared: Prepared,
    params: &SolveParams,
) -> Result<(Cost, Option<D>)> {
    let cost = D::cost(case, params, Known::Bone(prepared))?;
    let (bytes, model) = D::count(case, prepared, params)?;
    let bytes = [bytes; 2];
    Ok((Cost { bytes, ..cost }, model))
}

/// Refuses what does not fit. The model, where that had to be counted and counting is building it.
///
/// # Errors
/// A solve that takes more memory than there is, settings that do not fit the specimen.
pub fn fitting<D: Discretisation>(
    case: &D::Case,
    prepared: Prepared,
    params: &SolveParams,
    memory: &dyn Memory,
) -> Result<Option<D>> {
    let cost = D::cost(case, params, Known::Bone(prepared))?;
    let [least, most] = cost.bytes;
    // Counting takes time, and memory on lattices.
    if memory.surely_holds(most) {
        return Ok(None);
    }
    let bytes = [least; 2];
    memory.refuse(&Cost { bytes, ..cost })?;
    let (cost, model) = counted(case, prepared, params)?;
    memory.refuse(&cost)?;
    Ok(model)
}
