//! Models and fields as files of other programs, one format a file.

pub mod bins;
pub mod inp;
pub mod lammps;
pub mod points;
pub mod tetrahedra;
pub mod vti;
pub mod vtk;
