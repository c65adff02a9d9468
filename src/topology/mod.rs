//! Who touches whom, without any moduli: lattice sites, voxel meshes, families of points.

pub mod placement;
pub mod sites;
pub mod stencil;
