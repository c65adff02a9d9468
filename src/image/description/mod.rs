//! What programs write into the description of an image file: text that tells sizes and meaning of voxels.

pub mod imagej;
pub mod ome;
