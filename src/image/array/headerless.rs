//! Owns files of voxels without a header (`.raw`, `.vol`): what is in them is given on the command line.

use crate::error::{Error, Result};
use crate::format::raw::{self, Layout, Scalar};
use crate::image::stored::Stored;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use std::path::Path;
use std::str::FromStr;

const TYPES: [Scalar; 11] = [
    Scalar::U8,
    Scalar::I8,
    Scalar::U16,
    Scalar::I16,
    Scalar::U32,
    Scalar::I32,
    Scalar::U64,
    Scalar::I64,
    Scalar::F16,
    Scalar::F32,
    Scalar::F64,
];

/// `NX,NY,NZ,TYPE[,SKIP]`: voxels along x (fastest), y, z, the type of one, and bytes to pass over before the first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(into = "String")]
pub struct Contents {
    /// Voxels along x (fastest), y, z.
    pub n: [usize; 3],
    /// One of [`Contents::TYPES`].
    pub kind: &'static str,
    /// Byte order of numbers of several bytes.
    pub big_endian: bool,
    /// Bytes before the first voxel.
    pub skip: u64,
}

impl Contents {
    /// The types of a voxel.
    pub const TYPES: [&'static str; 11] = [
        "uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64", "float16",
        "float32", "float64",
    ];
}

impl FromStr for Contents {
    type Err = String;

    fn from_str(word: &str) -> std::result::Result<Self, String> {
        let wrong = || {
            format!(
                "expected NX,NY,NZ,TYPE or NX,NY,NZ,TYPE,SKIP, as 512,512,300,uint16, found `{word}`"
            )
        };
        let parts: Vec<&str> = word.split(',').map(str::trim).collect();
        let (n, kind, skip) = match parts[..] {
            [x, y, z, kind] => ([x, y, z], kind, "0"),
            [x, y, z, kind, skip] => ([x, y, z], kind, skip),
            _ => return Err(wrong()),
        };
        let mut sizes = [0; 3];
        for (size, word) in sizes.iter_mut().zip(n) {
            *size = word.parse().ok().filter(|n| *n > 0).ok_or_else(wrong)?;
        }
        let word = kind.to_lowercase();
        let (name, big_endian) = match (word.strip_suffix("be"), word.strip_suffix("le")) {
            (Some(name), _) => (name, true),
            (_, Some(name)) => (name, false),
            _ => (word.as_str(), false),
        };
        let Some(kind) = Contents::TYPES.into_iter().find(|known| *known == name) else {
            return Err(format!(
                "expected a type of {} (little-endian, or with `be` at its end), found `{name}`",
                Contents::TYPES.join(", ")
            ));
        };
        Ok(Contents {
            n: sizes,
            kind,
            big_endian,
            skip: skip.parse().map_err(|_| wrong())?,
        })
    }
}

impl<'de> Deserialize<'de> for Contents {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        let word = String::deserialize(from)?;
        word.parse().map_err(D::Error::custom)
    }
}

impl From<Contents> for String {
    fn from(c: Contents) -> String {
        let [x, y, z] = c.n;
        let order = if c.big_endian { "be" } else { "" };
        let skip = match c.skip {
            0 => String::new(),
            skip => format!(",{skip}"),
        };
        format!("{x},{y},{z},{}{order}{skip}", c.kind)
    }
}

/// Reads the voxels.
///
/// # Errors
/// The file's size is not that of the contents.
pub fn read(path: &Path, contents: Contents) -> Result<Stored> {
    let [nx, ny, nz] = contents.n;
    let scalar = TYPES
        .into_iter()
        .find(|scalar| scalar.name() == contents.kind);
    let layout = Layout {
        scalar: scalar.unwrap_or(Scalar::U8),
        big_endian: contents.big_endian,
        n: contents.n,
        slope: 1.0,
        intercept: 0.0,
    };
    let (mut source, file_bytes) = raw::open_plain(path)?;
    let voxels = layout.sizes().map(|(_, bytes)| bytes as u64);
    let promised = voxels.and_then(|bytes| bytes.checked_add(contents.skip));
    if promised != Some(file_bytes) {
        let promised = promised.map_or("more".to_owned(), |bytes| bytes.to_string());
        return Err(Error::file(
            path,
            format!(
                "holds {file_bytes} bytes, and {nx} × {ny} × {nz} voxels of {} after {} bytes are {promised}",
                contents.kind, contents.skip
            ),
            "check --raw NX,NY,NZ,TYPE; a header before the voxels is passed over by --raw NX,NY,NZ,TYPE,SKIP (in bytes)",
        ));
    }
    raw::skip(&mut source, contents.skip);
    let values = raw::read(&mut source, &layout, path, file_bytes, false)?;
    Ok(Stored {
        format: format!("voxels without a header, {}", contents.kind),
        n: contents.n,
        values,
        ..Stored::default()
    })
}

/// Refuses a file without a header of which nothing is known.
pub fn unknown(path: &Path) -> Error {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let header = ["mhd", "nhdr"].map(|end| path.with_extension(end));
    match header.iter().find(|file| file.is_file()) {
        Some(header) => Error::file(
            path,
            "holds voxels without a header",
            format!("give its header instead: {}", header.display()),
        ),
        None => Error::file(
            path,
            "holds voxels without a header: their number and type are not in the file",
            format!(
                "give --raw NX,NY,NZ,TYPE (as --raw 512,512,300,uint16) and --spacing MM, or write a header {name}.mhd in the same folder"
            ),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contents_are_read_and_written() {
        for word in ["4,3,2,uint16", "4,3,2,float32be", "4,3,2,int8,512"] {
            assert_eq!(String::from(word.parse::<Contents>().unwrap()), word);
        }
        for wrong in [
            "4,3,2",
            "4,3,0,uint8",
            "4,3,2,short",
            "4,3,2,uint8,x",
            "4,3,2,uint8,1,2",
        ] {
            assert!(wrong.parse::<Contents>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_type_of_contents_is_one_that_is_read() {
        let names = TYPES.map(Scalar::name);
        assert_eq!(names, Contents::TYPES);
    }

    #[test]
    fn voxels_are_read_where_the_size_fits() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.raw");
        // Two bytes that gzip begins with are voxels like any other.
        let mut bytes = vec![0x1f, 0x8b];
        bytes.extend((1..12u16).flat_map(u16::to_le_bytes));
        std::fs::write(&path, &bytes).unwrap();
        let read = |word: &str| read(&path, word.parse().unwrap());
        let stored = read("2,3,2,uint16").unwrap();
        assert_eq!(
            (stored.n, stored.values[0], stored.values[11]),
            ([2, 3, 2], 35615.0, 11.0)
        );
        assert_eq!(read("11,1,1,uint16,2").unwrap().values[0], 1.0);
        assert_eq!(read("12,1,1,uint16be").unwrap().values[1], 256.0);
        let words = read("2,3,3,uint16").unwrap_err().to_string();
        assert!(
            words.contains("holds 24 bytes") && words.contains("are 36"),
            "{words}"
        );
    }
}
