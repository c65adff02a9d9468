//! Pictures: masks and fields in slices and in three dimensions, plane fields as maps.

pub mod colour_bar;
pub mod field;
mod ink;
pub mod map;
pub mod picture;
mod reduced;
pub mod still;
pub mod view;
