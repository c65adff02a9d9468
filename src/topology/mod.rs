//! Who touches whom, without any moduli: lattice sites, voxel meshes, families of points.

pub mod dissection;
pub mod family;
pub mod layers;
pub mod loaded;
pub mod marks;
pub mod neighbours;
pub mod outline;
pub mod pieces;
pub mod placement;
pub mod plane;
pub mod sites;
pub mod stencil;
pub mod tissue;
pub mod voxels;
