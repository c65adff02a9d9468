//! Owns what differs between operating systems: Unix calls, Linux's `/proc`. Everything else of the program is the same
//! on Linux, macOS and Windows; `tests/layers.rs` holds the code to it. What a system does not report is None.

use std::fs::File;

/// Blocks from this size on (bytes) go back to the system when they are freed. The C library's own limit grows to 32 MiB
/// with what a program frees, and vectors below it, freed between others, raised peaks by a third.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const LARGE_BYTES: i32 = 1 << 20;

/// Whether a locked file can still be opened by others, as on Unix. Elsewhere a lock keeps out its own writer, too.
pub const LOCKS_ADVISE: bool = cfg!(unix);

/// To be called once, before anything is allocated.
pub fn give_freed_memory_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: sets a number of the allocator; no thread has been started yet.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
    }
}

/// Name of this machine in the network.
#[cfg(unix)]
pub fn host_name() -> Option<String> {
    let mut name = [0_u8; 256];
    // SAFETY: the pointer is valid for writes of all but the last byte, which stays the zero that ends the name.
    let failed = unsafe { libc::gethostname(name.as_mut_ptr().cast(), name.len() - 1) } != 0;
    let end = name.iter().position(|byte| *byte == 0)?;
    (!failed).then(|| String::from_utf8_lossy(&name[..end]).into_owned())
}

/// Name of this machine in the network.
#[cfg(not(unix))]
pub fn host_name() -> Option<String> {
    std::env::var("COMPUTERNAME").ok()
}

/// The text after `key` in a file of `/proc`, where the system has one.
fn reported(file: &str, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    Some(line.trim().to_owned())
}

/// The number of kB after `key`, in bytes.
fn reported_bytes(file: &str, key: &str) -> Option<f64> {
    let line = reported(file, key)?;
    let kib: f64 = line.trim_end_matches("kB").trim().parse().ok()?;
    Some(1024.0 * kib)
}

/// Memory available without swapping, in bytes.
pub fn available_bytes() -> Option<f64> {
    reported_bytes("/proc/meminfo", "MemAvailable:")
}

/// Starts a new count of [`peak_bytes`]. Only Linux can: elsewhere the peak is of the process's whole life.
pub fn forget_peak() {
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The process's largest resident memory, in bytes.
pub fn peak_bytes() -> Option<f64> {
    // `getrusage` would include the memory of the program that started this one.
    reported_bytes("/proc/self/status", "VmHWM:").or_else(peak_of_usage)
}

#[cfg(unix)]
fn peak_of_usage() -> Option<f64> {
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
fn peak_of_usage() -> Option<f64> {
    None
}

/// At Ctrl-C the program says `words` on stderr and ends at once with exit code `code`; without Unix signals it only ends.
#[cfg(unix)]
pub fn at_interrupt(words: &'static str, code: i32) {
    use std::sync::OnceLock;
    static LAST: OnceLock<(&str, i32)> = OnceLock::new();
    extern "C" fn stop(_: libc::c_int) {
        let (words, code) = LAST.get().copied().unwrap_or(("", 1));
        // SAFETY: `write` and `_exit` may be called in a signal handler; the text is static.
        unsafe {
            libc::write(libc::STDERR_FILENO, words.as_ptr().cast(), words.len());
            libc::_exit(code);
        }
    }
    LAST.get_or_init(|| (words, code));
    let handler: extern "C" fn(libc::c_int) = stop;
    // SAFETY: the handler calls only what a signal handler may, and reads what has been written once.
    unsafe {
        libc::signal(libc::SIGINT, handler as libc::sighandler_t);
    }
}

/// At Ctrl-C the system ends the program.
#[cfg(not(unix))]
pub fn at_interrupt(_: &'static str, _: i32) {}

/// Temporary files are private (0600); this gives them what a plain `create` would have given: 0666 less the umask.
#[cfg(unix)]
pub fn readable_by_all(file: &File) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    use std::sync::OnceLock;
    static UMASK: OnceLock<u32> = OnceLock::new();
    let umask = *UMASK.get_or_init(umask);
    file.set_permissions(std::fs::Permissions::from_mode(0o666 & !umask))
}

/// The process's umask. Linux reports it; elsewhere it can only be read by setting it, so the usual 022 is assumed.
#[cfg(unix)]
fn umask() -> u32 {
    reported("/proc/self/status", "Umask:")
        .and_then(|word| u32::from_str_radix(&word, 8).ok())
        .unwrap_or(0o022)
}

/// Files have no permissions of this kind.
#[cfg(not(unix))]
pub fn readable_by_all(_: &File) -> std::io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_proc_nothing_is_reported() {
        assert_eq!(reported_bytes("/no/proc/meminfo", "MemAvailable:"), None);
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("status");
        std::fs::write(&file, "Name:\tx\nUmask:\t0027\nVmHWM:\t    2048 kB\n").unwrap();
        let file = file.to_str().unwrap();
        assert_eq!(reported(file, "Umask:").as_deref(), Some("0027"));
        assert_eq!(reported_bytes(file, "VmHWM:"), Some(2_097_152.0));
        assert_eq!(reported_bytes(file, "VmRSS:"), None);
    }

    #[cfg(unix)]
    #[test]
    fn a_peak_is_known_without_proc() {
        let mib = peak_of_usage().unwrap() / f64::from(1 << 20);
        assert!((1.0..1e6).contains(&mib), "{mib} MiB");
        assert!(!host_name().unwrap().is_empty());
    }
}
