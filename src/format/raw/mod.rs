//! Owns the decoding of raw voxel streams: any scalar type and byte order to `f32`, with slope and intercept.
//!
//! Sizes in headers are not believed: what a file cannot hold is refused before memory is taken.

pub mod pattern;

use crate::error::{Error, Result};
use flate2::bufread::GzDecoder;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::path::Path;

/// How one voxel is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

impl Scalar {
    pub fn bytes(self) -> usize {
        match self {
            Scalar::U8 | Scalar::I8 => 1,
            Scalar::U16 | Scalar::I16 | Scalar::F16 => 2,
            Scalar::U32 | Scalar::I32 | Scalar::F32 => 4,
            Scalar::U64 | Scalar::I64 | Scalar::F64 => 8,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Scalar::U8 => "uint8",
            Scalar::I8 => "int8",
            Scalar::U16 => "uint16",
            Scalar::I16 => "int16",
            Scalar::U32 => "uint32",
            Scalar::I32 => "int32",
            Scalar::U64 => "uint64",
            Scalar::I64 => "int64",
            Scalar::F16 => "float16",
            Scalar::F32 => "float32",
            Scalar::F64 => "float64",
        }
    }
}

pub type Source = Box<dyn Read>;

/// The first bytes of any gzip stream.
pub const GZIP: [u8; 2] = [0x1f, 0x8b];

/// A file's bytes as they are, and their number.
pub fn open_plain(path: &Path) -> Result<(BufReader<File>, u64)> {
    let unreadable = |e: std::io::Error| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
    };
    let file = File::open(path).map_err(unreadable)?;
    let file_bytes = file.metadata().map_err(unreadable)?.len();
    Ok((BufReader::with_capacity(1 << 18, file), file_bytes))
}

/// A file as a stream, its size on disk, and whether it was compressed (gzip, by its first bytes, decompressed here).
pub fn open(path: &Path) -> Result<(Source, u64, bool)> {
    let (file, file_bytes) = open_plain(path)?;
    let (source, compressed) = decompressed(file);
    Ok((source, file_bytes, compressed))
}

/// The same of the bytes of a file that was read before.
pub fn of_bytes(bytes: Vec<u8>) -> (Source, u64, bool) {
    let file_bytes = bytes.len() as u64;
    let (source, compressed) = decompressed(Cursor::new(bytes));
    (source, file_bytes, compressed)
}

fn decompressed(mut file: impl BufRead + 'static) -> (Source, bool) {
    match file.fill_buf().is_ok_and(|start| start.starts_with(&GZIP)) {
        true => (Box::new(gunzip(file)), true),
        false => (Box::new(file), false),
    }
}

/// The content of a gzip stream. Read to its end, every member is held to its checksum.
pub fn gunzip<R: BufRead>(compressed: R) -> impl Read {
    Members(Some(GzDecoder::new(compressed)))
}

/// One member after another. Bytes after the last that begin no member are passed over, as gzip itself does.
struct Members<R>(Option<GzDecoder<R>>);

impl<R: BufRead> Read for Members<R> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        while let Some(member) = &mut self.0 {
            let got = member.read(out)?;
            if got > 0 || out.is_empty() {
                return Ok(got);
            }
            let mut rest = self.0.take().map(GzDecoder::into_inner);
            if let Some(next) = &mut rest
                && next.fill_buf()?.starts_with(&GZIP[..1])
            {
                self.0 = rest.map(GzDecoder::new);
            }
        }
        Ok(0)
    }
}

/// Passes over `bytes`; where the stream ends before, the voxels are found missing.
pub fn skip(source: &mut dyn Read, bytes: u64) {
    let _ = std::io::copy(&mut source.take(bytes), &mut std::io::sink());
}

/// Up to `limit` bytes from the start of a file, for headers.
pub fn head(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let (source, ..) = open(path)?;
    source.take(limit).read_to_end(&mut bytes).map_err(|e| {
        Error::file(
            path,
            format!("cannot be read: {e}"),
            "the file is damaged: copy it again",
        )
        .caused_by(e)
    })?;
    Ok(bytes)
}

/// What follows a header: `n` voxels, x fastest; a stored `v` means `slope · v + intercept`.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    pub scalar: Scalar,
    pub big_endian: bool,
    pub n: [usize; 3],
    pub slope: f64,
    pub intercept: f64,
}

impl Layout {
    /// Number of voxels and of bytes, or None where they overflow.
    pub fn sizes(&self) -> Option<(usize, usize)> {
        let voxels = self
            .n
            .iter()
            .try_fold(1usize, |product, &n| product.checked_mul(n))?;
        Some((voxels, voxels.checked_mul(self.scalar.bytes())?))
    }
}

/// The part of `layout` that each of `files` files holds, cut along the slowest axis; None where they cannot share it evenly.
pub fn slab(layout: &Layout, files: usize) -> Option<Layout> {
    let [nx, ny, nz] = layout.n;
    if files == 0 || nz % files != 0 {
        return None;
    }
    Some(Layout {
        n: [nx, ny, nz / files],
        ..*layout
    })
}

/// The most that deflate can expand (1032), rounded up. A header that asks for more than this many times its file's
/// size is lying.
pub const MAX_EXPANSION: u64 = 1100;

/// Reads all voxels of `layout`. `file_bytes` is the size on disk of what holds them, `compressed` whether it may
/// expand.
pub fn read(
    source: &mut dyn Read,
    layout: &Layout,
    path: &Path,
    file_bytes: u64,
    compressed: bool,
) -> Result<Vec<f32>> {
    let [nx, ny, nz] = layout.n;
    let believable = file_bytes.saturating_mul(if compressed { MAX_EXPANSION } else { 1 });
    let (voxels, bytes) = match layout.sizes() {
        Some((voxels, bytes)) if voxels > 0 && bytes as u64 <= believable => (voxels, bytes),
        _ => {
            return Err(Error::file(
                path,
                format!(
                    "the header promises {nx} × {ny} × {nz} voxels of {}, but the file holds only {file_bytes} bytes",
                    layout.scalar.name()
                ),
                "the file is truncated or damaged: copy or export it again",
            ));
        }
    };
    let mut values = Vec::new();
    values.try_reserve_exact(voxels).map_err(|_| {
        Error::file(
            path,
            format!("{nx} × {ny} × {nz} voxels do not fit in this machine's memory"),
            "use a machine with more memory, or cut the scan first",
        )
    })?;
    take(source, layout, path, bytes, &mut values)?;
    if compressed {
        check_end(source, path)?;
    }
    Ok(values)
}

/// The same from a compression that may expand a file to any size (bzip2): memory is taken as voxels come.
pub fn read_expanding(source: &mut dyn Read, layout: &Layout, path: &Path) -> Result<Vec<f32>> {
    let Some((_, bytes)) = layout.sizes().filter(|(voxels, _)| *voxels > 0) else {
        return Err(Error::file(
            path,
            format!("promises {:?} voxels", layout.n),
            "the file is damaged: copy or export it again",
        ));
    };
    let mut values = Vec::new();
    take(source, layout, path, bytes, &mut values)?;
    check_end(source, path)?;
    Ok(values)
}

/// The next `bytes` of `source` as voxels.
fn take(
    source: &mut dyn Read,
    layout: &Layout,
    path: &Path,
    bytes: usize,
    values: &mut Vec<f32>,
) -> Result<()> {
    let mut chunk = vec![0u8; (1 << 20).min(bytes)];
    let mut left = bytes;
    while left > 0 {
        let part = left.min(chunk.len());
        let (got, broken) = fill(source, &mut chunk[..part]);
        if got < part {
            let at = bytes - left + got;
            let why = broken.map_or_else(String::new, |e| format!(" ({e})"));
            return Err(Error::file(
                path,
                format!("voxel data end or break off after {at} of {bytes} bytes{why}"),
                "the file is truncated or damaged: copy or export it again",
            ));
        }
        decode(&chunk[..part], layout, values);
        left -= part;
    }
    Ok(())
}

/// Reads a compressed stream to its end, where its checksum is.
fn check_end(source: &mut dyn Read, path: &Path) -> Result<()> {
    match std::io::copy(source, &mut std::io::sink()) {
        Ok(_) => Ok(()),
        Err(e) => Err(Error::file(
            path,
            format!("its voxels were decompressed, but the stream is damaged: {e}"),
            "some voxels may be wrong: copy or download the file again (`gzip -t` checks whether a .gz file is whole)",
        )),
    }
}

/// Voxels written as numbers, separated by white space or commas.
pub fn read_text(
    source: &mut dyn Read,
    layout: &Layout,
    path: &Path,
    file_bytes: u64,
) -> Result<Vec<f32>> {
    let advice = "save it with binary voxels";
    let mut text = String::new();
    source
        .take(file_bytes)
        .read_to_string(&mut text)
        .map_err(|e| Error::file(path, format!("its voxels are no text: {e}"), advice))?;
    let words = text.split(|c: char| c.is_whitespace() || c == ',');
    let numbers: Option<Vec<f64>> = words
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok())
        .collect();
    let expected = layout.sizes().map_or(0, |(voxels, _)| voxels);
    match numbers {
        Some(numbers) if numbers.len() == expected && expected > 0 => Ok(numbers
            .into_iter()
            .map(|v| (layout.slope * v + layout.intercept) as f32)
            .collect()),
        found => Err(Error::file(
            path,
            match found {
                Some(numbers) => format!(
                    "holds {} numbers where the header promises {expected}",
                    numbers.len()
                ),
                None => "holds words among the numbers that are its voxels".into(),
            },
            advice,
        )),
    }
}

/// Fills `chunk` as far as `source` goes: how many bytes came, and what broke it off, if it did not just end.
fn fill(source: &mut dyn Read, chunk: &mut [u8]) -> (usize, Option<std::io::Error>) {
    let mut got = 0;
    while got < chunk.len() {
        match source.read(&mut chunk[got..]) {
            Ok(0) => return (got, None),
            Ok(n) => got += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return (got, Some(e)),
        }
    }
    (got, None)
}

/// Appends the voxels in `bytes` (a whole number of them).
pub fn decode(bytes: &[u8], layout: &Layout, out: &mut Vec<f32>) {
    macro_rules! of {
        ($t:ty) => {{
            const N: usize = std::mem::size_of::<$t>();
            let identity = layout.slope == 1.0 && layout.intercept == 0.0;
            let (a, b) = (layout.slope, layout.intercept);
            let each = bytes.chunks_exact(N).map(|c| {
                let raw: [u8; N] = c.try_into().expect("chunks of this size");
                if layout.big_endian {
                    <$t>::from_be_bytes(raw)
                } else {
                    <$t>::from_le_bytes(raw)
                }
            });
            if identity {
                out.extend(each.map(|v| v as f32));
            } else {
                out.extend(each.map(|v| (a * v as f64 + b) as f32));
            }
        }};
    }

    match layout.scalar {
        Scalar::U8 => of!(u8),
        Scalar::I8 => of!(i8),
        Scalar::U16 => of!(u16),
        Scalar::I16 => of!(i16),
        Scalar::U32 => of!(u32),
        Scalar::I32 => of!(i32),
        Scalar::U64 => of!(u64),
        Scalar::I64 => of!(i64),
        Scalar::F16 => out.extend(bytes.chunks_exact(2).map(|c| {
            let bits = match layout.big_endian {
                true => u16::from_be_bytes([c[0], c[1]]),
                false => u16::from_le_bytes([c[0], c[1]]),
            };
            (layout.slope * half::f16::from_bits(bits).to_f64() + layout.intercept) as f32
        })),
        Scalar::F32 => of!(f32),
        Scalar::F64 => of!(f64),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(scalar: Scalar, big_endian: bool, n: [usize; 3]) -> Layout {
        Layout {
            scalar,
            big_endian,
            n,
            slope: 1.0,
            intercept: 0.0,
        }
    }

    #[test]
    fn byte_order_and_scaling_are_applied() {
        let mut l = layout(Scalar::I16, true, [2, 1, 1]);
        l.slope = 0.5;
        l.intercept = 10.0;
        let v = read(
            &mut &[0xFF, 0xFE, 0x01, 0x00][..],
            &l,
            Path::new("x"),
            4,
            false,
        )
        .unwrap();
        assert_eq!(v, [9.0, 138.0]);
    }

    #[test]
    fn a_header_that_lies_about_its_size_is_refused_before_memory_is_taken() {
        let path = Path::new("liar.raw");
        for n in [[70_000, 70_000, 70_000], [usize::MAX, 2, 1], [0, 4, 4]] {
            let l = layout(Scalar::F64, false, n);
            let e = read(&mut &[0u8; 100][..], &l, path, 100, true).unwrap_err();
            assert!(e.to_string().contains("promises"), "{e}");
        }
    }

    #[test]
    fn truncation_says_where() {
        let l = layout(Scalar::U8, false, [10, 10, 10]);
        let e = read(&mut &[0u8; 999][..], &l, Path::new("t"), 1000, false).unwrap_err();
        assert!(e.to_string().contains("after 999 of 1000 bytes"), "{e}");
    }

    #[test]
    fn a_gzip_stream_is_held_to_its_checksum_and_may_have_members_and_padding() {
        use std::io::Write;
        let member = |bytes: &[u8]| {
            let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            gz.write_all(bytes).unwrap();
            gz.finish().unwrap()
        };
        let l = layout(Scalar::U8, false, [6, 1, 1]);
        let of = |bytes: &[u8]| {
            let mut source = gunzip(bytes);
            read(&mut source, &l, Path::new("x.gz"), 100, true)
        };
        let two = [member(&[1, 2, 3, 4]), member(&[5, 6, 7])].concat();
        let expected = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        assert_eq!(of(&two).unwrap(), expected);
        assert_eq!(of(&[two.clone(), vec![0; 9]].concat()).unwrap(), expected);
        let mut wrong = two.clone();
        let checksum = two.len() - 8;
        wrong[checksum] ^= 1;
        assert!(of(&wrong).unwrap_err().to_string().contains("checksum"));
        assert!(of(&two[..two.len() - 3]).is_err(), "the trailer is cut");
    }
}
