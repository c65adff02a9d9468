//! Numbers drawn from a mask or a solution, as plain records.

pub mod apparent;
pub mod distance;
pub mod distribution;
pub mod edge_blur;
pub mod fabric;
pub mod load_history;
pub mod morphometry;
pub mod pistoia;
pub mod principal;
#[cfg(test)]
mod specimens;
pub mod spheres;
pub mod stiffness;
pub mod surface_energy;
pub mod thickness;
pub mod zysset_curnier;
