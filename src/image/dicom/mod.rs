//! Owns DICOM series: slices sorted by position along their normal, rescaled to HU. Names of persons are not read.

mod lengths;

use crate::error::{Error, Result};
use crate::image::orient::{Affine, from_lps};
use crate::image::stored::Stored;
use dicom_object::{DefaultDicomObject, OpenFileOptions, Tag};
use dicom_pixeldata::PixelDecoder;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

const ADVICE: &str =
    "export the series again as uncompressed DICOM, or convert it to NIfTI (dcm2niix)";
const PIXEL_DATA: Tag = Tag(0x7FE0, 0x0010);

/// What one slice says of itself.
struct Head {
    path: PathBuf,
    rows: usize,
    columns: usize,
    frames: usize,
    series: String,
    /// Of rows, then of columns, in mm.
    pixel_mm: Option<[f64; 2]>,
    position: Option<[f64; 3]>,
    /// Direction along a row, then along a column.
    directions: Option<[f64; 6]>,
    instance: f64,
    thickness: Option<f64>,
    rescaled: bool,
}

impl Head {
    /// Distance along the normal, or the number of the slice where positions are missing.
    fn along(&self) -> f64 {
        match (self.position, self.directions) {
            (Some(p), Some(d)) => dot(p, normal(&d)),
            _ => self.instance,
        }
    }
}

pub fn read(folder: &Path, files: &[PathBuf]) -> Result<Stored> {
    let mut heads: Vec<Head> = files.par_iter().map(|f| head(f)).collect::<Result<_>>()?;
    heads.sort_by(|a, b| a.along().total_cmp(&b.along()));
    let Some(first) = heads.first() else {
        return Err(Error::file(folder, "holds no DICOM slices", ADVICE));
    };
    for other in &heads {
        same_series(first, other)?;
    }
    let (nx, ny, nz) = (first.columns, first.rows, first.frames * heads.len());
    let plane = nx * ny;
    let promised = plane.saturating_mul(nz);
    let on_disk: u64 = heads
        .iter()
        .filter_map(|h| std::fs::metadata(&h.path).ok())
        .map(|m| m.len())
        .sum();
    // Nothing that is decoded here packs more than a hundredfold.
    if promised == 0 || promised as u64 > on_disk.saturating_mul(100) {
        return Err(Error::file(
            &first.path,
            format!(
                "the headers promise {nx} × {ny} × {nz} voxels, the files hold {on_disk} bytes"
            ),
            ADVICE,
        ));
    }
    let mut notes = Vec::new();
    let slice_mm = slice_distance(&heads, &mut notes)?;
    let mut values = vec![0f32; promised];
    values
        .par_chunks_mut(plane * first.frames)
        .zip(&heads)
        .try_for_each(|(out, head)| decode(head, out))?;
    let spacing_mm = first
        .pixel_mm
        .zip(slice_mm)
        .map(|([row, column], z)| [column, row, z]);
    Ok(Stored {
        format: format!("DICOM series of {} files", heads.len()),
        n: [nx, ny, nz],
        values,
        affine: spacing_mm.and_then(|s| affine(first, s)),
        spacing_mm,
        unit: first.rescaled.then(|| "HU".to_string()),
        notes,
        ..Stored::default()
    })
}

fn same_series(first: &Head, other: &Head) -> Result<()> {
    let differs = |what: String, advice: &str| Err(Error::file(&other.path, what, advice));
    if (other.rows, other.columns, other.frames) != (first.rows, first.columns, first.frames) {
        return differs(
            format!(
                "slice of {} × {} pixels in a series whose first slice has {} × {}",
                other.columns, other.rows, first.columns, first.rows
            ),
            "keep one series in a folder, without localisers",
        );
    }
    if other.series != first.series {
        return differs(
            "belongs to another series than the first slice".into(),
            "keep one series in a folder: sort the files by SeriesInstanceUID",
        );
    }
    Ok(())
}

fn open(path: &Path, pixels: bool) -> Result<DefaultDicomObject> {
    let bytes = std::fs::read(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
    })?;
    if let Some(fault) = lengths::fault(&bytes) {
        return Err(Error::file(
            path,
            format!("is no sound DICOM file: {fault}"),
            ADVICE,
        ));
    }
    let mut options = OpenFileOptions::new();
    if !pixels {
        options = options.read_until(PIXEL_DATA);
    }
    options
        .from_reader(&bytes[..])
        .map_err(|e| Error::file(path, format!("cannot be read as DICOM ({e})"), ADVICE))
}

fn head(path: &Path) -> Result<Head> {
    let object = open(path, false)?;
    let text = |group, element| -> Option<String> {
        let value = object.element_opt(Tag(group, element)).ok()??;
        Some(value.to_str().ok()?.trim().trim_matches('\0').to_string())
    };
    let numbers = |group, element| -> Vec<f64> {
        let text = text(group, element).unwrap_or_default();
        text.split('\\')
            .filter_map(|w| w.trim().parse().ok())
            .filter(|v: &f64| v.is_finite())
            .collect()
    };
    let number = |group, element| numbers(group, element).first().copied();
    let count = |group, element| {
        number(group, element)
            .filter(|v| (0.0..65536.0).contains(v))
            .map(|v| v as usize)
    };
    let (Some(rows), Some(columns)) = (count(0x0028, 0x0010), count(0x0028, 0x0011)) else {
        return Err(Error::file(
            path,
            "holds no image: Rows and Columns are missing",
            ADVICE,
        ));
    };
    // The decoder makes a table of all values: 24 bits would be 64 MiB for a slice of any size.
    if !count(0x0028, 0x0101).is_some_and(|bits| (1..=16).contains(&bits)) {
        return Err(Error::file(
            path,
            "holds no image: Bits Stored should be 1 to 16",
            ADVICE,
        ));
    }
    let positive = |v: &f64| *v > 0.0;
    Ok(Head {
        path: path.to_path_buf(),
        rows,
        columns,
        frames: count(0x0028, 0x0008).unwrap_or(1).max(1),
        series: text(0x0020, 0x000E).unwrap_or_default(),
        pixel_mm: numbers(0x0028, 0x0030)
            .try_into()
            .ok()
            .filter(|p: &[f64; 2]| p.iter().all(positive)),
        position: numbers(0x0020, 0x0032).try_into().ok(),
        directions: numbers(0x0020, 0x0037).try_into().ok(),
        instance: number(0x0020, 0x0013).unwrap_or(0.0),
        thickness: number(0x0018, 0x0088)
            .or(number(0x0018, 0x0050))
            .map(f64::abs)
            .filter(positive),
        rescaled: number(0x0028, 0x1053).is_some(),
    })
}

fn decode(head: &Head, out: &mut [f32]) -> Result<()> {
    let wrong = |found: String| Error::file(&head.path, found, ADVICE);
    let object = open(&head.path, true)?;
    let pixels = object
        .decode_pixel_data()
        .map_err(|e| wrong(format!("its pixels cannot be decoded ({e})")))?;
    let values: Vec<f32> = pixels
        .to_vec()
        .map_err(|e| wrong(format!("its pixels cannot be decoded ({e})")))?;
    if values.len() != out.len() {
        return Err(wrong(format!(
            "{} pixels decoded where {} were expected",
            values.len(),
            out.len()
        )));
    }
    out.copy_from_slice(&values);
    Ok(())
}

/// Distance of neighbouring slices; they must be evenly spaced.
fn slice_distance(heads: &[Head], notes: &mut Vec<String>) -> Result<Option<f64>> {
    let placed = heads
        .iter()
        .all(|h| h.position.is_some() && h.directions.is_some());
    let [first, .., last] = heads else {
        return Ok(heads[0].thickness);
    };
    if !placed {
        notes.push("slices carry no position: sorted by their number, their distance taken from the thickness".into());
        return Ok(first.thickness);
    }
    let mean = (last.along() - first.along()) / (heads.len() - 1) as f64;
    for pair in heads.windows(2) {
        let gap = pair[1].along() - pair[0].along();
        // Positions are written to about 1e-4 mm; a missing slice is a whole gap.
        if (gap - mean).abs() > 0.05 * mean + 2e-4 || mean <= 0.0 {
            return Err(Error::file(
                &pair[1].path,
                format!(
                    "lies {gap:.4} mm after the slice before it, where slices are {mean:.4} mm apart on average"
                ),
                "a slice is missing or doubled: export the whole series",
            ));
        }
    }
    Ok(Some((mean * 1e7).round() / 1e7))
}

fn normal(d: &[f64; 6]) -> [f64; 3] {
    let [a, b, c, x, y, z] = *d;
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn affine(first: &Head, s: [f64; 3]) -> Option<Affine> {
    let (d, origin) = (first.directions?, first.position?);
    let normal = normal(&d);
    Some(from_lps(std::array::from_fn(|r| {
        [d[r] * s[0], d[3 + r] * s[1], normal[r] * s[2], origin[r]]
    })))
}

/// Whether a file is DICOM by its magic word, whatever its name.
pub fn is_dicom(path: &Path) -> bool {
    use std::io::Read;
    let mut head = [0u8; 132];
    std::fs::File::open(path)
        .and_then(|mut f| f.read_exact(&mut head))
        .is_ok()
        && &head[128..] == b"DICM"
}
