//! Owns NRRD: `.nrrd`, and `.nhdr` with its data file; raw, gzip and text encodings.

use crate::error::{Error, Result};
use crate::image::orient::{Affine, column_norms};
use crate::image::raw;
use crate::image::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use flate2::read::MultiGzDecoder;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

const ADVICE: &str = "export it again, for example with 3D Slicer or SimpleITK";
const HEAD: u64 = 1 << 16;

struct Header {
    fields: Vec<(String, String)>,
    length: u64,
}

impl Header {
    fn get(&self, key: &str) -> Option<&str> {
        self.fields
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.as_str())
    }
}

pub fn read(path: &Path) -> Result<Stored> {
    let header = header(path)?;
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let sizes: Option<Vec<usize>> = header
        .get("sizes")
        .and_then(|v| v.split_whitespace().map(|w| w.parse().ok()).collect());
    let n = match sizes.as_deref() {
        Some([x, y]) => [*x, *y, 1],
        Some([x, y, z]) => [*x, *y, *z],
        other => {
            return Err(wrong(format!(
                "sizes should be three numbers, found {other:?}"
            )));
        }
    };
    let kind = header.get("type").unwrap_or("missing");
    let scalar = scalar(kind).ok_or_else(|| wrong(format!("type `{kind}` is not read")))?;
    let big_endian = header.get("endian") == Some("big");
    let layout = Layout {
        scalar,
        big_endian,
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let file = beside(path, &header);
    let values = data(
        file.as_deref().unwrap_or(path),
        &layout,
        &header,
        file.is_none(),
    )?;
    let affine = affine(&header);
    let spacing_mm = affine
        .as_ref()
        .map(column_norms)
        .or_else(|| spacings(&header));
    Ok(Stored {
        format: format!(
            "NRRD ({}), {}",
            header.get("encoding").unwrap_or("?"),
            scalar.name()
        ),
        n,
        values,
        spacing_mm,
        affine: affine.filter(|_| header.get("space").is_some()),
        ..Stored::default()
    })
}

/// The file that a header names; None where the data follow it.
pub fn data_file(path: &Path) -> Option<PathBuf> {
    beside(path, &header(path).ok()?)
}

fn beside(path: &Path, header: &Header) -> Option<PathBuf> {
    let file = header.get("data file").or_else(|| header.get("datafile"))?;
    Some(path.parent().unwrap_or(Path::new(".")).join(file))
}

fn header(path: &Path) -> Result<Header> {
    let bytes = raw::head(path, HEAD)?;
    if !bytes.starts_with(b"NRRD000") {
        return Err(Error::file(
            path,
            "is no NRRD: it does not begin with NRRD000",
            ADVICE,
        ));
    }
    let mut fields = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = bytes[at..]
            .iter()
            .position(|&b| b == b'\n')
            .map_or(bytes.len(), |e| at + e);
        let line = String::from_utf8_lossy(&bytes[at..end])
            .trim_end()
            .to_string();
        at = (end + 1).min(bytes.len());
        if line.is_empty() {
            break;
        }
        if let Some((key, value)) = line.split_once(": ").filter(|_| !line.starts_with('#')) {
            fields.push((key.trim().to_lowercase(), value.trim().to_string()));
        }
    }
    Ok(Header {
        fields,
        length: at as u64,
    })
}

fn scalar(kind: &str) -> Option<Scalar> {
    Some(match kind {
        "uchar" | "unsigned char" | "uint8" | "uint8_t" => Scalar::U8,
        "signed char" | "int8" | "int8_t" => Scalar::I8,
        "ushort" | "unsigned short" | "unsigned short int" | "uint16" | "uint16_t" => Scalar::U16,
        "short" | "short int" | "signed short" | "signed short int" | "int16" | "int16_t" => {
            Scalar::I16
        }
        "uint" | "unsigned int" | "uint32" | "uint32_t" => Scalar::U32,
        "int" | "signed int" | "int32" | "int32_t" => Scalar::I32,
        "ulonglong" | "unsigned long long" | "unsigned long long int" | "uint64" | "uint64_t" => {
            Scalar::U64
        }
        "longlong" | "long long" | "long long int" | "signed long long" | "int64" | "int64_t" => {
            Scalar::I64
        }
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
}

fn data(path: &Path, layout: &Layout, header: &Header, attached: bool) -> Result<Vec<f32>> {
    let (mut source, file_bytes, already_unzipped) = raw::open(path)?;
    if attached {
        raw::skip(&mut *source, header.length);
    }
    let number = |key: &str| {
        header
            .get(key)
            .and_then(|v| v.parse::<i64>().ok())
            .unwrap_or(0)
    };
    match header.get("encoding").unwrap_or("raw") {
        "raw" => {
            let bytes = match number("byte skip") {
                -1 => layout
                    .sizes()
                    .map_or(0, |(_, b)| file_bytes.saturating_sub(b as u64)),
                skip => skip.max(0) as u64,
            };
            raw::skip(&mut *source, bytes);
            raw::read(&mut *source, layout, path, file_bytes, already_unzipped)
        }
        "gzip" | "gz" if already_unzipped => {
            raw::read(&mut *source, layout, path, file_bytes, true)
        }
        "gzip" | "gz" => {
            let mut unzipped = MultiGzDecoder::new(BufReader::new(source));
            raw::read(&mut unzipped, layout, path, file_bytes, true)
        }
        "txt" | "text" | "ascii" => text(source, layout, path, file_bytes),
        other => Err(Error::file(
            path,
            format!("encoding `{other}` is not read"),
            "save it as raw or gzip",
        )),
    }
}

fn text(source: raw::Source, layout: &Layout, path: &Path, file_bytes: u64) -> Result<Vec<f32>> {
    let mut text = String::new();
    let broken = |found: String| Error::file(path, found, ADVICE);
    source
        .take(file_bytes)
        .read_to_string(&mut text)
        .map_err(|e| broken(format!("its text cannot be read: {e}")))?;
    let values: Option<Vec<f32>> = text
        .split(|c: char| c.is_whitespace() || c == ',')
        .filter(|w| !w.is_empty())
        .map(|w| w.parse().ok())
        .collect();
    let expected = layout.sizes().map_or(0, |(voxels, _)| voxels);
    match values {
        Some(values) if values.len() == expected && expected > 0 => Ok(values),
        found => Err(broken(format!(
            "{:?} numbers found where {expected} were promised",
            found.map(|v| v.len())
        ))),
    }
}

/// `(a,b,c)` groups.
fn vectors(text: &str) -> Option<Vec<[f64; 3]>> {
    text.split('(')
        .skip(1)
        .map(|group| {
            let inner = group.split_once(')')?.0;
            let v: Vec<f64> = inner
                .split(',')
                .map(|w| w.trim().parse().ok())
                .collect::<Option<_>>()?;
            v.try_into().ok()
        })
        .collect()
}

/// Directions and origin in RAS.
fn affine(header: &Header) -> Option<Affine> {
    let columns: [[f64; 3]; 3] = vectors(header.get("space directions")?)?.try_into().ok()?;
    let origin = header
        .get("space origin")
        .and_then(vectors)
        .and_then(|v| v.first().copied())
        .unwrap_or([0.0; 3]);
    let signs = match header
        .get("space")
        .unwrap_or_default()
        .to_lowercase()
        .as_str()
    {
        "left-posterior-superior" | "lps" => [-1.0, -1.0, 1.0],
        "left-anterior-superior" | "las" => [-1.0, 1.0, 1.0],
        _ => [1.0; 3],
    };
    let rows: Affine = std::array::from_fn(|r| {
        [columns[0][r], columns[1][r], columns[2][r], origin[r]].map(|v| v * signs[r])
    });
    column_norms(&rows)
        .iter()
        .all(|l| l.is_finite() && *l > 0.0)
        .then_some(rows)
}

fn spacings(header: &Header) -> Option<[f64; 3]> {
    let found: Vec<f64> = header
        .get("spacings")?
        .split_whitespace()
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()?;
    found.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_text_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.nrrd");
        std::fs::write(
            &path,
            "NRRD0004\n# a comment\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 2 1 2\n\
             space directions: (0.02,0,0) (0,0.03,0) (0,0,0.04)\nencoding: ascii\n\n1 -2 3 4\n",
        )
        .unwrap();
        let s = read(&path).unwrap();
        assert_eq!((s.n, s.values), ([2, 1, 2], vec![1.0, -2.0, 3.0, 4.0]));
        assert_eq!(s.affine.unwrap()[0][0], -0.02);
        let spacing = s.spacing_mm.unwrap();
        assert!((spacing[2] - 0.04).abs() < 1e-15);
    }
}
