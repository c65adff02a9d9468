//! Owns Scanco AIM, versions 2 and 3 (and 1), all stored types, the frame of invalid voxels, and its calibration.
//! Layout after AimIO (Nodwell, Numerics88). Names of persons in the processing log are not taken over.

use crate::error::{Error, Result};
use crate::format::calibration::Calibration;
use crate::format::raw;
use crate::format::raw::{Layout, Scalar};
use crate::image::scanco::{i32_at, i64_at, vax_f32};
use crate::image::stored::Stored;
use std::io::Read;
use std::path::Path;

const ADVICE: &str = "the file is truncated or no AIM: copy it again in binary mode";
/// Pre-header, image header and a processing log.
const HEAD: u64 = 1 << 22;

struct Header {
    version: u8,
    storage: i32,
    n: [i64; 3],
    /// Voxels on each side that are not valid.
    frame: [i64; 3],
    spacing_mm: [f64; 3],
    log: String,
    data_at: u64,
    data_bytes: u64,
}

pub fn read(path: &Path) -> Result<Stored> {
    let bytes = raw::head(path, HEAD)?;
    let broken = |found: &str| Error::file(path, found, ADVICE);
    let header = header(&bytes).ok_or_else(|| broken("has no readable AIM header"))?;
    let n = header.n.map(|n| usize::try_from(n).unwrap_or(0));
    let frame = header.frame.map(|o| usize::try_from(o).unwrap_or(0));
    if n.contains(&0) || (0..3).any(|a| frame[a].saturating_mul(2) >= n[a]) {
        return Err(broken(&format!(
            "has unusable dimensions {:?} (frame {:?})",
            header.n, header.frame
        )));
    }
    let (values, stored_as) = voxels(path, &header, n, frame)?;
    let mut notes = Vec::new();
    let (n, values) = without_frame(n, frame, values, &mut notes);
    let calibration = calibration(&header.log);
    Ok(Stored {
        format: format!("Scanco AIM v{}, {stored_as}", header.version),
        n,
        values,
        spacing_mm: Some(header.spacing_mm),
        calibration: Some(calibration),
        details: calibration.details(),
        notes,
        ..Stored::default()
    })
}

fn header(bytes: &[u8]) -> Option<Header> {
    let v3 = bytes.starts_with(b"AIMDATA_V030   ");
    let start = if v3 { 16 } else { 0 };
    let word = if v3 { 8 } else { 4 };
    let size = |i: usize| -> Option<u64> {
        let at = start + i * word;
        let v = if v3 {
            i64_at(bytes, at)?
        } else {
            i64::from(i32_at(bytes, at)?)
        };
        u64::try_from(v).ok()
    };
    let pre = size(0)?;
    if pre > 64 || (!v3 && pre > 20) || pre < 4 * word as u64 {
        return None;
    }
    let (image, log, data) = (size(1)?, size(2)?, size(3)?);
    let image_at = start + usize::try_from(pre).ok()?;
    let log_at = image_at.checked_add(usize::try_from(image).ok()?)?;
    let log_end = log_at.checked_add(usize::try_from(log).ok()?)?;
    let fields = bytes.get(image_at..log_at)?;
    let text = String::from_utf8_lossy(bytes.get(log_at..log_end)?).into_owned();
    let ints = |at: usize| -> Option<[i64; 3]> {
        let one = |a: usize| {
            if v3 {
                i64_at(fields, at + 8 * a)
            } else {
                i32_at(fields, at + 4 * a).map(i64::from)
            }
        };
        Some([one(0)?, one(1)?, one(2)?])
    };
    let float = |at: usize| Some(f64::from(vax_f32(fields.get(at..at + 4)?.try_into().ok()?)));
    // Offsets of type, dimensions, frame and voxel size in the image header of each version.
    let (version, storage, n, frame, spacing_mm) = match image {
        224 => {
            let nano = ints(184)?;
            (
                3,
                i32_at(fields, 12)?,
                ints(40)?,
                ints(64)?,
                nano.map(|v| v as f64 / 1e6),
            )
        }
        140 => (
            2,
            i32_at(fields, 20)?,
            ints(36)?,
            ints(48)?,
            [float(108)?, float(112)?, float(116)?],
        ),
        92 | 96 => (
            1,
            i32_at(fields, 16)?,
            ints(20)?,
            ints(32)?,
            [float(68)?; 3],
        ),
        _ => return None,
    };
    // Floats of 24 bits: 0.082 mm, not 0.08200000226497650.
    let spacing_mm = spacing_mm.map(|v| (v * 1e7).round() / 1e7);
    Some(Header {
        version,
        storage,
        n,
        frame,
        spacing_mm,
        log: text,
        data_at: log_end as u64,
        data_bytes: data,
    })
}

/// Storage types: `(code << 16) + bytes`.
const CHAR: i32 = (1 << 16) + 1;
const SHORT: i32 = (2 << 16) + 2;
const FLOAT: i32 = (4 << 16) + 4;
const BITS: i32 = (6 << 16) + 1;
const CHAR_RUNS: i32 = (8 << 16) + 2;
const BINARY_RUNS: i32 = (21 << 16) + 1;

fn voxels(
    path: &Path,
    header: &Header,
    n: [usize; 3],
    frame: [usize; 3],
) -> Result<(Vec<f32>, &'static str)> {
    let (mut source, file_bytes, _) = raw::open(path)?;
    raw::skip(&mut *source, header.data_at);
    let left = file_bytes.saturating_sub(header.data_at);
    let mut plain = |scalar| {
        let layout = Layout {
            scalar,
            big_endian: false,
            n,
            slope: 1.0,
            intercept: 0.0,
        };
        raw::read(&mut *source, &layout, path, left, false)
    };
    let wide = header.version == 3;
    match header.storage {
        CHAR => Ok((plain(Scalar::I8)?, "char")),
        SHORT => Ok((plain(Scalar::I16)?, "short")),
        // Read as bits, then decoded from VAX order.
        FLOAT => Ok((
            plain(Scalar::F32)?
                .into_iter()
                .map(|v| vax_f32(v.to_le_bytes()))
                .collect(),
            "float",
        )),
        BITS | CHAR_RUNS | BINARY_RUNS => {
            let mut packed = Vec::new();
            let broken =
                |e: std::io::Error| Error::file(path, format!("cannot be read: {e}"), ADVICE);
            source
                .take(header.data_bytes.min(left))
                .read_to_end(&mut packed)
                .map_err(broken)?;
            let inner: [usize; 3] = std::array::from_fn(|a| n[a] - 2 * frame[a]);
            let (unpacked, stored_as) = match header.storage {
                BITS => (bits(&packed, n), "bits"),
                CHAR_RUNS => (
                    char_runs(&packed, inner, wide).map(|v| framed(&v, n, frame)),
                    "char runs",
                ),
                _ => (
                    binary_runs(&packed, inner, wide).map(|v| framed(&v, n, frame)),
                    "binary runs",
                ),
            };
            unpacked.map(|v| (v, stored_as)).ok_or_else(|| {
                Error::file(
                    path,
                    "its packed voxels end early or do not add up to its dimensions",
                    ADVICE,
                )
            })
        }
        other => Err(Error::file(
            path,
            format!("stores voxels as AIM type {other:#x}, which is not read"),
            "export it as short or char",
        )),
    }
}

fn product(n: [usize; 3]) -> Option<usize> {
    n.iter().try_fold(1usize, |p, &n| p.checked_mul(n))
}

/// Blocks of 2 × 2 × 2 voxels, a bit each; the last byte is the value of a set bit.
fn bits(packed: &[u8], n: [usize; 3]) -> Option<Vec<f32>> {
    let [bx, by, bz] = n.map(|n| n.div_ceil(2));
    let (value, blocks) = packed.split_last()?;
    if blocks.len() != product([bx, by, bz])? {
        return None;
    }
    let value = f32::from(*value as i8);
    let mut out = Vec::with_capacity(product(n)?);
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let byte = blocks[i / 2 + bx * (j / 2 + by * (k / 2))];
                let bit = (k % 2) * 4 + (j % 2) * 2 + i % 2;
                out.push(if byte >> bit & 1 == 1 { value } else { 0.0 });
            }
        }
    }
    Some(out)
}

/// Pairs of value and length after the block's own size.
fn char_runs(packed: &[u8], n: [usize; 3], wide: bool) -> Option<Vec<f32>> {
    let pairs = packed.get(if wide { 8 } else { 4 }..)?;
    let voxels = product(n).filter(|v| *v <= pairs.len().saturating_mul(255))?;
    let mut out = Vec::with_capacity(voxels);
    for pair in pairs.chunks_exact(2) {
        let length = usize::from(pair[1]).min(voxels - out.len());
        out.extend(std::iter::repeat_n(f32::from(pair[0] as i8), length));
    }
    (out.len() == voxels).then_some(out)
}

/// Lengths of runs of two values in turn, after the block's size and the values; 255 is 254 voxels without a change.
fn binary_runs(packed: &[u8], n: [usize; 3], wide: bool) -> Option<Vec<f32>> {
    let rest = packed.get(if wide { 8 } else { 4 }..)?;
    let ([a, b], lengths) = rest.split_first_chunk::<2>()?;
    let voxels = product(n).filter(|v| *v <= lengths.len().saturating_mul(254))?;
    let values = [f32::from(*a as i8), f32::from(*b as i8)];
    let mut out = Vec::with_capacity(voxels);
    let mut which = 0;
    for &length in lengths {
        let run = usize::from(length.min(254)).min(voxels - out.len());
        out.extend(std::iter::repeat_n(values[which], run));
        if length != 255 {
            which = 1 - which;
        }
    }
    (out.len() == voxels).then_some(out)
}

/// Run-packed images leave their frame out: put zeros back.
fn framed(inner: &[f32], n: [usize; 3], frame: [usize; 3]) -> Vec<f32> {
    if frame == [0; 3] {
        return inner.to_vec();
    }
    let mut out = vec![0.0; n[0] * n[1] * n[2]];
    let row = n[0] - 2 * frame[0];
    let mut rows = inner.chunks_exact(row);
    for k in frame[2]..n[2] - frame[2] {
        for j in frame[1]..n[1] - frame[1] {
            let at = (k * n[1] + j) * n[0] + frame[0];
            if let Some(values) = rows.next() {
                out[at..at + row].copy_from_slice(values);
            }
        }
    }
    out
}

/// The frame holds no data: it is cut off.
fn without_frame(
    n: [usize; 3],
    frame: [usize; 3],
    values: Vec<f32>,
    notes: &mut Vec<String>,
) -> ([usize; 3], Vec<f32>) {
    if frame == [0; 3] {
        return (n, values);
    }
    notes.push(format!(
        "a frame of {frame:?} voxels without data was cut off each side"
    ));
    let crop = std::array::from_fn(|a| [frame[a], n[a] - frame[a]]);
    let all = crate::volume::Volume::from_vec(crate::grid::Grid::new(n, [1.0; 3]), values);
    let inner = all.cropped(&crop);
    (inner.grid.n, inner.as_slice().to_vec())
}

/// Constants in the processing log.
fn calibration(log: &str) -> Calibration {
    let number = |label: &str| {
        let rest = log.split_once(label)?.1;
        rest.split_whitespace()
            .next()?
            .parse::<f64>()
            .ok()
            .filter(|v| v.is_finite())
    };
    Calibration {
        mu_scaling: number("Mu_Scaling"),
        mu_water: number("HU: mu water"),
        density: number("Density: slope")
            .zip(number("Density: intercept"))
            .map(|(a, b)| [a, b]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_voxels_are_unpacked() {
        // 3 × 1 × 1: two blocks; bits 0 and 1 of the first, bit 0 of the second.
        assert_eq!(
            bits(&[0b01, 0b01, 127], [3, 1, 1]),
            Some(vec![127.0, 0.0, 127.0])
        );
        assert_eq!(
            char_runs(&[0, 0, 0, 0, 5, 2, 251, 1], [3, 1, 1], false),
            Some(vec![5.0, 5.0, -5.0])
        );
        let long = binary_runs(&[0, 0, 0, 0, 0, 127, 255, 6, 40], [300, 1, 1], false).unwrap();
        assert_eq!(long.iter().filter(|v| **v == 0.0).count(), 260);
        assert_eq!(long[260], 127.0);
        assert_eq!(char_runs(&[0, 0, 0, 0, 5, 2], [3, 1, 1], false), None);
    }

    #[test]
    fn a_log_gives_its_constants() {
        let log = "! Mu_Scaling                      8192\nHU: mu water   0.24090\n\
                   Density: slope   1603.51904\nDensity: intercept -391.209015\n";
        let c = calibration(log);
        assert_eq!((c.mu_scaling, c.mu_water), (Some(8192.0), Some(0.2409)));
        assert_eq!(c.density, Some([1603.51904, -391.209015]));
        assert_eq!(calibration("nothing"), Calibration::default());
    }
}
