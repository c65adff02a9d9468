//! Scan readers, one format a file. [`scan`] is the one way in. They know volumes, grids and errors only.

pub mod array;
pub mod description;
pub mod dicom;
pub mod extent;
pub mod metaimage;
pub mod nifti;
pub mod nrrd;
pub mod scan;
pub mod scanco;
pub mod slices;
pub mod stored;
pub mod tiff;
