//! What file formats share: headers of text, streams of raw voxels, packed strips, lengths in words, orientation, calibration of grey values.

pub mod calibration;
pub mod header;
pub mod length;
pub mod orient;
pub mod raw;
pub mod strips;
