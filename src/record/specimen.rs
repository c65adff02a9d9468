//! Owns the segmented scan on disk: `mask.nii.gz` and `segment.json`, written and read back.

use crate::error::{Error, Result};
use crate::format::orient::{self, Turn};
use crate::image::{nifti, scan};
use crate::io::atomic;
pub use crate::io::own_files::{GREY, MASK, PICTURE, RECORD, VOI};
use crate::pipeline::segment::{SegmentParams, SegmentSummary, Surface, shown};
use crate::result::shape::Image;
use crate::volume::{Specimen, Threshold, Volume};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// `segment.json`: what was segmented, how, and what came out; enough to repeat it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SegmentRecord {
    /// Name of the program.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Name of the scan.
    pub scan: String,
    /// What was read.
    pub input: Input,
    /// The settings of the segmentation.
    pub settings: SegmentParams,
    /// What came out.
    pub results: SegmentSummary,
}

/// The scan that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// As it was given.
    #[serde(serialize_with = "shown")]
    pub path: PathBuf,
    /// Of the file, or of the names and contents of a folder's slices.
    pub blake3: String,
    /// Of the mask that is the volume of interest, where one is.
    pub voi_blake3: Option<String>,
    /// The format of the file, in words.
    pub format: String,
    /// Unit of the grey values where the file states it.
    pub unit: Option<String>,
    /// From the file's axes to x, y, z of the results. Mask, grey values and fields are written in the file's order.
    #[serde(default)]
    pub axes: Turn,
    /// What a reader must know of the file.
    pub notes: Vec<String>,
}

/// Writes mask and record. The record goes last: where it is, the mask is whole.
pub fn write(dir: &Path, specimen: &Specimen, record: &SegmentRecord) -> Result<()> {
    let back = record.input.axes.inverse();
    let bone = orient::turned_copy(&specimen.bone, &back);
    nifti::write(&dir.join(MASK), &bone)?;
    match &specimen.grey {
        Some(grey) => nifti::write_grey(&dir.join(GREY), &orient::turned_copy(grey, &back))?,
        None => drop(std::fs::remove_file(dir.join(GREY))),
    }
    let inside = specimen.threshold.as_ref().and_then(|t| t.inside.as_ref());
    match inside.filter(|_| specimen.grey.is_some()) {
        Some(inside) => nifti::write(&dir.join(VOI), &orient::turned_copy(inside, &back))?,
        None => drop(std::fs::remove_file(dir.join(VOI))),
    }
    let json = serde_json::to_string_pretty(record).expect("records are plain data");
    atomic::write(&dir.join(RECORD), json + "\n")
}

/// The record in `dir`; None where there is none or an older program wrote another kind.
pub fn record(dir: &Path) -> Option<SegmentRecord> {
    let text = std::fs::read_to_string(dir.join(RECORD)).ok()?;
    serde_json::from_str(&text).ok()
}

/// From the order of the files of voxels in `dir` to x, y, z of the results.
pub fn axes(dir: &Path) -> Turn {
    record(dir).map_or(Turn::default(), |record| record.input.axes)
}

/// The specimen that `segment` left in `dir`.
pub fn load(dir: &Path) -> Result<Specimen> {
    let path = dir.join(RECORD);
    let again = "segment the scan first: bonepd-ct segment SCAN -o DIR --lower VALUE";
    let text = std::fs::read_to_string(&path).map_err(|e| {
        Error::file(&path, format!("no segmented scan here ({e})"), again).caused_by(e)
    })?;
    let record: SegmentRecord = serde_json::from_str(&text).map_err(|e| {
        Error::file(
            &path,
            format!("is no record of a segmentation ({e})"),
            again,
        )
        .caused_by(e)
    })?;
    let mask = dir.join(MASK);
    let axes = record.input.axes;
    let stored = scan::read_turned(&mask, &axes, record.results.spacing_mm)?;
    if stored.grid.n != record.results.voxels {
        return Err(Error::file(
            &mask,
            format!(
                "has {:?} voxels where {RECORD} says {:?}",
                stored.grid.n, record.results.voxels
            ),
            again,
        ));
    }
    Ok(Specimen {
        name: record.scan,
        bone: mask_of(&stored),
        tv_mm3: record.results.tv_mm3,
        tv_definition: record.results.tv_definition,
        grey: None,
        threshold: None,
    })
}

/// What the segmented scan in `dir` says of the surface within a voxel.
pub fn image(dir: &Path) -> Image {
    let results = record(dir).map(|record| record.results);
    match results {
        Some(r) if r.surface == Surface::Grey => Image::Grey {
            blur_voxels: r.blur_voxels.unwrap_or(0.0),
        },
        _ => Image::Mask,
    }
}

/// Gives a specimen the grey values that `segment` kept in `dir`, and how its bone follows from them. Without kept values
/// it stays as it is.
///
/// # Errors
/// Values on another grid than the mask's, unreadable files.
pub fn add_grey(dir: &Path, specimen: &mut Specimen) -> Result<()> {
    let path = dir.join(GREY);
    if !path.exists() {
        return Ok(());
    }
    specimen.grey = Some(on_grid_of(dir, &specimen.bone, GREY)?);
    let Some(record) = record(dir).filter(|r| r.results.surface == Surface::Grey) else {
        return Ok(());
    };
    let inside = match dir.join(VOI).exists() {
        true => Some(mask_of(&on_grid_of(dir, &specimen.bone, VOI)?)),
        false => None,
    };
    let (lower, upper) = (record.results.lower, record.results.upper);
    specimen.threshold = Some(Threshold {
        lower: lower.map_or(f32::NEG_INFINITY, |v| v as f32),
        upper: upper.map_or(f32::INFINITY, |v| v as f32),
        inside,
        keep_all: record.settings.keep_all,
        blur_voxels: record.results.blur_voxels,
    });
    Ok(())
}

/// A file of `dir` along the axes of the mask.
fn on_grid_of(dir: &Path, bone: &Volume<u8>, file: &str) -> Result<Volume<f32>> {
    let path = &dir.join(file);
    let volume = scan::read_turned(path, &axes(dir), bone.grid.spacing_mm)?;
    if volume.grid.n != bone.grid.n {
        return Err(Error::file(
            path,
            format!(
                "has {:?} voxels where the mask has {:?}",
                volume.grid.n, bone.grid.n
            ),
            "segment the scan again",
        ));
    }
    Ok(volume)
}

/// Non-zero is inside.
pub fn mask_of(volume: &Volume<f32>) -> Volume<u8> {
    let voxels = volume.as_slice().iter();
    let voxels = voxels.map(|&v| u8::from(v != 0.0 && !v.is_nan()));
    let mut mask = Volume::from_vec(volume.grid, voxels.collect());
    mask.affine = volume.affine;
    mask
}
