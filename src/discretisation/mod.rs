//! Who touches whom, without any moduli: lattices, voxel meshes, points of a plane.

pub mod lattice;
pub mod plane;
pub mod voxels;
