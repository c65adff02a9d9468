//! Numbers drawn from a mask or a solution, as plain records.

pub mod apparent;
pub mod extrapolate;
pub mod ffb;
pub mod morphometry;
pub mod pistoia;
pub mod row;
pub mod statistics;
pub mod stiffness;
pub mod thickness;
