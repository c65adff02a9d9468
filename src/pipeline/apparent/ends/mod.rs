//! The ends of a specimen: how they move, and what the supports put on them.

pub mod motion;
pub mod reactions;
pub mod supports;
