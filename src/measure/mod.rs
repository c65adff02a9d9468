//! Numbers drawn from a mask or a solution, as plain records.

pub mod ffb;
pub mod apparent;
pub mod row;
