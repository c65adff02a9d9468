//! One test program. Each module is one subject.

mod accuracy;
mod apparent;
mod cli;
mod cohort;
mod exports;
mod fields;
mod formats;
mod fuzz;
mod laws;
mod layers;
mod made;
mod molecular;
mod names;
mod order;
mod patch;
mod phantom;
mod pipelines;
mod place;
mod remodelling;
mod scenes;
mod segment;
mod stability;
mod stiffness;
mod stopped;
mod tissue;
mod voxel_fe;
