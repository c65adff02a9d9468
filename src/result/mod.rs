//! What rows of results say: the row itself, means and limits of several rows, statistics of many.

pub mod answer;
pub mod cautions;
pub mod condition;
pub mod derived;
pub mod details;
pub mod extrapolate;
pub mod ffb;
pub mod load;
pub mod notes;
pub mod row;
pub mod settings;
pub mod shape;
pub mod statistics;
pub mod strength;
pub mod strength_error;
pub mod voxel_check;
