//! One step of the pipeline per folder: parameters in, plain result out. No files, no clock, no printing.

pub mod apparent;
pub mod lattice;
pub mod phantom;
pub mod segment;
