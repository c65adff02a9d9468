//! Pictures of masks and of plane fields, as PNG and GIF.

pub mod map;
pub mod picture;
