//! Owns the one way in: any scan, file or folder, to grey values on a grid in millimetres.

use crate::error::{Error, Result};
use crate::format::calibration::{Calibration, GreyUnit};
use crate::format::orient::{self, Affine, Turn};
use crate::grid::Grid;
use crate::image::array::headerless::{self, Contents};
use crate::image::array::npy;
use crate::image::scanco::{aim, isq};
use crate::image::stored::Stored;
use crate::image::{dicom, metaimage, nifti, nrrd, slices, tiff};
use crate::volume::Volume;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// A scan, ready to be segmented.
#[derive(Debug, Clone)]
pub struct Scan {
    /// The file's or folder's name without extensions.
    pub name: String,
    pub path: PathBuf,
    pub format: String,
    pub unit: Option<String>,
    /// What the file holds to turn stored values into HU and density, whether it was asked for or not.
    pub calibration: Option<Calibration>,
    /// Axes x, y, z canonical where the file has an orientation, else as stored. May hold NaN and infinities.
    pub volume: Volume<f32>,
    /// From the axes as stored to those of `volume`.
    pub turn: Turn,
    /// Values from the first to the second stand for no measurement.
    pub padding: Option<[f32; 2]>,
    /// What the file says of voxel size and place, along the axes of `volume`, whatever voxel size was asked for.
    pub file_spacing_mm: Option<[f64; 3]>,
    pub file_affine: Option<Affine>,
    pub details: Vec<(String, String)>,
    /// What a user should know of how the file was understood.
    pub notes: Vec<String>,
    /// What makes results wrong where it was not meant.
    pub warnings: Vec<String>,
}

/// How a scan is to be read.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// Voxel size along x, y, z of the canonical axes; wins over the file's.
    pub spacing_mm: Option<[f64; 3]>,
    /// Of a Scanco scan's grey values; None: as stored.
    pub unit: Option<GreyUnit>,
    /// What is in a file without a header.
    pub raw: Option<Contents>,
}

/// Reads a scan in its own units. `spacing_mm` (x, y, z of the canonical axes) overrides the file's voxel size.
pub fn read(path: &Path, spacing_mm: Option<[f64; 3]>) -> Result<Scan> {
    read_as(
        path,
        &Reading {
            spacing_mm,
            ..Reading::default()
        },
    )
}

pub fn read_as(path: &Path, reading: &Reading) -> Result<Scan> {
    let spacing_mm = reading.spacing_mm.map(checked_spacing).transpose()?;
    let mut stored = stored_as(path, reading.raw)?;
    calibrate(&mut stored, reading.unit.unwrap_or(GreyUnit::Native), path)?;
    let (mut notes, mut warnings) = (stored.notes, Vec::new());
    let found = stored.spacing_mm;
    let Some(spacing) = found.or(spacing_mm) else {
        return Err(Error::file(
            path,
            format!(
                "{} without a voxel size: the file does not carry one",
                stored.format
            ),
            "give it with --spacing MM (for example --spacing 0.0195)",
        ));
    };
    let (mut volume, turn) = match (stored.affine, found) {
        (Some(affine), Some(spacing)) => {
            let grid = Grid::new(stored.n, spacing);
            orient::canonical(grid, stored.values, affine, &mut notes)
        }
        (Some(directions), None) => {
            let back = Turn::of(&directions).unwrap_or_default().inverse();
            let along = back.from.map(|r| spacing[r]);
            let grid = Grid::new(stored.n, along);
            let affine = orient::scaled(&directions, along);
            orient::canonical(grid, stored.values, affine, &mut notes)
        }
        (None, _) => {
            let grid = Grid::new(stored.n, spacing);
            (Volume::from_vec(grid, stored.values), Turn::default())
        }
    };
    let file_affine = volume.affine;
    let file_spacing_mm = found.map(|_| volume.grid.spacing_mm);
    if let Some(wanted) = spacing_mm {
        warnings.extend(respace(&mut volume, wanted, found.is_some()));
    }
    Ok(Scan {
        name: name(path),
        path: path.to_path_buf(),
        format: stored.format,
        unit: stored.unit,
        calibration: stored.calibration,
        volume,
        turn,
        padding: stored.padding,
        file_spacing_mm,
        file_affine,
        details: stored.details,
        notes,
        warnings,
    })
}

/// A scan that no file holds, axes as they are.
pub fn of_values(name: &str, volume: Volume<f32>) -> Scan {
    Scan {
        name: name.to_owned(),
        path: PathBuf::from(name),
        format: "values in memory".to_owned(),
        unit: None,
        calibration: None,
        volume,
        turn: Turn::default(),
        padding: None,
        file_spacing_mm: None,
        file_affine: None,
        details: Vec::new(),
        notes: Vec::new(),
        warnings: Vec::new(),
    }
}

/// Values of a file that this program wrote on the grid of a scan, brought to the axes that `turn` made of the stored
/// ones. `spacing_mm` is the voxel size along the turned axes.
pub fn read_turned(path: &Path, turn: &Turn, spacing_mm: [f64; 3]) -> Result<Volume<f32>> {
    Ok(turned(stored(path)?, turn, spacing_mm))
}

/// [`read_turned`] of the bytes of a NIfTI file that was read before; `path` names it in errors.
pub fn turned_of_bytes(
    (path, bytes): (&Path, Vec<u8>),
    turn: &Turn,
    spacing_mm: [f64; 3],
) -> Result<Volume<f32>> {
    let stored = checked(path, nifti::of_bytes(path, bytes)?)?;
    Ok(turned(stored, turn, spacing_mm))
}

fn turned(stored: Stored, turn: &Turn, spacing_mm: [f64; 3]) -> Volume<f32> {
    let grid = Grid::new(stored.n, turn.inverse().from.map(|r| spacing_mm[r]));
    let mut volume = Volume::from_vec(grid, stored.values);
    volume.affine = stored.affine;
    orient::turned(volume, turn)
}

/// Files of other formats hold the unit they were saved in: nothing to convert, but a contradiction is an error.
fn calibrate(stored: &mut Stored, unit: GreyUnit, path: &Path) -> Result<()> {
    let Some(calibration) = stored.calibration else {
        let asked = match unit {
            GreyUnit::Native | GreyUnit::HuWhereKnown => return Ok(()),
            GreyUnit::Hu => "HU",
            GreyUnit::Mgha => "mg HA/cm3",
        };
        return match stored.unit.as_deref() {
            Some(found) if found == asked => Ok(()),
            found => Err(Error::file(
                path,
                format!(
                    "holds no calibration to {asked} (its unit: {})",
                    found.unwrap_or("not given")
                ),
                "use --units native, with a threshold in the file's own values",
            )),
        };
    };
    let ([slope, intercept], name) = match (unit, calibration.line(unit, path)) {
        (GreyUnit::HuWhereKnown, Err(_)) => calibration.line(GreyUnit::Native, path)?,
        (_, line) => line?,
    };
    if [slope, intercept] != [1.0, 0.0] {
        stored
            .values
            .par_iter_mut()
            .for_each(|v| *v = (slope * f64::from(*v) + intercept) as f32);
    }
    stored.unit = Some(name.into());
    Ok(())
}

/// What a file or folder holds, axes as stored.
///
/// What changes the meaning of voxels (orientation, shear, units, scale, channels, time, padding, bit order, byte order,
/// skips, order of frames) is honoured, or refused in words; it is never dropped. Each reader's documentation lists the keys
/// of its format and says of each whether it is read, refused or harmless.
///
/// # Errors
/// No file, no scan, a damaged one, or one whose voxels are no boxes on one grid.
pub fn stored(path: &Path) -> Result<Stored> {
    stored_as(path, None)
}

/// The same; `raw` is what is in a file without a header.
pub fn stored_as(path: &Path, raw: Option<Contents>) -> Result<Stored> {
    checked(path, by_format(path, raw)?)
}

fn checked(path: &Path, mut stored: Stored) -> Result<Stored> {
    stored.spacing_mm = stored
        .spacing_mm
        .filter(|s| s.iter().all(|&v| v > 0.0 && v.is_finite()));
    if let Some(affine) = &stored.affine {
        orient::check(path, affine, &mut stored.notes)?;
    }
    if stored.format.contains("int32") || stored.format.contains("int64") {
        let rounded = |v: &f32| v.abs() >= MOST_INTEGER;
        if stored.values.par_iter().any(rounded) {
            stored.notes.push(format!(
                "integers from {MOST_INTEGER} on are rounded: values are kept in single precision"
            ));
        }
    }
    Ok(stored)
}

/// From here on single precision does not hold every integer.
const MOST_INTEGER: f32 = 16_777_216.0;

fn by_format(path: &Path, raw: Option<Contents>) -> Result<Stored> {
    let meta = std::fs::metadata(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
        .caused_by(e)
    })?;
    if meta.is_dir() {
        return slices::read(path);
    }
    match kind(path) {
        Some(Kind::Nifti) => nifti::read(path),
        Some(Kind::Tiff) => tiff::read(path),
        Some(Kind::MetaImage) => metaimage::read(path),
        Some(Kind::Nrrd) => nrrd::read(path),
        Some(Kind::Npy) => npy::read(path),
        Some(Kind::Npz) => npy::read_archive(path),
        Some(Kind::Headerless) => match raw {
            Some(contents) => headerless::read(path, contents),
            None => Err(headerless::unknown(path)),
        },
        Some(Kind::Aim) => aim::read(path),
        Some(Kind::Isq) => isq::read(path),
        Some(Kind::Dicom) => dicom::read(path, &[path.to_path_buf()]),
        None => Err(Error::file(
            path,
            "is not a scan format that is read",
            "give NIfTI, Analyze, TIFF, MetaImage, NRRD, AIM, ISQ, DICOM or NumPy, or a folder of slices (TIFF, PNG, BMP, DICOM)",
        )),
    }
}

/// Formats that are one file each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Nifti,
    Tiff,
    MetaImage,
    Nrrd,
    Npy,
    Npz,
    Headerless,
    Aim,
    Isq,
    Dicom,
}

/// By its name, DICOM also by its first bytes; `;1` is a version that VMS appends.
fn kind(path: &Path) -> Option<Kind> {
    const ENDS: [(&str, Kind); 21] = [
        (".nii", Kind::Nifti),
        (".nii.gz", Kind::Nifti),
        (".hdr", Kind::Nifti),
        (".hdr.gz", Kind::Nifti),
        (".img", Kind::Nifti),
        (".img.gz", Kind::Nifti),
        (".tif", Kind::Tiff),
        (".tiff", Kind::Tiff),
        (".mha", Kind::MetaImage),
        (".mhd", Kind::MetaImage),
        (".nrrd", Kind::Nrrd),
        (".nhdr", Kind::Nrrd),
        (".npy", Kind::Npy),
        (".npz", Kind::Npz),
        (".raw", Kind::Headerless),
        (".vol", Kind::Headerless),
        (".aim", Kind::Aim),
        (".isq", Kind::Isq),
        (".dcm", Kind::Dicom),
        (".dicom", Kind::Dicom),
        (".ima", Kind::Dicom),
    ];
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let name = without_vms_version(&name);
    ENDS.iter()
        .find_map(|(end, kind)| name.ends_with(end).then_some(*kind))
        .or_else(|| dicom::is_dicom(path).then_some(Kind::Dicom))
}

/// `scan.aim;1` without its `;1`.
fn without_vms_version(name: &str) -> &str {
    match name.rsplit_once(';') {
        Some((stem, version))
            if !version.is_empty() && version.bytes().all(|c| c.is_ascii_digit()) =>
        {
            stem
        }
        _ => name,
    }
}

/// True for what [`read`] takes as one file (by its name; the content may still be refused). Of a pair it is the header. Voxels
/// without a header are none: most belong to the header of another format.
pub fn is_scan_file(path: &Path) -> bool {
    path.is_file()
        && kind(path).is_some_and(|kind| kind != Kind::Headerless)
        && !nifti::is_image_half(path)
}

fn checked_spacing(s: [f64; 3]) -> Result<[f64; 3]> {
    if s.iter().all(|&v| v.is_finite() && v > 0.0) {
        return Ok(s);
    }
    Err(Error::setting(
        "spacing",
        format!("{s:?} is no voxel size"),
        "give millimetres above zero, one for all axes or three",
    ))
}

/// Gives the voxels another size. A warning where the file's is `known` and differs.
fn respace(volume: &mut Volume<f32>, wanted: [f64; 3], known: bool) -> Option<String> {
    let old = volume.grid.spacing_mm;
    let differs = known && (0..3).any(|a| (old[a] / wanted[a] - 1.0).abs() > 1e-3);
    if let Some(affine) = &mut volume.affine {
        for row in affine {
            for a in 0..3 {
                row[a] *= wanted[a] / old[a];
            }
        }
    }
    volume.grid.spacing_mm = wanted;
    let words = |s: [f64; 3]| s.map(|v| v.to_string()).join(" × ");
    differs.then(|| {
        format!(
            "voxel size replaced: the file says {} mm, {} mm are taken as asked (--spacing, spacing_mm)",
            words(old),
            words(wanted)
        )
    })
}

/// The scan's name: that of the file or folder, without extensions that formats add.
pub fn name(path: &Path) -> String {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let full = absolute
        .file_name()
        .map_or_else(|| "scan".into(), |n| n.to_string_lossy().into_owned());
    if path.is_dir() {
        return full;
    }
    let full = without_vms_version(&full);
    let stem = full.strip_suffix(".gz").unwrap_or(full);
    match stem.rfind('.') {
        Some(dot) if dot > 0 => stem[..dot].to_string(),
        _ => stem.to_string(),
    }
}

/// BLAKE3 of the input: of the file (and of the data that a header names), or of the names and contents of a folder's files in natural order.
pub fn hash(path: &Path) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    if path.is_dir() {
        for file in slices::files(path)? {
            let name = file
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            hasher.update(name.as_bytes());
            hasher.update(hash_file(&file)?.as_bytes());
        }
    } else {
        let data = data_files(path);
        if data.is_empty() {
            return Ok(hash_file(path)?.to_hex().to_string());
        }
        hasher.update(hash_file(path)?.as_bytes());
        for file in data.iter().filter(|file| file.is_file()) {
            hasher.update(hash_file(file)?.as_bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// The files of voxels that a header in their folder names.
fn data_files(path: &Path) -> Vec<PathBuf> {
    match kind(path) {
        Some(Kind::MetaImage) => metaimage::data_files(path),
        Some(Kind::Nrrd) => nrrd::data_files(path),
        Some(Kind::Nifti) => nifti::data_file(path).into_iter().collect(),
        _ => Vec::new(),
    }
}

fn hash_file(path: &Path) -> Result<blake3::Hash> {
    let mut hasher = blake3::Hasher::new();
    std::fs::File::open(path)
        .and_then(|file| hasher.update_reader(file).map(|h| h.finalize()))
        .map_err(|e| {
            Error::file(
                path,
                format!("cannot be read: {e}"),
                "check the path and its permissions",
            )
            .caused_by(e)
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_only_format_extensions() {
        for (path, expected) in [
            ("a/b/femur_01.nii.gz", "femur_01"),
            ("scan.0195.nii", "scan.0195"),
            ("stack.tif", "stack"),
            ("folder", "folder"),
            ("C0001234.AIM;1", "C0001234"),
        ] {
            assert_eq!(name(Path::new(path)), expected);
        }
    }
}
