//! Owns the clock and the memory meter.

use crate::system;
use std::time::Instant;

/// Wall time and the process's memory peak since its start.
pub struct Meter {
    since: Instant,
    shares_process: bool,
}

impl Meter {
    /// `shares_process`: other scans are worked on at the same time.
    pub fn start(shares_process: bool) -> Self {
        if !shares_process {
            system::forget_peak();
        }
        Meter {
            since: Instant::now(),
            shares_process,
        }
    }

    /// Seconds since the start.
    pub fn wall_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// The largest resident memory in MiB. None where the system does not report it, and where several scans share the process.
    pub fn peak_mib(&self) -> Option<f64> {
        if self.shares_process {
            return None;
        }
        system::peak_bytes().map(|b| b / (1024.0 * 1024.0))
    }
}
