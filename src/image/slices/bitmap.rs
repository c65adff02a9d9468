//! Owns PNG and BMP slices. Neither carries a voxel size.

use crate::error::{Error, Result};
use crate::image::imagej::Grey;
use crate::image::raw::MAX_EXPANSION;
use crate::image::stored::Slice;
use image::DynamicImage;
use std::path::Path;

/// Bytes of pixels per byte of a file: deflate's expansion, times four where a palette becomes colours.
const MAX_PIXEL_BYTES: u64 = 4 * MAX_EXPANSION;

pub fn read_slice(path: &Path) -> Result<Slice> {
    let wrong = |found: String, advice: &str| Error::file(path, found, advice);
    let mut reader = image::ImageReader::open(path).map_err(|e| {
        wrong(
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
    })?;
    let file_bytes = std::fs::metadata(path).map_or(0, |m| m.len());
    let mut limits = image::Limits::default();
    // The decoder takes memory for the whole image before it finds that the file ends: sizes must be believable.
    limits.max_alloc = Some((1 << 20) + MAX_PIXEL_BYTES * file_bytes);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| {
        wrong(
            format!("cannot be decoded ({e})"),
            "the file is damaged: export it again",
        )
    })?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let (values, stored_as) = match image {
        DynamicImage::ImageLuma8(i) => (i.into_raw().into_iter().map(f32::from).collect(), "uint8"),
        DynamicImage::ImageLuma16(i) => {
            (i.into_raw().into_iter().map(f32::from).collect(), "uint16")
        }
        // Grey values of a palette come out as equal red, green and blue.
        other => {
            let rgb = other.to_rgb8();
            if rgb.pixels().any(|p| p[0] != p[1] || p[1] != p[2]) {
                return Err(wrong(
                    "is a colour image, grey values are expected".into(),
                    "convert it to 8- or 16-bit grey values",
                ));
            }
            (rgb.pixels().map(|p| f32::from(p[0])).collect(), "uint8")
        }
    };
    Ok(Slice {
        width,
        height,
        values,
        stored_as,
        pixel_mm: None,
        slice_mm: None,
        grey: Grey::default(),
    })
}
