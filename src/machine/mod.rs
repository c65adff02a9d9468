//! The terminal, the threads, the clock and the memory of the machine a command runs on.

pub mod host;
pub mod interrupt;
pub mod log;
pub mod meter;
pub mod session;
