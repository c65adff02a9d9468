//! What file formats share: streams of raw voxels, lengths in words, orientation, calibration of grey values.

pub mod calibration;
pub mod length;
pub mod orient;
pub mod raw;
