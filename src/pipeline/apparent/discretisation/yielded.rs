//! Owns what load steps leave: the body at their end, and what is kept of them from one call of a command to the next.

use super::steps::History;
use crate::error::Result;
use crate::result::strength::Yielding;

/// A body at the end of its load steps.
pub struct Yielded {
    /// Displacements of all sites, in mm.
    pub u: Vec<[f64; 3]>,
    /// Nodal forces, N.
    pub force: Vec<[f64; 3]>,
    /// Equivalent plastic strain of the elements that have flowed, by index in the mesh's grid, rising.
    pub plastic: Vec<(usize, f32)>,
    /// Its stress-strain curve and what has flowed.
    pub yielding: Yielding,
    /// Of conjugate gradients, in all steps.
    pub iterations: usize,
}

/// Where load steps are kept.
pub trait Kept {
    /// What an earlier call left.
    fn resume(&mut self) -> Option<History>;
    /// Called at the end of each step.
    ///
    /// # Errors
    /// Steps that cannot be kept.
    fn keep(&mut self, history: &History) -> Result<()>;
}

/// Steps that nobody keeps.
pub struct NotKept;

impl Kept for NotKept {
    fn resume(&mut self) -> Option<History> {
        None
    }

    fn keep(&mut self, _: &History) -> Result<()> {
        Ok(())
    }
}
