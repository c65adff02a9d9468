//! Owns the segmented scan on disk: `mask.nii.gz` and `segment.json`, written and read back.

use crate::error::{Error, Result};
use crate::format::orient::{self, Turn};
use crate::image::{nifti, scan};
use crate::io::atomic;
pub use crate::io::own_files::{GREY, MASK, PICTURE, RECORD, SITES, STILL, VIEW, VOI};
use crate::pipeline::segment::{SegmentParams, SegmentSummary, Surface, shown};
use crate::result::shape::Image;
use crate::volume::{Specimen, Threshold, Volume};
use serde::{Deserialize, Serialize};
use serde_json::Value;
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

/// A segmented scan, read from its folder.
pub struct SegmentedScan {
    /// The mask, with the grey values once they were asked for.
    pub specimen: Specimen,
    /// How it was made.
    pub record: SegmentRecord,
    /// The same as it stands in the folder.
    pub record_json: Value,
    /// BLAKE3 of the file of the mask.
    pub mask_blake3: String,
}

/// The specimen that `segment` left in `dir`. Each file is read once.
///
/// # Errors
/// No segmented scan there, a damaged one.
pub fn load(dir: &Path) -> Result<SegmentedScan> {
    let path = dir.join(RECORD);
    let again = "segment the scan first: bonepd-ct segment SCAN -o DIR --lower VALUE";
    let text = std::fs::read_to_string(&path).map_err(|e| {
        Error::file(&path, format!("no segmented scan here ({e})"), again).caused_by(e)
    })?;
    let unknown = |e: serde_json::Error| {
        let found = format!("is no record of a segmentation ({e})");
        Error::file(&path, found, again).caused_by(e)
    };
    let record: SegmentRecord = serde_json::from_str(&text).map_err(unknown)?;
    let record_json = serde_json::from_str(&text).map_err(unknown)?;
    let mask = dir.join(MASK);
    let bytes = std::fs::read(&mask)
        .map_err(|e| Error::file(&mask, format!("cannot be read: {e}"), again).caused_by(e))?;
    let mask_blake3 = blake3::hash(&bytes).to_hex().to_string();
    let results = &record.results;
    let stored = scan::turned_of_bytes((&mask, bytes), &record.input.axes, results.spacing_mm)?;
    if stored.grid.n != results.voxels {
        return Err(Error::file(
            &mask,
            format!(
                "has {:?} voxels where {RECORD} says {:?}",
                stored.grid.n, results.voxels
            ),
            again,
        ));
    }
    Ok(SegmentedScan {
        specimen: Specimen {
            name: record.scan.clone(),
            bone: mask_of(&stored),
            tv_mm3: results.tv_mm3,
            tv_definition: results.tv_definition.clone(),
            grey: None,
            threshold: None,
        },
        record,
        record_json,
        mask_blake3,
    })
}

impl SegmentedScan {
    /// A scan that was segmented in memory, with the grey values that the record's settings keep.
    pub fn in_memory(mut specimen: Specimen, record: SegmentRecord) -> SegmentedScan {
        if specimen.grey.is_none() {
            specimen.threshold = None;
        }
        SegmentedScan {
            record_json: serde_json::to_value(&record).expect("records are plain data"),
            mask_blake3: blake3::hash(specimen.bone.as_slice()).to_hex().to_string(),
            specimen,
            record,
        }
    }

    /// What is known of the surface within a voxel.
    pub fn image(&self) -> Image {
        let results = &self.record.results;
        match results.surface {
            Surface::Grey => Image::Grey {
                blur_voxels: results.blur_voxels.unwrap_or(0.0),
            },
            _ => Image::Mask,
        }
    }

    /// Gives the specimen the grey values that `segment` kept in `dir`, and how its bone follows from them. Without kept values
    /// it stays as it is.
    ///
    /// # Errors
    /// Values on another grid than the mask's, unreadable files.
    pub fn add_grey(&mut self, dir: &Path) -> Result<()> {
        if !dir.join(GREY).exists() {
            return Ok(());
        }
        self.specimen.grey = Some(self.on_the_masks_grid(&dir.join(GREY))?);
        let results = &self.record.results;
        if results.surface != Surface::Grey {
            return Ok(());
        }
        let voi = dir.join(VOI);
        let inside = match voi.exists() {
            true => Some(mask_of(&self.on_the_masks_grid(&voi)?)),
            false => None,
        };
        self.specimen.threshold = Some(Threshold {
            lower: results.lower.map_or(f32::NEG_INFINITY, |v| v as f32),
            upper: results.upper.map_or(f32::INFINITY, |v| v as f32),
            inside,
            keep_all: self.record.settings.keep_all,
            blur_voxels: results.blur_voxels,
            is_blur_given: self.record.settings.blur_voxels.is_some(),
        });
        Ok(())
    }

    /// A file along the axes of the mask.
    fn on_the_masks_grid(&self, path: &Path) -> Result<Volume<f32>> {
        let grid = &self.specimen.bone.grid;
        let volume = scan::read_turned(path, &self.record.input.axes, grid.spacing_mm)?;
        match volume.grid.n == grid.n {
            true => Ok(volume),
            false => Err(Error::file(
                path,
                format!(
                    "has {:?} voxels where the mask has {:?}",
                    volume.grid.n, grid.n
                ),
                "segment the scan again",
            )),
        }
    }
}

/// Non-zero is inside.
pub fn mask_of(volume: &Volume<f32>) -> Volume<u8> {
    let voxels = volume.as_slice().iter();
    let voxels = voxels.map(|&v| u8::from(v != 0.0 && !v.is_nan()));
    let mut mask = Volume::from_vec(volume.grid, voxels.collect());
    mask.affine = volume.affine;
    mask
}
