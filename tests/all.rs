//! One test program. Each module is one subject.

mod cli;
mod laws;
mod layers;
mod patch;
mod remodelling;
mod phantom;
mod segment;
