//! Owns NumPy's `.npy` and `.npz`: arrays of shape `(z, y, x)`, axes of one left out; the voxel size is never in it.
//!
//! Keys of the header: `descr`, `fortran_order`, `shape`, all read. Integers of 8 to 64 bits, bool, floats of 16, 32, 64 bits in
//! either byte order; other types, structures and objects are refused. An `.npz` is read where it holds one array of three
//! dimensions.

use crate::error::{Error, Result};
use crate::format::orient::{Turn, turned};
use crate::format::raw;
use crate::format::raw::{Layout, Scalar};
use crate::grid::Grid;
use crate::image::stored::Stored;
use crate::volume::Volume;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

const ADVICE: &str = "save a three-dimensional array of numbers with numpy.save(name, array)";
/// A longer header is no array's of numbers.
const HEAD: u64 = 1 << 16;

pub fn read(path: &Path) -> Result<Stored> {
    let (mut source, file_bytes, compressed) = raw::open(path)?;
    array(&mut *source, path, file_bytes, compressed)
}

/// Reads the one array of a `.npz` that can be a scan.
pub fn read_archive(path: &Path) -> Result<Stored> {
    let wrong = |found: String, advice: &str| Error::file(path, found, advice);
    let damaged = |e: zip::result::ZipError| {
        wrong(
            format!("cannot be read as .npz ({e})"),
            "the file is truncated or damaged: copy or save it again",
        )
    };
    let file = File::open(path).map_err(|e| {
        wrong(
            format!("cannot be read: {e}"),
            "check the path and its permissions",
        )
        .caused_by(e)
    })?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(damaged)?;
    let mut scans = Vec::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).map_err(damaged)?;
        if Header::read(&mut entry).is_some_and(|header| header.axes().is_some()) {
            let name = entry.name().map_err(damaged)?;
            scans.push((i, name.trim_end_matches(".npy").to_owned()));
        }
    }
    let [(index, name)] = &scans[..] else {
        let names: Vec<&str> = scans
            .iter()
            .take(8)
            .map(|(_, name)| name.as_str())
            .collect();
        return Err(match names.is_empty() {
            true => wrong("holds no array of three dimensions".into(), ADVICE),
            false => wrong(
                format!(
                    "holds {} arrays that could be the scan: {}",
                    scans.len(),
                    names.join(", ")
                ),
                "save the one that is meant with numpy.save(name, array)",
            ),
        });
    };
    let mut entry = archive.by_index(*index).map_err(damaged)?;
    let bytes = entry.compressed_size();
    let mut stored = array(&mut entry, path, bytes, true)?;
    // The checksum stands at the end.
    std::io::copy(&mut entry, &mut std::io::sink()).map_err(|e| damaged(e.into()))?;
    stored.format = format!("{} `{name}` of .npz", stored.format);
    Ok(stored)
}

/// The array that a stream holds. `file_bytes`: its size on disk.
fn array(source: &mut dyn Read, path: &Path, file_bytes: u64, compressed: bool) -> Result<Stored> {
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let header =
        Header::read(source).ok_or_else(|| wrong("is no .npy file of version 1 to 3".into()))?;
    let Some([z, y, x]) = header.axes() else {
        return Err(wrong(format!(
            "does not hold an array of three dimensions: its shape is ({})",
            header.shape
        )));
    };
    let scalar = scalar(&header.descr)
        .ok_or_else(|| wrong(format!("numbers of kind `{}` are not read", header.descr)))?;
    let n = if header.fortran { [z, y, x] } else { [x, y, z] };
    let layout = Layout {
        scalar,
        big_endian: header.descr.starts_with('>'),
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let mut values = raw::read(source, &layout, path, file_bytes, compressed)?;
    if header.fortran {
        // Stored with z fastest: turn it round.
        let turn = Turn {
            from: [2, 1, 0],
            reversed: [false; 3],
        };
        let stored = Volume::from_vec(Grid::new(n, [1.0; 3]), values);
        values = turned(stored, &turn).as_slice().to_vec();
    }
    let mut notes = Vec::new();
    if matches!(x, 3 | 4) && y > 16 && z > 16 {
        notes.push(format!(
            "the last axis of the array has {x} entries: if they are colours, save one of them"
        ));
    }
    Ok(Stored {
        format: format!("NumPy array, {}", scalar.name()),
        n: [x, y, z],
        values,
        notes,
        ..Stored::default()
    })
}

/// What stands before the numbers.
struct Header {
    descr: String,
    fortran: bool,
    /// As it stands there, without its brackets.
    shape: String,
}

impl Header {
    fn read(source: &mut dyn Read) -> Option<Header> {
        let mut start = [0u8; 10];
        source.read_exact(&mut start).ok()?;
        let mut length = u64::from(u16::from_le_bytes([start[8], start[9]]));
        match start.strip_prefix(b"\x93NUMPY")?.first()? {
            1 => {}
            2 | 3 => {
                let mut rest = [0u8; 2];
                source.read_exact(&mut rest).ok()?;
                length += u64::from(u16::from_le_bytes(rest)) << 16;
            }
            _ => return None,
        }
        let mut text = Vec::new();
        let mut part = source.take(length.min(HEAD));
        part.read_to_end(&mut text).ok()?;
        if (text.len() as u64) < length {
            return None;
        }
        let text = String::from_utf8_lossy(&text).into_owned();
        let after = |key: &str| {
            text.split_once(key)
                .map(|(_, rest)| rest.trim_start_matches([' ', ':']))
        };
        let descr = after("'descr'").and_then(|v| v.strip_prefix('\'')?.split_once('\''));
        let shape = after("'shape'").and_then(|v| v.strip_prefix('(')?.split_once(')'));
        Some(Header {
            descr: descr.map_or("", |(d, _)| d).to_owned(),
            fortran: after("'fortran_order'").is_some_and(|v| v.starts_with("True")),
            shape: shape?.0.to_owned(),
        })
    }

    /// Voxels along z, y, x; axes of one beyond three are left out, the first and the last first.
    fn axes(&self) -> Option<[usize; 3]> {
        let words = self
            .shape
            .split(',')
            .map(str::trim)
            .filter(|w| !w.is_empty());
        let mut axes: Vec<usize> = words.map(|w| w.parse().ok()).collect::<Option<_>>()?;
        while axes.len() > 3 {
            let single = match (axes.first(), axes.last()) {
                (Some(1), _) => 0,
                (_, Some(1)) => axes.len() - 1,
                _ => axes.iter().position(|n| *n == 1)?,
            };
            axes.remove(single);
        }
        match axes[..] {
            [y, x] => Some([1, y, x]),
            [z, y, x] => Some([z, y, x]),
            _ => None,
        }
    }
}

fn scalar(descr: &str) -> Option<Scalar> {
    Some(match descr.get(1..)? {
        "u1" | "b1" => Scalar::U8,
        "i1" => Scalar::I8,
        "u2" => Scalar::U16,
        "i2" => Scalar::I16,
        "u4" => Scalar::U32,
        "i4" => Scalar::I32,
        "u8" => Scalar::U64,
        "i8" => Scalar::I64,
        "f2" => Scalar::F16,
        "f4" => Scalar::F32,
        "f8" => Scalar::F64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(order: &str, values: &[u8]) -> Vec<u8> {
        let mut text =
            format!("{{'descr': '<u2', 'fortran_order': {order}, 'shape': (2, 3, 4), }}");
        text.push_str(&" ".repeat(117 - text.len()));
        text.push('\n');
        [
            b"\x93NUMPY\x01\x00",
            &118u16.to_le_bytes()[..],
            text.as_bytes(),
            values,
        ]
        .concat()
    }

    #[test]
    fn both_orders_give_the_same_scan() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.npy");
        let at = |z: u16, y: u16, x: u16| (z * 100 + y * 10 + x).to_le_bytes();
        let index = (0..24u16).map(|i| (i / 12, i / 4 % 3, i % 4));
        let c: Vec<u8> = index.flat_map(|(z, y, x)| at(z, y, x)).collect();
        let f: Vec<u8> = (0..24u16)
            .flat_map(|i| at(i % 2, i / 2 % 3, i / 6))
            .collect();
        let read_as = |order, bytes: &[u8]| {
            std::fs::write(&path, npy(order, bytes)).unwrap();
            read(&path).unwrap()
        };
        let (a, b) = (read_as("False", &c), read_as("True", &f));
        assert_eq!((a.n, a.values[23]), ([4, 3, 2], 123.0));
        assert_eq!((a.n, a.values), (b.n, b.values));
    }

    #[test]
    fn axes_of_one_are_left_out() {
        let axes = |shape: &str| {
            Header {
                descr: String::new(),
                fortran: false,
                shape: shape.to_owned(),
            }
            .axes()
        };
        for shape in [
            "2, 3, 4",
            "1, 2, 3, 4",
            "2, 3, 4, 1",
            "2, 1, 3, 4",
            "1, 2, 3, 4, 1",
        ] {
            assert_eq!(axes(shape), Some([2, 3, 4]), "{shape}");
        }
        assert_eq!(axes("1, 1, 3, 4"), Some([1, 3, 4]));
        assert_eq!(axes("3, 4"), Some([1, 3, 4]));
        for other in ["2, 3, 4, 5", "7,", "", "2, 3, 4, 2, 1"] {
            assert_eq!(axes(other), None, "{other}");
        }
    }
}
