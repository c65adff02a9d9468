//! Files: one format a file.

pub mod atomic;
pub mod lammps;
pub mod table;
pub mod vtk;
