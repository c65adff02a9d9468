//! Owns what is asked of the machine: its name, the date, free memory, and that freed memory goes back to it.

use crate::system;
pub use crate::system::give_freed_memory_back;

/// Name of this machine, or "unknown".
pub fn name() -> String {
    let name = system::host_name().or_else(|| std::env::var("HOSTNAME").ok());
    name.map(|n| n.trim().to_owned())
        .filter(|n| !n.is_empty())
        .unwrap_or_else(|| "unknown".to_owned())
}

/// Now, in UTC (RFC 3339, seconds).
pub fn date() -> String {
    let now = chrono::DateTime::<chrono::Utc>::from(std::time::SystemTime::now());
    now.format("%Y-%m-%dT%H:%M:%SZ").to_string()
}

/// Memory available without swapping, in MiB. None where the system does not report it (Linux does).
pub fn available_mib() -> Option<f64> {
    system::available_bytes().map(|bytes| bytes / (1024.0 * 1024.0))
}
