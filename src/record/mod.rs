//! What the program keeps on disk and reads back: segmented scans, results, stiffness, states and histories of scenes.

pub mod answer;
pub mod collect_rows;
pub mod column;
pub mod columns;
pub mod detail_columns;
pub mod details;
pub mod error_target_note;
pub mod failures;
pub mod history;
pub mod in_vivo;
pub mod results;
pub mod specimen;
pub mod state;
pub mod stiffness;
