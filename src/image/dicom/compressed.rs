//! Owns compressed pixels: RLE here, JPEG by a decoder in Rust. Other compressions are refused with the programs that undo them.

use jpeg_decoder::{Decoder, PixelFormat};

/// What decompresses the pixels of a transfer syntax.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Codec {
    Rle,
    Jpeg,
}

/// Transfer syntaxes and their names.
const NAMES: [(&str, &str); 17] = [
    ("1.2.840.10008.1.2.5", "RLE"),
    ("1.2.840.10008.1.2.4.50", "JPEG baseline"),
    ("1.2.840.10008.1.2.4.51", "JPEG extended"),
    ("1.2.840.10008.1.2.4.57", "JPEG lossless"),
    ("1.2.840.10008.1.2.4.70", "JPEG lossless"),
    ("1.2.840.10008.1.2.4.80", "JPEG-LS"),
    ("1.2.840.10008.1.2.4.81", "JPEG-LS, lossy"),
    ("1.2.840.10008.1.2.4.90", "JPEG 2000"),
    ("1.2.840.10008.1.2.4.91", "JPEG 2000, lossy"),
    ("1.2.840.10008.1.2.4.92", "JPEG 2000"),
    ("1.2.840.10008.1.2.4.93", "JPEG 2000"),
    ("1.2.840.10008.1.2.4.201", "HTJ2K"),
    ("1.2.840.10008.1.2.4.202", "HTJ2K"),
    ("1.2.840.10008.1.2.4.203", "HTJ2K"),
    ("1.2.840.10008.1.2.4.100", "MPEG-2"),
    ("1.2.840.10008.1.2.4.110", "JPEG XL"),
    ("1.2.840.10008.1.2.8.1", "deflated frames"),
];

pub fn name(syntax: &str) -> String {
    let found = NAMES.iter().find(|(uid, _)| *uid == syntax);
    found.map_or_else(
        || format!("transfer syntax {syntax}"),
        |(_, name)| name.to_string(),
    )
}

/// The program that undoes a compression which is not read.
pub fn way_out(syntax: &str) -> &'static str {
    match name(syntax).split(',').next() {
        Some("JPEG-LS") => {
            "decompress each file (dcmdjpls IN OUT of DCMTK, or gdcmconv --raw IN OUT of GDCM), or convert the series to NIfTI (dcm2niix)"
        }
        Some("JPEG 2000") => {
            "decompress each file (gdcmconv --raw IN OUT of GDCM), or convert the series to NIfTI (dcm2niix)"
        }
        Some("HTJ2K") => {
            "decompress each file (in Python, pydicom with pylibjpeg-openjpeg: ds = pydicom.dcmread(IN); ds.decompress(); ds.save_as(OUT)), or export the series again as uncompressed DICOM"
        }
        _ => {
            "decompress each file (gdcmconv --raw IN OUT of GDCM), or export the series again as uncompressed DICOM"
        }
    }
}

pub fn codec(syntax: &str) -> Option<Codec> {
    match name(syntax).split_whitespace().next() {
        Some("RLE") => Some(Codec::Rle),
        Some("JPEG") if !syntax.starts_with("1.2.840.10008.1.2.4.9") => match syntax {
            "1.2.840.10008.1.2.4.110" => None,
            _ => Some(Codec::Jpeg),
        },
        _ => None,
    }
}

/// The bytes of each frame's fragments. One fragment a frame, or several that the table of offsets divides.
///
/// # Errors
/// In words, where fragments cannot be divided among the frames.
pub fn frames<'a>(fragments: &[&'a [u8]], frames: usize) -> Result<Vec<Vec<&'a [u8]>>, String> {
    let [table, parts @ ..] = fragments else {
        return Err("it holds no compressed pixels".into());
    };
    if frames == 1 {
        return Ok(vec![parts.to_vec()]);
    }
    if parts.len() == frames {
        return Ok(parts.iter().map(|part| vec![*part]).collect());
    }
    let offsets: Vec<usize> = table
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
        .collect();
    if offsets.len() != frames {
        return Err(format!(
            "its {} fragments cannot be divided among {frames} frames: their table has {} offsets",
            parts.len(),
            offsets.len()
        ));
    }
    let mut divided = vec![Vec::new(); frames];
    let mut at = 0;
    for part in parts {
        let frame = offsets.partition_point(|offset| *offset <= at);
        if let Some(of) = frame.checked_sub(1).and_then(|f| divided.get_mut(f)) {
            of.push(*part);
        }
        at += part.len() + 8;
    }
    Ok(divided)
}

/// One frame's samples, `bytes` each, little-endian.
///
/// # Errors
/// In words, where the stream is damaged or is of another size than `rows × columns`.
pub fn decode(
    codec: Codec,
    parts: &[&[u8]],
    [rows, columns]: [usize; 2],
    bytes: usize,
) -> Result<Vec<u8>, String> {
    let whole = parts.concat();
    match codec {
        Codec::Rle => rle(&whole, rows * columns, bytes),
        Codec::Jpeg => jpeg(&whole, [rows, columns], bytes),
    }
}

/// PS3.5, annex G: a segment for each byte of the samples, the most significant first, each packed as PackBits does.
fn rle(frame: &[u8], pixels: usize, bytes: usize) -> Result<Vec<u8>, String> {
    let word = |i: usize| -> Option<usize> {
        let b = frame.get(4 * i..4 * i + 4)?;
        Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    if word(0) != Some(bytes) {
        return Err(format!(
            "its RLE data should have {bytes} segments, they have {}",
            word(0).unwrap_or(0)
        ));
    }
    // A run of two bytes makes at most 128.
    if pixels > frame.len().saturating_mul(64) {
        return Err(format!(
            "{pixels} pixels cannot come of {} bytes",
            frame.len()
        ));
    }
    let mut out = vec![0; pixels * bytes];
    for segment in 0..bytes {
        let from = word(1 + segment).unwrap_or(usize::MAX);
        let to = match segment + 1 < bytes {
            true => word(2 + segment).unwrap_or(0),
            false => frame.len(),
        };
        let packed = frame
            .get(from..to)
            .ok_or("its RLE segments lie outside their frame")?;
        unpack(packed, &mut out[bytes - 1 - segment..], bytes, pixels)?;
    }
    Ok(out)
}

/// Every `step`-th byte of `out` from a packed segment.
fn unpack(packed: &[u8], out: &mut [u8], step: usize, pixels: usize) -> Result<(), String> {
    let mut places = out.iter_mut().step_by(step).take(pixels);
    let (mut at, mut left) = (0, pixels);
    while left > 0 {
        let Some(&head) = packed.get(at) else {
            return Err("its RLE data end before the last pixel".into());
        };
        at += 1;
        let count = match head {
            128 => continue,
            0..=127 => usize::from(head) + 1,
            129.. => 257 - usize::from(head),
        };
        let run = count.min(left);
        if head < 128 {
            let literal = packed
                .get(at..at + run)
                .ok_or("its RLE data end inside a run")?;
            literal.iter().for_each(|v| {
                if let Some(place) = places.next() {
                    *place = *v;
                }
            });
            at += count;
        } else {
            let value = *packed.get(at).ok_or("its RLE data end inside a run")?;
            places.by_ref().take(run).for_each(|place| *place = value);
            at += 1;
        }
        left -= run;
    }
    Ok(())
}

fn jpeg(stream: &[u8], [rows, columns]: [usize; 2], bytes: usize) -> Result<Vec<u8>, String> {
    let damaged = |e: jpeg_decoder::Error| format!("its JPEG stream is not read ({e})");
    let mut decoder = Decoder::new(stream);
    decoder.set_max_decoding_buffer_size(rows * columns * bytes);
    decoder.read_info().map_err(damaged)?;
    let info = decoder.info().ok_or("its JPEG stream has no header")?;
    let found = [usize::from(info.height), usize::from(info.width)];
    let wide = match info.pixel_format {
        PixelFormat::L8 => 1,
        PixelFormat::L16 => 2,
        _ => return Err("its JPEG stream is in colour".into()),
    };
    if found != [rows, columns] || wide > bytes {
        return Err(format!(
            "its JPEG stream has {} × {} pixels of {} bits, the header says {columns} × {rows} of {}",
            found[1],
            found[0],
            8 * wide,
            8 * bytes
        ));
    }
    // The decoder gives two bytes in the machine's order.
    let decoded = decoder.decode().map_err(damaged)?;
    Ok(match (wide, bytes) {
        (1, 2) => decoded.iter().flat_map(|v| [*v, 0]).collect(),
        (2, _) => decoded
            .chunks_exact(2)
            .flat_map(|v| u16::from_ne_bytes([v[0], v[1]]).to_le_bytes())
            .collect(),
        _ => decoded,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_literals_are_unpacked_into_the_bytes_of_their_samples() {
        // Four pixels 0x0102, 0x0103, 0x0104, 0x0104: a run of the high byte, literals and a run of the low one.
        let (high, low) = ([253u8, 1], [1u8, 2, 3, 255, 4, 0]);
        let mut frame = vec![0u8; 64];
        frame[0] = 2;
        frame[4] = 64;
        frame[8] = 66;
        frame.extend(high);
        frame.extend(low);
        assert_eq!(rle(&frame, 4, 2).unwrap(), [2, 1, 3, 1, 4, 1, 4, 1]);
        for cut in [0, 3, 60, 65, 67, 69] {
            assert!(rle(&frame[..cut], 4, 2).is_err(), "{cut}");
        }
    }

    #[test]
    fn fragments_are_divided_by_their_table() {
        let (a, b, c) = ([1u8; 4], [2u8; 6], [3u8; 2]);
        let table = [0u32, 26].map(u32::to_le_bytes).concat();
        let divided = frames(&[&table, &a, &b, &c], 2).unwrap();
        assert_eq!(divided, [vec![&a[..], &b], vec![&c[..]]]);
        assert!(frames(&[&[], &a, &b, &c], 2).is_err());
        assert_eq!(frames(&[&[], &a, &b], 1).unwrap(), [vec![&a[..], &b]]);
    }
}
