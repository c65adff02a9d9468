//! Owns PNG and BMP slices. Neither carries a voxel size.
//!
//! Grey values of 1 to 16 bits are read as stored, opacity (alpha) is left out, a palette is applied: what it shows is the
//! value, in both formats. Colours are read where red, green and blue are equal, with all their bits, and refused otherwise.

use crate::error::{Error, Result};
use crate::format::raw::MAX_EXPANSION;
use crate::image::description::imagej::Grey;
use crate::image::stored::Slice;
use image::DynamicImage;
use std::path::Path;

/// Bytes of pixels per byte of a file: deflate's expansion, times four where a palette becomes colours.
const MAX_PIXEL_BYTES: u64 = 4 * MAX_EXPANSION;

pub fn read_slice(path: &Path) -> Result<Slice> {
    let image = decode(path)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let mut notes = Vec::new();
    if image.color().has_alpha() {
        notes.push("the opacity (alpha) of pixels is left out: grey values are as stored".into());
    }
    let channels = usize::from(image.color().channel_count());
    let colours = channels >= 3;
    if colours {
        notes.push(
            "red, green and blue are equal everywhere (or a palette's): read as grey values".into(),
        );
    }
    let grey = match image {
        DynamicImage::ImageLuma8(i) => first_of(i.into_raw(), 1),
        DynamicImage::ImageLumaA8(i) => first_of(i.into_raw(), 2),
        DynamicImage::ImageRgb8(i) => first_of(i.into_raw(), 3),
        DynamicImage::ImageRgba8(i) => first_of(i.into_raw(), 4),
        DynamicImage::ImageLuma16(i) => first_of(i.into_raw(), 1),
        DynamicImage::ImageLumaA16(i) => first_of(i.into_raw(), 2),
        DynamicImage::ImageRgb16(i) => first_of(i.into_raw(), 3),
        DynamicImage::ImageRgba16(i) => first_of(i.into_raw(), 4),
        _ => None,
    };
    let Some((values, stored_as)) = grey else {
        return Err(Error::file(
            path,
            "is a colour image, grey values are expected",
            "convert it to 8- or 16-bit grey values",
        ));
    };
    Ok(Slice {
        width,
        height,
        values,
        stored_as: stored_as.into(),
        pixel_mm: None,
        slice_mm: None,
        grey: Grey::default(),
        notes,
    })
}

fn decode(path: &Path) -> Result<DynamicImage> {
    let mut reader = image::ImageReader::open(path).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
        .caused_by(e)
    })?;
    let file_bytes = std::fs::metadata(path).map_or(0, |m| m.len());
    let mut limits = image::Limits::default();
    // The decoder takes memory for the whole image before it finds that the file ends: sizes must be believable.
    limits.max_alloc = Some((1 << 20) + MAX_PIXEL_BYTES * file_bytes);
    reader.limits(limits);
    reader.decode().map_err(|e| {
        Error::file(
            path,
            format!("cannot be decoded ({e})"),
            "the file is damaged: export it again",
        )
        .caused_by(e)
    })
}

/// Whole numbers of 8 or 16 bits.
trait Sample: Copy + PartialEq {
    const NAME: &'static str;
    fn value(self) -> f32;
}

impl Sample for u8 {
    const NAME: &'static str = "uint8";
    fn value(self) -> f32 {
        self.into()
    }
}

impl Sample for u16 {
    const NAME: &'static str = "uint16";
    fn value(self) -> f32 {
        self.into()
    }
}

/// The first sample of each pixel; None where red, green and blue differ.
fn first_of<T: Sample>(samples: Vec<T>, channels: usize) -> Option<(Vec<f32>, &'static str)> {
    let pixels = samples.chunks_exact(channels);
    let coloured = |p: &[T]| channels >= 3 && (p[0] != p[1] || p[1] != p[2]);
    if pixels.clone().any(coloured) {
        return None;
    }
    Some((pixels.map(|p| p[0].value()).collect(), T::NAME))
}
