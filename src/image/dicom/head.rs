//! Owns what a DICOM file says of its frames: size, coding, place and scale of each. Names of persons are not looked at.

use super::ADVICE;
use super::coding::Coding;
use super::compressed::{self, Codec};
use super::elements::{PIXEL_DATA, Set};
use super::frames::{Frame, frames};
use super::walk::Data;
use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// The file's elements, however they are coded.
pub fn data(path: &Path) -> Result<Data> {
    let bytes = std::fs::read(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
        .caused_by(e)
    })?;
    Data::new(bytes).map_err(|fault| unsound(path, &fault))
}

pub fn unsound(path: &Path, fault: &str) -> Error {
    Error::file(path, format!("is no sound DICOM file: {fault}"), ADVICE)
}

/// A file with pixels.
#[derive(Debug, Clone)]
pub struct Image {
    pub path: PathBuf,
    pub rows: usize,
    pub columns: usize,
    pub series: String,
    pub coding: Coding,
    pub codec: Option<Codec>,
    pub frames: Vec<Frame>,
    /// Stored values that stand for no measurement.
    pub padding: Option<[f32; 2]>,
    pub lossy: bool,
    /// It names further scales of its values, which are not used.
    pub other_scales: bool,
}

/// What one file of a folder turned out to be.
#[derive(Debug, Clone)]
pub enum Found {
    Image(Box<Image>),
    /// A directory, a report, a presentation: what it calls itself.
    Other(String),
}

/// Reads all but the pixels of the `file`-th file.
pub fn found(path: &Path, file: usize) -> Result<Found> {
    let data = data(path)?;
    let set = data.elements().map_err(|fault| unsound(path, &fault))?;
    let whole = |tag| set.short(tag).map(usize::from).filter(|v| *v > 0);
    let (Some(rows), Some(columns)) = (whole([0x28, 0x10]), whole([0x28, 0x11])) else {
        let modality = set.text([8, 0x60]).unwrap_or_else(|| "none".into());
        return Ok(Found::Other(format!("modality {modality}")));
    };
    let coding = coding(&set, path)?;
    let codec = match data.is_compressed() {
        true => Some(codec(&data.syntax, path)?),
        false => None,
    };
    if data.syntax == "1.2.840.10008.1.2.2" && coding.bytes == 1 {
        return Err(Error::file(
            path,
            "holds 8-bit pixels in big-endian words, whose order differs from program to program",
            ADVICE,
        ));
    }
    let count = set.decimal([0x28, 8]).unwrap_or(1.0);
    if !(1.0..=65536.0).contains(&count) {
        return Err(Error::file(
            path,
            format!("says that it holds {count} frames"),
            ADVICE,
        ));
    }
    Ok(Found::Image(Box::new(Image {
        path: path.to_path_buf(),
        rows,
        columns,
        series: set.text([0x20, 0xE]).unwrap_or_default(),
        frames: frames(&set, path, file, count as usize, coding.signed)?,
        padding: padding(&set, &coding),
        lossy: set.text([0x28, 0x2110]).as_deref() == Some("01"),
        other_scales: !set.items([0x40, 0x9096]).is_empty(),
        coding,
        codec,
    })))
}

fn codec(syntax: &str, path: &Path) -> Result<Codec> {
    compressed::codec(syntax).ok_or_else(|| {
        Error::file(
            path,
            format!(
                "is compressed as {}, which is not read",
                compressed::name(syntax)
            ),
            compressed::way_out(syntax),
        )
    })
}

/// How one sample is stored.
fn coding(set: &Set, path: &Path) -> Result<Coding> {
    let refused = |found: String, advice: &str| Err(Error::file(path, found, advice));
    let photometric = set.text([0x28, 4]).unwrap_or_else(|| "MONOCHROME2".into());
    let samples = set.short([0x28, 2]).unwrap_or(1);
    if samples != 1 || !photometric.starts_with("MONOCHROME") {
        return refused(
            format!(
                "is a colour image ({photometric}, {samples} samples a pixel), grey values are expected"
            ),
            "remove it from the folder, or export grey values",
        );
    }
    if set.get([0x7FE0, 8]).is_some() || set.get([0x7FE0, 9]).is_some() {
        return refused(
            "holds pixels that are floating-point numbers, which are not read".into(),
            ADVICE,
        );
    }
    let allocated = set.short([0x28, 0x100]).unwrap_or(0);
    match allocated {
        8 | 16 => {}
        1 => {
            return refused(
                "holds 1-bit pixels (a segmentation), which are not read".into(),
                "convert it to NIfTI (dcmqi: segimage2itkimage)",
            );
        }
        other => {
            return refused(
                format!("holds {other}-bit pixels, which are not read"),
                ADVICE,
            );
        }
    }
    if set.get(PIXEL_DATA).is_none() {
        return refused("holds no pixels: it may be cut off".into(), ADVICE);
    }
    let stored = set.short([0x28, 0x101]).unwrap_or(allocated);
    let high = set.short([0x28, 0x102]).unwrap_or(stored.saturating_sub(1));
    if stored == 0 || stored > allocated || high >= allocated || high + 1 < stored {
        return refused(
            format!("says that {stored} bits up to bit {high} are stored of {allocated}"),
            ADVICE,
        );
    }
    Ok(Coding {
        bytes: usize::from(allocated / 8),
        stored: u32::from(stored),
        high: u32::from(high),
        signed: set.short([0x28, 0x103]) == Some(1),
    })
}

fn padding(set: &Set, coding: &Coding) -> Option<[f32; 2]> {
    let number = |tag| {
        let v = set.short(tag)?;
        Some(match coding.signed {
            true => f32::from(v as i16),
            false => f32::from(v),
        })
    };
    let value = number([0x28, 0x120])?;
    let limit = number([0x28, 0x121]).unwrap_or(value);
    Some([value.min(limit), value.max(limit)])
}
