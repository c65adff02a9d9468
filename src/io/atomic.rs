//! Owns the writing of whole files: a temporary file in the same folder, synced, then renamed. A reader never meets
//! half a file, and a failed write leaves nothing behind. What a killed program left is known by its name and by no one
//! holding its lock: [`sweep`] clears it away.

use crate::error::{Error, Result};
use crate::system;
use std::io::{BufWriter, Write};
use std::path::Path;
use tempfile::NamedTempFile;

const PREFIX: &str = ".writing-";

/// Writes `path` through `fill`. Folders on the way are created.
pub fn write_with(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> std::io::Result<()>,
) -> Result<()> {
    try_write(path, fill).map_err(|e| unwritable(path, e))
}

/// Writes `bytes` to `path`.
pub fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<()> {
    write_with(path, |out| out.write_all(bytes.as_ref()))
}

/// Creates a folder and its parents.
pub fn create_dir(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(|e| unwritable(path, e))
}

fn unwritable(path: &Path, e: std::io::Error) -> Error {
    use std::io::ErrorKind::{QuotaExceeded, StorageFull};
    if [StorageFull, QuotaExceeded].contains(&e.kind()) {
        return Error::file(
            path,
            "cannot be written: the disk is full, or your quota is",
            "free some space and give the same command again: what is finished is kept, and it goes on from there",
        )
        .caused_by(e);
    }
    Error::file(
        path,
        format!("cannot be written: {e}"),
        "check that the folder exists, is writable and has space left, or choose another output",
    )
    .caused_by(e)
}

fn try_write(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut std::fs::File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let dir = match path.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(dir)?;
    let mut file = temporary(dir)?;
    let mut out = BufWriter::with_capacity(1 << 20, file.as_file_mut());
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    persist(file, path)
}

/// A temporary file of `dir`, locked as long as its writer lives (on Unix; elsewhere a lock keeps out its own writer, too).
fn temporary(dir: &Path) -> std::io::Result<NamedTempFile> {
    loop {
        let mut builder = tempfile::Builder::new();
        let file = builder.prefix(PREFIX).tempfile_in(dir)?;
        // File systems without locks also refuse them to `sweep`.
        if system::LOCKS_ADVISE {
            let _ = file.as_file().lock();
        }
        // Swept before it was locked: another.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// Removes what writers that were killed have left in `dir`; files that are being written stay.
pub fn sweep(dir: &Path) {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let left = entries.filter(|e| e.file_name().to_string_lossy().starts_with(PREFIX));
    for path in left.map(|entry| entry.path()) {
        if system::LOCKS_ADVISE
            && let Ok(file) = std::fs::File::open(&path)
            && file.try_lock().is_ok()
        {
            let _ = std::fs::remove_file(&path);
        }
    }
}

/// Syncs a finished temporary file (of the same folder) and gives it its name.
fn persist(file: NamedTempFile, path: &Path) -> std::io::Result<()> {
    system::readable_by_all(file.as_file())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_keeps_the_old_file_and_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep/result.csv");
        write(&path, "old").unwrap();
        let failed = write_with(&path, |out| {
            out.write_all(b"half of the new")?;
            Err(std::io::Error::other("disk on fire"))
        });
        assert!(failed.unwrap_err().to_string().contains("disk on fire"));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
        let names = std::fs::read_dir(path.parent().unwrap()).unwrap().count();
        assert_eq!(names, 1);
    }

    #[test]
    fn what_a_killed_writer_left_is_swept_what_is_being_written_stays() {
        let dir = tempfile::tempdir().unwrap();
        let left = dir.path().join(".writing-Ab3xYz");
        std::fs::write(&left, "half a table").unwrap();
        std::fs::write(dir.path().join(".hidden"), "of the user").unwrap();
        let mut living = temporary(dir.path()).unwrap();
        sweep(dir.path());
        assert!(!left.exists() && living.path().exists());
        living.write_all(b"whole").unwrap();
        let path = dir.path().join("whole");
        persist(living, &path).unwrap();
        sweep(dir.path());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "whole");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn results_are_not_private_to_their_writer() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r");
        write(&path, "x").unwrap();
        let plain = dir.path().join("p");
        std::fs::write(&plain, "x").unwrap();
        let mode = |p: &Path| std::fs::metadata(p).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&path), mode(&plain));
    }
}
