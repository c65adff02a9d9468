//! Recipes on real scans: each verb of the program is one function here, from paths and settings to files.

pub mod adaptive;
#[doc(hidden)]
pub mod answer;
pub mod estimate;
mod fields;
#[doc(hidden)]
pub mod in_words;
pub mod info;
mod ladder;
pub mod lattice;
pub mod phantom;
pub mod report;
#[doc(hidden)]
pub mod run_settings;
pub mod scene;
pub mod segment;
pub mod solve;
#[doc(hidden)]
pub mod stiffness;

/// How a command ended when nothing stopped it. Everything else is an [`crate::error::Error`] (exit 2).
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Everything that was asked for is done (exit 0).
    Done,
    /// Results are written, their rows marked.
    NotConverged,
    /// Names of the scans that failed; the others are done.
    SomeFailed(Vec<String>),
}
