//! Owns how the bytes of one strip or tile become sample values: bit order, compression, differences, packing.

use crate::format::raw::{self, Layout, Scalar};
use flate2::read::ZlibDecoder;
use std::io::Read;
use weezl::BitOrder;
use weezl::decode::Decoder as LzwDecoder;

/// Why a strip or tile cannot be decoded.
pub type Step<T> = std::result::Result<T, String>;

/// Compressions of TIFF by their number in tag 259.
pub const NONE: u64 = 1;
pub const CCITT_GROUP_4: u64 = 4;
pub const LZW: u64 = 5;
pub const JPEG: u64 = 7;
pub const DEFLATE: u64 = 8;
pub const OLD_DEFLATE: u64 = 32946;
pub const PACKBITS: u64 = 32773;
pub const ZSTD: u64 = 50000;

/// The name of a compression, for messages.
pub fn name(compression: u64) -> String {
    let name = match compression {
        NONE => "none",
        2 => "CCITT run lengths",
        3 => "CCITT group 3 fax",
        CCITT_GROUP_4 => "CCITT group 4 fax",
        LZW => "LZW",
        6 => "JPEG of TIFF 6.0",
        JPEG => "JPEG",
        DEFLATE | OLD_DEFLATE => "deflate",
        9 | 10 | 34661 => "JBIG",
        22610 | 34934 => "JPEG XR",
        PACKBITS => "PackBits",
        32809 => "ThunderScan",
        33003..=33005 | 34712 => "JPEG 2000",
        34887 => "LERC",
        34925 => "LZMA",
        ZSTD => "Zstandard",
        50001 | 34927 => "WebP",
        50002 | 52546 => "JPEG XL",
        _ => return format!("number {compression}"),
    };
    name.to_owned()
}

/// Whether [`unpacked`] reads it.
pub fn is_read(compression: u64) -> bool {
    matches!(
        compression,
        NONE | LZW | DEFLATE | OLD_DEFLATE | PACKBITS | ZSTD
    )
}

/// Turns each byte round: the first pixel of fill order 2 is in the lowest bit.
pub fn reverse_bits(bytes: &mut [u8]) {
    bytes.iter_mut().for_each(|b| *b = b.reverse_bits());
}

/// The first `wanted` bytes of a compressed strip or tile. Checksums, where a compression has them, are held against what
/// was read.
pub fn unpacked(compression: u64, packed: Vec<u8>, wanted: usize) -> Step<Vec<u8>> {
    let found = match compression {
        NONE => packed,
        LZW => lzw(&packed, wanted)?,
        DEFLATE | OLD_DEFLATE => to_the_end(ZlibDecoder::new(&packed[..]), wanted)?,
        PACKBITS => packbits(&packed, wanted),
        ZSTD => {
            let decoder = ruzstd::decoding::StreamingDecoder::new(&packed[..]);
            to_the_end(decoder.map_err(|e| e.to_string())?, wanted)?
        }
        other => return Err(format!("compression {} is not read", name(other))),
    };
    if found.len() < wanted {
        return Err(format!(
            "{} bytes decoded where {wanted} were expected",
            found.len()
        ));
    }
    Ok(found)
}

/// Reads `wanted` bytes, then up to the end of the stream, where its checksum is.
fn to_the_end(mut source: impl Read, wanted: usize) -> Step<Vec<u8>> {
    let mut found = Vec::new();
    let mut part = Read::by_ref(&mut source).take(wanted as u64);
    part.read_to_end(&mut found).map_err(|e| e.to_string())?;
    // Padding after the last row is allowed, but not without end.
    let mut rest = source.take(1 << 20);
    std::io::copy(&mut rest, &mut std::io::sink()).map_err(|e| e.to_string())?;
    Ok(found)
}

fn lzw(packed: &[u8], wanted: usize) -> Step<Vec<u8>> {
    let mut decoder = LzwDecoder::with_tiff_size_switch(BitOrder::Msb, 8);
    // The most that LZW expands, so that a damaged size takes no memory.
    let mut found = vec![0; wanted.min(packed.len().saturating_mul(3000) + 4096)];
    let (mut at, mut filled) = (0, 0);
    while filled < found.len() {
        let step = decoder.decode_bytes(&packed[at..], &mut found[filled..]);
        at += step.consumed_in;
        filled += step.consumed_out;
        match step.status {
            Ok(weezl::LzwStatus::Ok) if step.consumed_in + step.consumed_out > 0 => {}
            Ok(_) => break,
            Err(e) => return Err(e.to_string()),
        }
    }
    found.truncate(filled);
    Ok(found)
}

/// Apple's run lengths: a count from 0 to 127 is followed by one byte more than it says, one from −1 to −127 by a byte to
/// repeat once more than its size.
fn packbits(packed: &[u8], wanted: usize) -> Vec<u8> {
    let mut found = Vec::new();
    let mut rest = packed;
    while found.len() < wanted
        && let Some((&count, after)) = rest.split_first()
    {
        let count = count as i8;
        let n = usize::from(count.unsigned_abs()) + 1;
        rest = match (count, after.split_first()) {
            (0.., _) => {
                let (literal, after) = after.split_at(n.min(after.len()));
                found.extend_from_slice(literal);
                after
            }
            (i8::MIN, _) | (_, None) => after,
            (_, Some((&value, after))) => {
                found.resize(found.len() + n, value);
                after
            }
        };
    }
    found.truncate(wanted);
    found
}

/// How the samples of a row are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Samples {
    pub bits: usize,
    /// TIFF's sample format: 1 unsigned, 2 signed, 3 float.
    pub format: u64,
    pub big_endian: bool,
    /// In a pixel.
    pub count: usize,
}

impl Samples {
    /// The type as NumPy calls it, where samples of it are read.
    pub fn name(&self) -> Option<String> {
        let known = match self.format {
            1 => (1..=32).contains(&self.bits) || self.bits == 64,
            2 => [8, 16, 32, 64].contains(&self.bits),
            _ => [16, 32, 64].contains(&self.bits),
        };
        let kind = ["", "uint", "int", "float"].get(self.format as usize)?;
        known.then(|| format!("{kind}{}", self.bits))
    }

    /// A type that fills whole bytes and that [`raw::decode`] reads.
    pub fn scalar(&self) -> Option<Scalar> {
        Some(match (self.format, self.bits) {
            (1, 8) => Scalar::U8,
            (1, 16) => Scalar::U16,
            (1, 32) => Scalar::U32,
            (1, 64) => Scalar::U64,
            (2, 8) => Scalar::I8,
            (2, 16) => Scalar::I16,
            (2, 32) => Scalar::I32,
            (2, 64) => Scalar::I64,
            (3, 16) => Scalar::F16,
            (3, 32) => Scalar::F32,
            (3, 64) => Scalar::F64,
            _ => return None,
        })
    }

    /// Bytes of a row of `width` pixels; each row begins at a whole byte.
    pub fn row_bytes(&self, width: usize) -> Option<usize> {
        Some(
            width
                .checked_mul(self.count)?
                .checked_mul(self.bits)?
                .div_ceil(8),
        )
    }

    /// Appends the values of whole rows of `width` pixels.
    pub fn decode(&self, rows: &[u8], width: usize, out: &mut Vec<f32>) {
        if let Some(scalar) = self.scalar() {
            let layout = Layout {
                scalar,
                big_endian: self.big_endian,
                n: [0; 3],
                slope: 1.0,
                intercept: 0.0,
            };
            return raw::decode(rows, &layout, out);
        }
        let per_row = width * self.count;
        for row in rows.chunks_exact((per_row * self.bits).div_ceil(8).max(1)) {
            if self.bits == 24 {
                out.extend(row.chunks_exact(3).map(|c| three_bytes(c, self.big_endian)));
            } else {
                out.extend((0..per_row).map(|i| packed_value(row, i * self.bits, self.bits)));
            }
        }
    }
}

fn three_bytes(c: &[u8], big_endian: bool) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|i| u32::from(c[i]));
    (match big_endian {
        true => a << 16 | b << 8 | c,
        false => c << 16 | b << 8 | a,
    }) as f32
}

/// `bits` (at most 32) from bit `at` of a row, highest first, whatever the byte order.
fn packed_value(row: &[u8], at: usize, bits: usize) -> f32 {
    let (first, end) = (at / 8, (at + bits).div_ceil(8));
    let word = row[first..end]
        .iter()
        .fold(0u64, |w, &b| w << 8 | u64::from(b));
    let value = word >> (8 * end - at - bits) & ((1u64 << bits) - 1);
    value as f32
}

/// Adds up rows in which each sample is stored as its difference to the one before (predictor 2).
pub fn add_up(rows: &mut [u8], row_bytes: usize, samples: &Samples) -> Step<()> {
    fn sum<const N: usize>(
        rows: &mut [u8],
        row_bytes: usize,
        samples: &Samples,
        add: impl Fn([u8; N], [u8; N]) -> [u8; N],
    ) {
        let back = N * samples.count;
        for row in rows.chunks_exact_mut(row_bytes) {
            for at in (back..row.len().saturating_sub(N - 1)).step_by(N) {
                let [a, b] = [at - back, at].map(|at| {
                    let mut word = [0; N];
                    word.copy_from_slice(&row[at..at + N]);
                    word
                });
                row[at..at + N].copy_from_slice(&add(a, b));
            }
        }
    }
    macro_rules! of {
        ($t:ty) => {
            match samples.big_endian {
                true => sum(rows, row_bytes, samples, |a, b| {
                    <$t>::from_be_bytes(a)
                        .wrapping_add(<$t>::from_be_bytes(b))
                        .to_be_bytes()
                }),
                false => sum(rows, row_bytes, samples, |a, b| {
                    <$t>::from_le_bytes(a)
                        .wrapping_add(<$t>::from_le_bytes(b))
                        .to_le_bytes()
                }),
            }
        };
    }
    match samples.bits {
        8 => of!(u8),
        16 => of!(u16),
        32 => of!(u32),
        64 => of!(u64),
        bits => {
            return Err(format!(
                "predictor 2 with samples of {bits} bits is not read"
            ));
        }
    }
    Ok(())
}

/// Undoes the predictor of floats (3): differences of bytes, all highest bytes of a row first. The values are big-endian
/// then, whatever the file is.
pub fn gather_floats(rows: &mut [u8], row_bytes: usize, samples: &Samples) -> Step<()> {
    let width = samples.bits / 8;
    if samples.format != 3 || ![2, 4, 8].contains(&width) {
        return Err("predictor 3 is for floats of 16, 32 or 64 bits".to_owned());
    }
    for row in rows.chunks_exact_mut(row_bytes) {
        for at in samples.count..row.len() {
            row[at] = row[at].wrapping_add(row[at - samples.count]);
        }
        let planes = row.to_vec();
        let values = row_bytes / width;
        for (i, value) in row.chunks_exact_mut(width).enumerate() {
            (0..width).for_each(|b| value[b] = planes[b * values + i]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(bits: usize, rows: &[u8], width: usize) -> Vec<f32> {
        let samples = Samples {
            bits,
            format: 1,
            big_endian: false,
            count: 1,
        };
        let mut out = Vec::new();
        samples.decode(rows, width, &mut out);
        out
    }

    #[test]
    fn samples_may_cross_a_byte() {
        assert_eq!(
            values(1, &[0b1010_0000, 0b0100_0000], 3),
            [1.0, 0.0, 1.0, 0.0, 1.0, 0.0]
        );
        assert_eq!(values(4, &[0x1F], 2), [1.0, 15.0]);
        assert_eq!(values(3, &[0b0010_1001, 0b1000_0000], 3), [1.0, 2.0, 3.0]);
        assert_eq!(values(12, &[0x12, 0x3A, 0xBC], 2), [291.0, 2748.0]);
        assert_eq!(values(24, &[1, 2, 3], 1), [197_121.0]);
    }

    #[test]
    fn run_lengths_are_expanded() {
        // Three literals, four of one value, a byte that does nothing, one literal.
        let packed = [2, 7, 8, 9, 0xFD, 5, 0x80, 0, 1];
        assert_eq!(packbits(&packed, 8), [7, 8, 9, 5, 5, 5, 5, 1]);
        assert_eq!(packbits(&packed, 5), [7, 8, 9, 5, 5]);
        assert!(unpacked(PACKBITS, packed.to_vec(), 9).is_err());
    }

    #[test]
    fn a_deflated_strip_is_read_up_to_its_checksum() {
        use flate2::{Compression, write::ZlibEncoder};
        use std::io::Write;
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&[3; 100]).unwrap();
        let mut packed = encoder.finish().unwrap();
        assert_eq!(unpacked(DEFLATE, packed.clone(), 100).unwrap(), [3; 100]);
        *packed.last_mut().unwrap() ^= 1;
        assert!(unpacked(DEFLATE, packed, 100).is_err());
    }
}
