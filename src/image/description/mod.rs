//! What programs write into the description of an image file: text that gives the size and the meaning of voxels.

pub mod imagej;
pub mod ome;
