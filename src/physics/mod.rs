//! Energies and the forces that follow from them. No physics imports another, or a solver.

pub mod bond_based;
pub mod continuum;
pub mod continuum_molecular;
pub mod growth;
pub mod hex8;
pub mod hyperelastic;
pub mod lattice;
pub mod material;
pub mod plasticity;
pub mod tet10;
