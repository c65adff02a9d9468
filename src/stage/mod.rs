//! One step of the pipeline per file: parameters in, plain result out. No files, no clock, no printing.

pub mod lattice;
pub mod molecular;
pub mod phantom;
pub mod report;
pub mod scene;
pub mod segment;
pub mod solve;
