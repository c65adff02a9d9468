//! Owns the clock and the memory meter.

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
            // Linux forgets the peak on this word; elsewhere the peak is of the process's whole life.
            let _ = std::fs::write("/proc/self/clear_refs", "5");
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
        let bytes = from_status().or_else(peak_bytes);
        bytes.map(|b| b / (1024.0 * 1024.0))
    }
}

/// As Linux reports it. `getrusage` would include the memory of the program that started this one.
fn from_status() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024.0 * kib)
}

#[cfg(unix)]
fn peak_bytes() -> Option<f64> {
    let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
    // SAFETY: the pointer is valid for writes of one `rusage`, and all-zero bytes are a valid `rusage`.
    let usage = unsafe {
        if libc::getrusage(libc::RUSAGE_SELF, usage.as_mut_ptr()) != 0 {
            return None;
        }
        usage.assume_init()
    };
    // Linux counts in KiB, Apple's systems in bytes.
    let unit = if cfg!(target_vendor = "apple") {
        1.0
    } else {
        1024.0
    };
    Some(usage.ru_maxrss as f64 * unit)
}

#[cfg(not(unix))]
fn peak_bytes() -> Option<f64> {
    None
}
