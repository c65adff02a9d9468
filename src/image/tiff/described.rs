//! Owns what a TIFF file's description says, by the program that wrote it.

use super::Pages;
use super::scale::Resolution;
use crate::error::{Error, Result};
use crate::image::description::imagej::{ImageJ, imagej};
use crate::image::description::ome::{self, Ome};
use std::path::Path;
use tiff::tags::Tag;

#[derive(Debug, Clone)]
pub enum Described {
    Nothing,
    ImageJ(ImageJ),
    Ome(Ome),
    /// tifffile's shape of the array, slowest axis first, and whether all pages lie behind one directory.
    Shape(Vec<usize>, bool),
}

/// Size of a voxel, and what is to be said of it.
#[derive(Debug, Clone, Default)]
pub struct Size {
    pub pixel_mm: Option<[f64; 2]>,
    pub slice_mm: Option<f64>,
    pub notes: Vec<String>,
}

/// Of the current page.
pub fn described(pages: &mut Pages, path: &Path) -> Result<Described> {
    let text = description(pages);
    if text.starts_with("ImageJ=") {
        return Ok(Described::ImageJ(imagej(&text)));
    }
    if ome::is_ome(&text) {
        let ome = ome::parse(&text).map_err(|found| {
            Error::file(
                path,
                found,
                "export the scan again, or save it as a plain TIFF stack (in Fiji: File > Save As > Tiff) and give --spacing",
            )
        })?;
        return Ok(Described::Ome(ome));
    }
    Ok(shape(&text).unwrap_or(Described::Nothing))
}

/// The description's text. Its encoding is not written in the file: UTF-8 where it is that, else Latin-1.
fn description(pages: &mut Pages) -> String {
    let mut bytes = tiff::tags::ValueBuffer::empty(tiff::tags::Type::ASCII);
    let found = pages
        .decoder
        .image_ifd()
        .find_tag_buf(Tag::ImageDescription, &mut bytes);
    if !matches!(found, Ok(Some(_))) {
        return String::new();
    }
    let bytes = bytes.as_bytes();
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// `{"shape": [8, 10, 12]}`, perhaps with `"truncate": true`.
fn shape(text: &str) -> Option<Described> {
    let text = text.trim_matches(['\0', ' ', '\n']);
    let value: serde_json::Value = serde_json::from_str(text).ok()?;
    let axes = value.get("shape")?.as_array()?.iter();
    let axes: Option<Vec<usize>> = axes.map(|n| n.as_u64().map(|n| n as usize)).collect();
    let truncated = value.get("truncate").and_then(serde_json::Value::as_bool);
    Some(Described::Shape(axes?, truncated.unwrap_or(false)))
}

impl Described {
    pub fn is_imagej(&self) -> bool {
        matches!(self, Described::ImageJ(_))
    }

    /// What speaks against taking the file for one scan, in words.
    pub fn fault(&self) -> Option<String> {
        match self {
            Described::Nothing => None,
            Described::ImageJ(facts) => facts.fault(),
            Described::Ome(ome) => ome.fault(),
            Described::Shape(axes, _) => {
                let wide = axes.iter().filter(|n| **n > 1).count();
                // Rows of one pixel, and slices of one row, are rare but not four axes.
                (wide > 3).then(|| format!("holds an array of the shape {axes:?} (tifffile)"))
            }
        }
    }

    /// Slices that lie behind a single directory; 1 where there are none but the first.
    pub fn slices_of_one_page(&self, [nx, ny]: [usize; 2]) -> usize {
        match self {
            Described::ImageJ(facts) => facts.images.max(1),
            Described::Shape(axes, true) => {
                let all = axes.iter().try_fold(1usize, |n, m| n.checked_mul(*m));
                all.map_or(1, |all| all / (nx * ny).max(1)).max(1)
            }
            _ => 1,
        }
    }

    /// How many slices there are to be; None where it is not said.
    pub fn slices(&self) -> Option<usize> {
        match self {
            Described::ImageJ(facts) => Some(facts.images).filter(|n| *n > 0),
            Described::Ome(ome) => ome.slices(),
            _ => None,
        }
    }

    /// Voxel size of `slices` slices.
    pub fn size(&self, resolution: Resolution, slices: usize) -> Size {
        let mut size = Size::default();
        match self {
            Described::ImageJ(facts) => {
                if let Resolution::PerUnit(per_unit) = resolution {
                    size.pixel_mm = facts.pixel_mm(per_unit);
                }
                if slices > 1 {
                    size.slice_mm = facts.slice_mm();
                    size.notes = facts.notes();
                }
            }
            Described::Ome(ome) => {
                size.notes.clone_from(&ome.notes);
                let [x, y, z] = ome.size_mm;
                size.pixel_mm = x.zip(y).map(|(x, y)| [x, y]);
                size.slice_mm = z;
                let [_, _, z, _, t] = ome.sizes;
                if t > 1 && z <= 1 {
                    size.notes
                        .push(format!("OME calls the {t} slices times: read as slices"));
                }
            }
            Described::Nothing | Described::Shape(..) => {}
        }
        if let (None, Resolution::Pixel(pixel)) = (size.pixel_mm, resolution) {
            size.pixel_mm = Some(pixel);
            size.notes.push(format!(
                "the size of a pixel, {} × {} mm, is from the TIFF's resolution tags, which some programs fill with a printer's: hold it against the scanner's",
                pixel[0], pixel[1]
            ));
        }
        size
    }
}
