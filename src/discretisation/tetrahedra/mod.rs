//! Tetrahedra that fill a smooth surface: isosurface stuffing (Labelle & Shewchuk 2007, doi 10.1145/1275808.1276448).
//!
//! A body-centred cubic lattice covers the box. Its vertices near the surface move onto it, the others' tetrahedra are cut
//! where the surface crosses their edges. The box's faces are planes of the lattice, so that bone cut by them ends flat.

pub mod fill;
pub mod fit;
pub mod lattice;
pub mod mesh;
pub mod nodes;
pub mod pieces;
pub mod quality;
pub mod snap;
pub mod stencils;
pub mod surface;
