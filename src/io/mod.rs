//! Files: one format a file. [`scan`] is the way in, [`specimen`] the segmented scan on disk, [`atomic`] the way out.

pub mod aim;
pub mod atomic;
pub mod bitmap;
pub mod dicom;
mod dicom_lengths;
pub mod extent;
pub mod html;
pub mod isq;
pub mod lammps;
pub mod markdown;
pub mod metaimage;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod orient;
pub mod picture;
pub mod plot;
pub mod raw;
pub mod scan;
pub mod scanco;
pub mod slices;
pub mod specimen;
pub mod stiffness;
pub mod table;
pub mod tiff;
pub mod vtk;
