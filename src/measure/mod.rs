//! Numbers drawn from a mask or a solution, as plain records.

pub mod apparent;
pub mod distance;
pub mod extrapolate;
pub mod fabric;
pub mod ffb;
#[cfg(test)]
mod made;
pub mod morphometry;
pub mod pistoia;
pub mod row;
pub mod spheres;
pub mod statistics;
pub mod stiffness;
pub mod thickness;
