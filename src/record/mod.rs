//! What the program keeps on disk and reads back: segmented scans, results, stiffness, states and histories of scenes.

pub mod failures;
pub mod history;
pub mod missed;
pub mod results;
pub mod solved;
pub mod specimen;
pub mod state;
pub mod stiffness;
