//! Files: one format a file.

pub mod atomic;
pub mod table;
