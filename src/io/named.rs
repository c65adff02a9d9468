//! Owns names of files that stand in other files: manifests, headers, scenes.

use std::path::{Path, PathBuf};

/// The file of this name, as seen from `folder`. Names that Windows wrote (`scans\p01.nii.gz`) are understood everywhere:
/// where there is no such file, backslashes divide folders.
pub fn in_folder(folder: &Path, name: impl AsRef<Path>) -> PathBuf {
    let path = folder.join(&name);
    let divided = name.as_ref().to_str().map(|name| name.replace('\\', "/"));
    let other = divided.map(|name| folder.join(name));
    match other {
        Some(other) if !path.exists() && other.exists() => other,
        _ => path,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backslashes_divide_folders_where_they_are_no_part_of_a_name() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("scans")).unwrap();
        let file = dir.path().join("scans/a.nii");
        std::fs::write(&file, "x").unwrap();
        let found = in_folder(dir.path(), "scans\\a.nii");
        assert_eq!(found.canonicalize().unwrap(), file.canonicalize().unwrap());
        assert_eq!(in_folder(dir.path(), "scans/a.nii"), file);
        let absent = dir.path().join("b\\c.nii");
        assert_eq!(in_folder(dir.path(), "b\\c.nii"), absent);
    }
}
