//! Energies and the forces that follow from them. No physics imports another, or a solver.

pub mod hex8;
pub mod lattice;
//! Energies and forces, one folder or file a physics. No physics imports another, and none knows a solver.

pub mod anisotropic;
pub mod lattice;
