//! Scenes that remodel: bond-based peridynamics with or without growth, and its local twin by finite elements.

mod body;
pub mod bond_based;
pub mod continuum;
pub mod density;
mod loads;
pub mod marcher;
pub mod shear_bonds;
pub mod solver;
mod step_size;
pub mod time_loop;
