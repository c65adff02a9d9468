//! The ends of a specimen: how they move, and what the supports put on them.

pub mod by_label;
pub mod label_image;
pub mod motion;
pub mod pieces;
pub mod reactions;
pub mod rigid;
pub mod supports;
pub mod uneven;
