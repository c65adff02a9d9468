//! Owns the assembly of a page from its strips or tiles.

use super::storage::{Pixel, Storage};
use crate::format::strips;
use std::io::{Read, Seek, SeekFrom};

/// Why a page has no grey values.
#[derive(Debug)]
pub enum Fault {
    Damaged(String),
    /// Its pixels are colours, or grey values that cannot be restored.
    NotGrey(&'static str),
}

impl From<String> for Fault {
    fn from(found: String) -> Self {
        Fault::Damaged(found)
    }
}

type Step<T> = std::result::Result<T, Fault>;

/// Where the bytes of strips or tiles are in the file.
pub struct Places {
    pub offsets: Vec<u64>,
    pub bytes: Vec<u64>,
}

/// All pixels of a page, row by row.
pub fn values<R: Read + Seek>(
    storage: &Storage,
    places: &Places,
    source: &mut R,
) -> Step<Vec<f32>> {
    let [across, down] = [
        storage.width.div_ceil(storage.chunk[0]),
        storage.height.div_ceil(storage.chunk[1]),
    ];
    if places.offsets.len() != across * down || places.bytes.len() != across * down {
        let found = format!(
            "{} strips or tiles where {} were expected",
            places.offsets.len(),
            across * down
        );
        return Err(found.into());
    }
    let mut page = Vec::new();
    if across == 1 && storage.chunk[0] == storage.width {
        for k in 0..down {
            let rows = storage.chunk[1].min(storage.height - k * storage.chunk[1]);
            chunk(
                storage,
                [places.offsets[k], places.bytes[k]],
                rows,
                source,
                &mut page,
            )?;
        }
        return Ok(page);
    }
    let mut tile = Vec::new();
    for k in 0..across * down {
        tile.clear();
        chunk(
            storage,
            [places.offsets[k], places.bytes[k]],
            storage.chunk[1],
            source,
            &mut tile,
        )?;
        let [x, y] = [k % across * storage.chunk[0], k / across * storage.chunk[1]];
        let width = storage.chunk[0].min(storage.width - x);
        let end = storage.height.min(y + storage.chunk[1]);
        // Memory is taken for what was decoded, not for what a header says.
        page.resize(page.len().max(end * storage.width), 0.0);
        let rows = tile.chunks_exact(storage.chunk[0]).take(end - y);
        for (row, values) in rows.enumerate() {
            let at = (y + row) * storage.width + x;
            page[at..at + width].copy_from_slice(&values[..width]);
        }
    }
    Ok(page)
}

/// Appends the grey values of `rows` rows of one strip or tile.
fn chunk<R: Read + Seek>(
    storage: &Storage,
    [offset, bytes]: [u64; 2],
    rows: usize,
    source: &mut R,
    out: &mut Vec<f32>,
) -> Step<()> {
    let mut samples = storage.samples;
    let width = storage.chunk[0];
    let too_large = || Fault::Damaged("its rows are too long".to_owned());
    let row_bytes = samples.row_bytes(width).ok_or_else(too_large)?;
    let wanted = row_bytes.checked_mul(rows).ok_or_else(too_large)?;
    // Some programs write no size, or a wrong one, of what is not compressed.
    let packed_bytes = match storage.compression {
        strips::NONE => wanted as u64,
        _ => bytes,
    };
    source
        .seek(SeekFrom::Start(offset))
        .map_err(|e| e.to_string())?;
    let mut packed = Vec::new();
    let mut part = Read::by_ref(source).take(packed_bytes);
    part.read_to_end(&mut packed).map_err(|e| e.to_string())?;
    if storage.reversed_bits {
        strips::reverse_bits(&mut packed);
    }
    let mut raw = strips::unpacked(storage.compression, packed, wanted)?;
    raw.truncate(wanted);
    match storage.predictor {
        1 => {}
        2 => strips::add_up(&mut raw, row_bytes, &samples)?,
        3 => {
            strips::gather_floats(&mut raw, row_bytes, &samples)?;
            samples.big_endian = true;
        }
        other => return Err(format!("predictor {other} is not known").into()),
    }
    if samples.count == 1 {
        samples.decode(&raw, width, out);
        return Ok(());
    }
    let mut pixels = Vec::with_capacity(rows * width * samples.count);
    samples.decode(&raw, width, &mut pixels);
    grey(&pixels, storage, out)
}

/// The grey value of pixels of several samples.
fn grey(pixels: &[f32], storage: &Storage, out: &mut Vec<f32>) -> Step<()> {
    let opaque = match storage.samples.format {
        3 => 1.0,
        _ => ((1u64 << storage.samples.bits.min(63)) - 1) as f32,
    };
    for pixel in pixels.chunks_exact(storage.samples.count) {
        match storage.pixel {
            Pixel::GreyAlpha { multiplied: true } if pixel[1] != opaque => {
                return Err(Fault::NotGrey(
                    "holds grey values that were multiplied by an opacity (alpha) which is not 1 everywhere",
                ));
            }
            Pixel::Colour if pixel[0] != pixel[1] || pixel[1] != pixel[2] => {
                return Err(Fault::NotGrey(
                    "is a colour image, grey values are expected",
                ));
            }
            _ => out.push(pixel[0]),
        }
    }
    Ok(())
}
