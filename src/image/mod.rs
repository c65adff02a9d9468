//! Scan readers, one format a file. [`scan`] is the one way in. They know volumes, grids and errors only.

pub mod bitmap;
pub mod dicom;
pub mod extent;
pub mod metaimage;
pub mod nifti;
pub mod npy;
pub mod nrrd;
pub mod orient;
pub mod raw;
pub mod scan;
pub mod scanco;
pub mod series;
pub mod slices;
pub mod tiff;
