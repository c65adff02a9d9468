//! One test program. Each module is one subject.

mod cli;
mod cohort;
mod laws;
mod layers;
mod patch;
mod remodelling;
mod phantom;
mod segment;
mod voxel_fe;
