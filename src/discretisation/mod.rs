//! Who touches whom, without any moduli: lattices, voxel meshes, tetrahedra, points of a plane.

pub mod lattice;
pub mod plane;
pub mod tetrahedra;
pub mod voxels;
