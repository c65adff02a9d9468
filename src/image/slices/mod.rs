//! Owns folders of slices: which files belong, in which order, and their assembly into one volume.

pub mod bitmap;
pub mod series;

use crate::error::{Error, Result};
use crate::image::slices::series::Series;
use crate::image::stored::{Slice, Stored, spacing};
use crate::image::{dicom, raw, tiff};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Files of a folder that are slices of one scan, in order: DICOM's by their names (`s2` before `s10`; their positions decide
/// later), others by the number in the name.
///
/// # Errors
/// No slices, several kinds of them, several series, missing slices.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    Ok(listed(folder)?.files)
}

fn listed(folder: &Path) -> Result<Series> {
    let unreadable = |e: std::io::Error| {
        Error::file(
            folder,
            format!("cannot be listed: {e}"),
            "check the folder and its permissions",
        )
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        if path.is_file() && kind(&path).is_some() {
            found.push(path);
        }
    }
    found.sort_by(|a, b| natural(&file_name(a), &file_name(b)));
    let kinds: std::collections::BTreeSet<_> = found.iter().filter_map(|p| kind(p)).collect();
    if kinds.len() > 1 {
        return Err(Error::file(
            folder,
            format!(
                "holds slices of several kinds ({})",
                kinds.into_iter().collect::<Vec<_>>().join(", ")
            ),
            "keep one scan of one kind in a folder",
        ));
    }
    if found.is_empty() {
        return Err(Error::file(
            folder,
            "holds no slices",
            "give a folder of slices (TIFF, PNG, BMP or DICOM), or a scan file",
        ));
    }
    match kind(&found[0]) {
        Some("dcm") => Ok(Series {
            files: found,
            step: 1,
        }),
        _ => series::ordered(folder, found),
    }
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}

/// Whether a file is taken for a slice, by its name or, for DICOM, its first bytes.
pub fn is_slice(path: &Path) -> bool {
    path.is_file() && kind(path).is_some()
}

/// The kind of slice a file is: by its name, DICOM also by its first bytes. Hidden files and the scanner's previews
/// (`_spr`) are none.
fn kind(path: &Path) -> Option<&'static str> {
    let name = file_name(path).to_lowercase();
    let stem = name
        .rsplit_once('.')
        .map_or(name.as_str(), |(stem, _)| stem);
    if name.starts_with('.') || stem.ends_with("_spr") {
        return None;
    }
    let by_name = [
        ("tif", ".tif"),
        ("tif", ".tiff"),
        ("png", ".png"),
        ("bmp", ".bmp"),
        ("dcm", ".dcm"),
        ("dcm", ".dicom"),
        ("dcm", ".ima"),
    ];
    let found = by_name
        .into_iter()
        .find_map(|(kind, end)| name.ends_with(end).then_some(kind));
    found.or_else(|| dicom::is_dicom(path).then_some("dcm"))
}

/// Order of names in which runs of digits compare as numbers.
pub fn natural(a: &str, b: &str) -> std::cmp::Ordering {
    let (mut a, mut b) = (a.as_bytes(), b.as_bytes());
    loop {
        let digits = |s: &[u8]| s.iter().take_while(|c| c.is_ascii_digit()).count();
        match (digits(a), digits(b)) {
            (0, _) | (_, 0) => match (a.split_first(), b.split_first()) {
                (Some((x, rest_a)), Some((y, rest_b))) if x == y => (a, b) = (rest_a, rest_b),
                _ => return a.cmp(b),
            },
            (p, q) => {
                let trim = |s: &[u8]| s.iter().take_while(|&&c| c == b'0').count();
                let (x, y) = (&a[trim(&a[..p])..p], &b[trim(&b[..q])..q]);
                let order = x.len().cmp(&y.len()).then_with(|| x.cmp(y)).then(p.cmp(&q));
                if order != std::cmp::Ordering::Equal {
                    return order;
                }
                (a, b) = (&a[p..], &b[q..]);
            }
        }
    }
}

/// Reads a folder as one scan.
pub fn read(folder: &Path) -> Result<Stored> {
    let Series { files, step } = listed(folder)?;
    match (kind(&files[0]), files.as_slice()) {
        (Some("dcm"), _) => return dicom::read(folder, &files),
        (Some("tif"), [only]) => return tiff::read(only),
        _ => {}
    }
    let first = decode(&files[0])?;
    let (nx, ny, nz) = (first.width, first.height, files.len());
    let plane = nx * ny;
    let mut values = Vec::new();
    values
        .try_reserve_exact(plane.saturating_mul(nz))
        .map_err(|_| {
            Error::file(
                folder,
                format!("{nx} × {ny} × {nz} voxels do not fit in this machine's memory"),
                "use a machine with more memory, or fewer slices",
            )
        })?;
    values.resize(plane * nz, 0.0f32);
    values.par_chunks_mut(plane).zip(&files).enumerate().try_for_each(|(k, (out, file))| {
        let slice = if k == 0 { first.clone() } else { decode(file)? };
        if (slice.width, slice.height) != (nx, ny) {
            return Err(Error::file(
                file,
                format!(
                    "slice of {} × {} pixels in a scan whose first slice ({}) has {nx} × {ny}",
                    slice.width,
                    slice.height,
                    file_name(&files[0])
                ),
                "remove what is no slice of this scan from the folder, or export the slice again",
            ));
        }
        out.copy_from_slice(&slice.values);
        Ok(())
    })?;
    let mut notes = first.grey.notes();
    if step > 1 {
        notes.push(format!(
            "the slices' numbers go in steps of {step}: if slices were left out, their distance is larger than in the scanner (--spacing)"
        ));
    }
    let mut spacing_mm = spacing(&first, &mut notes);
    if spacing_mm.is_none()
        && let Some(mm) = logged_pixel_mm(folder)
    {
        notes.push(format!(
            "voxel size {mm} mm from the reconstruction log beside the slices"
        ));
        spacing_mm = Some([mm; 3]);
    }
    Ok(Stored {
        format: format!(
            "{nz} slices ({}), {}",
            kind(&files[0]).unwrap_or("?"),
            first.stored_as
        ),
        n: [nx, ny, nz],
        values,
        spacing_mm,
        unit: first.grey.unit(),
        notes,
        ..Stored::default()
    })
}

fn decode(file: &Path) -> Result<Slice> {
    match kind(file) {
        Some("png" | "bmp") => bitmap::read_slice(file),
        _ => tiff::read_slice(file),
    }
}

/// Voxel size in a reconstruction log (SkyScan's NRecon: `Pixel Size (um)=17.4`) beside the slices; the last one counts.
fn logged_pixel_mm(folder: &Path) -> Option<f64> {
    let logs = std::fs::read_dir(folder)
        .ok()?
        .filter_map(|e| e.ok())
        .map(|e| e.path());
    let mut logs: Vec<PathBuf> = logs
        .filter(|p| file_name(p).to_lowercase().ends_with(".log"))
        .collect();
    logs.sort();
    let text = raw::head(logs.first()?, 1 << 20).ok()?;
    let text = String::from_utf8_lossy(&text);
    let mut sizes = text.lines().filter_map(|line| {
        line.trim()
            .split_once("Pixel Size (um)=")?
            .1
            .trim()
            .parse::<f64>()
            .ok()
    });
    sizes
        .rfind(|v| v.is_finite() && *v > 0.0)
        .map(|um| um / 1000.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_compare_as_numbers() {
        let mut names = [
            "s10.tif", "s9.tif", "s010.tif", "s1.tif", "t1", "s2b3", "s2b20",
        ];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(
            names,
            [
                "s1.tif", "s2b3", "s2b20", "s9.tif", "s10.tif", "s010.tif", "t1"
            ]
        );
    }

    #[test]
    fn a_folder_without_slices_says_so() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("notes.txt"), "x").unwrap();
        assert!(
            files(dir.path())
                .unwrap_err()
                .to_string()
                .contains("no slices")
        );
    }
}
