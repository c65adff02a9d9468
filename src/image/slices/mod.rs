//! Owns folders of slices: which files belong, in which order, and their assembly into one volume.

pub mod bitmap;
pub mod series;
pub mod skyscan;

use crate::error::{Error, Result};
use crate::image::slices::series::Series;
use crate::image::stored::{Slice, Stored, spacing};
use crate::image::{dicom, tiff};
use crate::io::own_files;
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
        return Err(no_slices(folder));
    }
    match kind(&found[0]) {
        Some("dcm") => Ok(Series {
            files: found,
            step: 1,
        }),
        _ => series::ordered(folder, found),
    }
}

fn no_slices(folder: &Path) -> Error {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let jpeg = entries
        .map(|e| file_name(&e.path()).to_lowercase())
        .any(|name| name.ends_with(".jpg") || name.ends_with(".jpeg"));
    if jpeg {
        return Error::file(
            folder,
            "holds JPEG pictures, whose compression changes grey values: they are not read as slices",
            "export the slices from the reconstruction as TIFF, PNG or BMP",
        );
    }
    Error::file(
        folder,
        "holds no slices",
        "give a folder of slices (TIFF, PNG, BMP or DICOM), or a scan file",
    )
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
    if name.starts_with('.') || stem.ends_with("_spr") || own_files::is_result(path) {
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
    let values = assembled(folder, &files, &first)?;
    let n = [first.width, first.height, files.len()];
    let mut notes = first.notes.clone();
    notes.extend(first.grey.notes());
    let spacing_mm = size(folder, &files[0], step, &first, n, &mut notes);
    Ok(Stored {
        format: format!(
            "{} slices ({}), {}",
            n[2],
            kind(&files[0]).unwrap_or("?"),
            first.stored_as
        ),
        n,
        values,
        spacing_mm,
        unit: first.grey.unit(),
        notes,
        ..Stored::default()
    })
}

fn assembled(folder: &Path, files: &[PathBuf], first: &Slice) -> Result<Vec<f32>> {
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
    let planes = values.par_chunks_mut(plane).zip(files).enumerate();
    planes.try_for_each(|(k, (out, file))| {
        if k == 0 {
            out.copy_from_slice(&first.values);
            return Ok(());
        }
        let slice = decode(file)?;
        same_kind(first, &slice, &files[0], file)?;
        out.copy_from_slice(&slice.values);
        Ok(())
    })?;
    Ok(values)
}

/// Whether two slices can be of one scan.
fn same_kind(first: &Slice, slice: &Slice, first_file: &Path, file: &Path) -> Result<()> {
    let first_name = file_name(first_file);
    let wrong = |found: String| {
        Err(Error::file(
            file,
            found,
            "remove what is no slice of this scan from the folder, or export the slice again",
        ))
    };
    let [(nx, ny), (mx, my)] = [first, slice].map(|s| (s.width, s.height));
    if (nx, ny) != (mx, my) {
        return wrong(format!(
            "slice of {mx} × {my} pixels in a scan whose first slice ({first_name}) has {nx} × {ny}"
        ));
    }
    if slice.stored_as != first.stored_as {
        return wrong(format!(
            "slice of {} in a scan whose first slice ({first_name}) is {}: their grey values do not mean the same",
            slice.stored_as, first.stored_as
        ));
    }
    if slice.grey != first.grey {
        return wrong(format!(
            "its grey values are calibrated (ImageJ) otherwise than those of the first slice ({first_name})"
        ));
    }
    let differ = |a: f64, b: f64| (a / b - 1.0).abs() > 1e-3;
    if let (Some(a), Some(b)) = (first.pixel_mm, slice.pixel_mm)
        && (differ(a[0], b[0]) || differ(a[1], b[1]))
    {
        return wrong(format!(
            "has pixels of {} × {} mm in a scan whose first slice ({first_name}) has {} × {} mm",
            b[0], b[1], a[0], a[1]
        ));
    }
    Ok(())
}

/// Voxel size: of a reconstruction's log, which knows it, before that of tags.
fn size(
    folder: &Path,
    first_file: &Path,
    step: u128,
    first: &Slice,
    [nx, ny, nz]: [usize; 3],
    notes: &mut Vec<String>,
) -> Option<[f64; 3]> {
    if let Some(log) = skyscan::log_of(folder, first_file, notes)
        && let Some(size) = log.spacing_mm(step, [nx, ny], notes)
    {
        if let Some(pixel) = first.pixel_mm
            && (pixel[0] / size[0] - 1.0).abs() > 0.01
        {
            notes.push(format!(
                "the slices' own tags say pixels of {} mm: the log was taken",
                pixel[0]
            ));
        }
        return Some(size);
    }
    if step > 1 {
        notes.push(format!(
            "the slices' numbers go in steps of {step}: if slices were left out, their distance is larger than in the scanner (--spacing)"
        ));
    }
    spacing(first.pixel_mm, first.slice_mm, nz, notes)
}

fn decode(file: &Path) -> Result<Slice> {
    match kind(file) {
        Some("png" | "bmp") => bitmap::read_slice(file),
        _ => tiff::read_slice(file),
    }
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
