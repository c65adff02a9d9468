//! Pictures of masks and of plane fields, as PNG and GIF.

pub mod field;
pub mod map;
pub mod picture;
