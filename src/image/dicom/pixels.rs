//! Owns the pixels of a DICOM file: frames out of it, to their slices of the volume.

use super::ADVICE;
use super::coding::convert;
use super::compressed;
use super::elements::{PIXEL_DATA, Value};
use super::head::{self, Image, unsound};
use crate::error::{Error, Result};
use std::borrow::Cow;

/// Writes frames of `image` to their places in the volume: number of the frame, and its slice.
pub fn decode(image: &Image, slices: Vec<(usize, &mut [f32])>) -> Result<()> {
    let data = head::data(&image.path)?;
    let set = data.elements().map_err(|e| unsound(&image.path, &e))?;
    let wrong = |found: String| Error::file(&image.path, found, ADVICE);
    let frame_bytes = image.rows * image.columns * image.coding.bytes;
    let parts = match (set.get(PIXEL_DATA), image.codec) {
        (Some(Value::Fragments(fragments)), Some(_)) => {
            compressed::frames(fragments, image.frames.len()).map_err(wrong)?
        }
        (Some(Value::Bytes(bytes)), None) => {
            let wanted = frame_bytes * image.frames.len();
            if bytes.len() < wanted {
                return Err(wrong(format!(
                    "holds {} bytes of pixels where {wanted} are expected",
                    bytes.len()
                )));
            }
            bytes
                .chunks_exact(frame_bytes)
                .map(|frame| vec![frame])
                .collect()
        }
        _ => {
            return Err(wrong(
                "its pixels are not coded as its transfer syntax says".into(),
            ));
        }
    };
    for (index, out) in slices {
        let stored = match image.codec {
            None => Cow::Borrowed(parts[index][0]),
            Some(codec) => {
                let size = [image.rows, image.columns];
                let samples = compressed::decode(codec, &parts[index], size, image.coding.bytes);
                Cow::Owned(samples.map_err(wrong)?)
            }
        };
        // Compressed samples are little-endian, whatever the file is.
        let big_endian = set.big_endian && image.codec.is_none();
        convert(
            &stored,
            &image.coding,
            big_endian,
            &image.frames[index].scale,
            out,
        );
    }
    Ok(())
}
