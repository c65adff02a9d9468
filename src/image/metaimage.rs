//! Owns MetaImage: `.mha`, and `.mhd` with its raw, zlib or list of files. Directions are LPS, as ITK writes them.

use crate::error::{Error, Result};
use crate::image::orient::{Affine, from_lps};
use crate::image::raw;
use crate::image::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use flate2::read::ZlibDecoder;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

const ADVICE: &str = "export it again, for example with ITK-SNAP or SimpleITK";
/// A header is text of some hundred bytes.
const HEAD: u64 = 1 << 16;

struct Header {
    fields: Vec<(String, String)>,
    /// Bytes up to and including the line that names the data.
    length: u64,
}

impl Header {
    fn get(&self, key: &str) -> Option<&str> {
        self.fields
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.as_str())
    }

    fn is_true(&self, key: &str) -> bool {
        self.get(key)
            .is_some_and(|v| v.eq_ignore_ascii_case("true"))
    }

    fn numbers<const N: usize>(&self, key: &str) -> Option<[f64; N]> {
        let found: Vec<f64> = self
            .get(key)?
            .split_whitespace()
            .map(|w| w.parse().ok())
            .collect::<Option<_>>()?;
        found.try_into().ok()
    }
}

pub fn read(path: &Path) -> Result<Stored> {
    let header = header(path)?;
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let n = dimensions(&header).ok_or_else(|| {
        wrong(format!(
            "DimSize should be three numbers above 0, it is `{}`",
            header.get("DimSize").unwrap_or("missing")
        ))
    })?;
    if header
        .get("ElementNumberOfChannels")
        .is_some_and(|c| c != "1")
    {
        return Err(wrong(
            "holds several channels per voxel, grey values are expected".into(),
        ));
    }
    let scalar = scalar(header.get("ElementType").unwrap_or("missing")).ok_or_else(|| {
        wrong(format!(
            "ElementType `{}` is not read",
            header.get("ElementType").unwrap_or("missing")
        ))
    })?;
    let big_endian =
        header.is_true("BinaryDataByteOrderMSB") || header.is_true("ElementByteOrderMSB");
    let layout = Layout {
        scalar,
        big_endian,
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let compressed = header.is_true("CompressedData");
    let values = match header.get("ElementDataFile").unwrap_or_default() {
        "LOCAL" => data(path, &layout, header.length, compressed)?,
        "LIST" => list(path, &layout, &header)?,
        file => {
            let skip = match header.get("HeaderSize").and_then(|v| v.parse::<i64>().ok()) {
                Some(-1) => tail(&beside(path, file), &layout)?,
                Some(bytes) => bytes.max(0) as u64,
                None => 0,
            };
            data(&beside(path, file), &layout, skip, compressed)?
        }
    };
    let spacing_mm = header
        .numbers::<3>("ElementSpacing")
        .or_else(|| header.numbers::<3>("ElementSize"));
    let affine = spacing_mm.map(|s| affine(&header, s));
    Ok(Stored {
        format: format!(
            "MetaImage{}, {}",
            if compressed { " (zlib)" } else { "" },
            scalar.name()
        ),
        n,
        values,
        spacing_mm,
        affine,
        ..Stored::default()
    })
}

/// The file that a header names; None where the data follow it, or are many files.
pub fn data_file(path: &Path) -> Option<PathBuf> {
    let header = header(path).ok()?;
    header
        .get("ElementDataFile")
        .filter(|f| *f != "LOCAL" && *f != "LIST")
        .map(|f| beside(path, f))
}

fn header(path: &Path) -> Result<Header> {
    let bytes = raw::head(path, HEAD)?;
    let mut fields = Vec::new();
    let mut at = 0;
    while let Some(end) = bytes[at..].iter().position(|&b| b == b'\n') {
        let line = String::from_utf8_lossy(&bytes[at..at + end]);
        at += end + 1;
        let Some((key, value)) = line.split_once('=') else {
            break;
        };
        let (key, value) = (key.trim().to_string(), value.trim().to_string());
        let last = key == "ElementDataFile";
        fields.push((key, value));
        if last {
            return Ok(Header {
                fields,
                length: at as u64,
            });
        }
    }
    // The data's line may be the last of a header without a newline.
    if let Some((key, value)) = String::from_utf8_lossy(&bytes[at..]).split_once('=')
        && key.trim() == "ElementDataFile"
        && bytes.len() < HEAD as usize
    {
        fields.push(("ElementDataFile".into(), value.trim().into()));
        return Ok(Header {
            fields,
            length: bytes.len() as u64,
        });
    }
    Err(Error::file(
        path,
        "is no MetaImage: its header does not name ElementDataFile",
        ADVICE,
    ))
}

fn dimensions(header: &Header) -> Option<[usize; 3]> {
    let n: Vec<usize> = header
        .get("DimSize")?
        .split_whitespace()
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()?;
    match n.as_slice() {
        [x, y] => Some([*x, *y, 1]),
        [x, y, z] | [x, y, z, 1] => Some([*x, *y, *z]),
        _ => None,
    }
    .filter(|n| n.iter().all(|&n| n > 0))
}

/// MetaIO's names; its `long` has four bytes on disk.
fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "MET_UCHAR" => Scalar::U8,
        "MET_CHAR" => Scalar::I8,
        "MET_USHORT" => Scalar::U16,
        "MET_SHORT" => Scalar::I16,
        "MET_UINT" | "MET_ULONG" => Scalar::U32,
        "MET_INT" | "MET_LONG" => Scalar::I32,
        "MET_ULONG_LONG" => Scalar::U64,
        "MET_LONG_LONG" => Scalar::I64,
        "MET_FLOAT" => Scalar::F32,
        "MET_DOUBLE" => Scalar::F64,
        _ => return None,
    })
}

fn beside(path: &Path, file: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new(".")).join(file)
}

/// `HeaderSize = -1`: the data are the end of the file.
fn tail(path: &Path, layout: &Layout) -> Result<u64> {
    let (_, file_bytes, _) = raw::open(path)?;
    Ok(layout
        .sizes()
        .map_or(0, |(_, bytes)| file_bytes.saturating_sub(bytes as u64)))
}

fn data(path: &Path, layout: &Layout, skip: u64, compressed: bool) -> Result<Vec<f32>> {
    let (mut source, file_bytes, gzip) = raw::open(path)?;
    raw::skip(&mut *source, skip);
    if compressed && !gzip {
        let mut inflated = ZlibDecoder::new(BufReader::new(source));
        return raw::read(&mut inflated, layout, path, file_bytes, true);
    }
    raw::read(&mut *source, layout, path, file_bytes, gzip)
}

/// One file per slice, named on the lines after the header.
fn list(path: &Path, layout: &Layout, header: &Header) -> Result<Vec<f32>> {
    let (mut source, ..) = raw::open(path)?;
    raw::skip(&mut *source, header.length);
    let mut names = String::new();
    source
        .take(1 << 24)
        .read_to_string(&mut names)
        .map_err(|e| {
            Error::file(
                path,
                format!("its list of files cannot be read: {e}"),
                ADVICE,
            )
        })?;
    let names: Vec<&str> = names
        .lines()
        .map(str::trim)
        .filter(|l| !l.is_empty())
        .collect();
    let [nx, ny, nz] = layout.n;
    if names.len() != nz {
        return Err(Error::file(
            path,
            format!("lists {} files for {nz} slices", names.len()),
            ADVICE,
        ));
    }
    let slice = Layout {
        n: [nx, ny, 1],
        ..*layout
    };
    let slices = names
        .into_iter()
        .map(|name| data(&beside(path, name), &slice, 0, false));
    Ok(slices.collect::<Result<Vec<_>>>()?.concat())
}

/// The matrix holds the direction of each axis in turn (MetaIO's order), in LPS.
fn affine(header: &Header, spacing: [f64; 3]) -> Affine {
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let numbers9 = |key| header.numbers::<9>(key);
    let m = numbers9("TransformMatrix")
        .or_else(|| numbers9("Rotation"))
        .or_else(|| numbers9("Orientation"))
        .unwrap_or(identity);
    let offset = header
        .numbers::<3>("Offset")
        .or_else(|| header.numbers::<3>("Position"))
        .or_else(|| header.numbers::<3>("Origin"))
        .unwrap_or([0.0; 3]);
    from_lps(std::array::from_fn(|r| {
        [
            m[r] * spacing[0],
            m[3 + r] * spacing[1],
            m[6 + r] * spacing[2],
            offset[r],
        ]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn header_and_data_may_be_apart_or_together_compressed_or_not() {
        use std::io::Write;
        let dir = tempfile::tempdir().unwrap();
        let values: Vec<u8> = (0..24i16)
            .flat_map(|v| (v * 100 - 500).to_be_bytes())
            .collect();
        let text = "ObjectType = Image\nNDims = 3\nDimSize = 2 3 4\nElementType = MET_SHORT\n\
                    ElementByteOrderMSB = True\nElementSpacing = 0.01 0.02 0.03\n";
        let together = dir.path().join("a.mha");
        let head = format!("{text}ElementDataFile = LOCAL\n");
        std::fs::write(&together, [head.as_bytes(), &values].concat()).unwrap();
        let apart = dir.path().join("b.mhd");
        std::fs::write(
            &apart,
            format!("{text}CompressedData = True\nElementDataFile = b.zraw"),
        )
        .unwrap();
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
        zlib.write_all(&values).unwrap();
        std::fs::write(dir.path().join("b.zraw"), zlib.finish().unwrap()).unwrap();
        let listed = dir.path().join("c.mhd");
        std::fs::write(
            &listed,
            format!("{text}ElementDataFile = LIST\ns0\ns1\ns2\ns3\n"),
        )
        .unwrap();
        for k in 0..4 {
            std::fs::write(
                dir.path().join(format!("s{k}")),
                &values[12 * k..12 * (k + 1)],
            )
            .unwrap();
        }
        let expected: Vec<f32> = (0..24).map(|v| (v * 100 - 500) as f32).collect();
        for path in [&together, &apart, &listed] {
            let s = read(path).unwrap();
            assert_eq!((s.n, s.spacing_mm), ([2, 3, 4], Some([0.01, 0.02, 0.03])));
            assert_eq!(s.values, expected, "{path:?}");
        }
        std::fs::write(&together, [head.as_bytes(), &values[..40]].concat()).unwrap();
        assert!(read(&together).unwrap_err().to_string().contains("a.mha"));
    }
}
