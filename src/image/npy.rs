//! Owns NumPy's `.npy`: arrays of shape `(z, y, x)`; the voxel size is never in it.

use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::image::orient::{Turn, turned};
use crate::image::raw;
use crate::image::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use crate::volume::Volume;
use std::path::Path;

const ADVICE: &str = "save a three-dimensional array of numbers with numpy.save(name, array)";

pub fn read(path: &Path) -> Result<Stored> {
    let bytes = raw::head(path, 1 << 16)?;
    let wrong = |found: &str| Error::file(path, found, ADVICE);
    let (text, data_at) =
        header(&bytes).ok_or_else(|| wrong("is no .npy file of version 1 to 3"))?;
    let after = |key: &str| {
        text.split_once(key)
            .map(|(_, rest)| rest.trim_start_matches([' ', ':']))
    };
    let descr = after("'descr'")
        .and_then(|v| v.strip_prefix('\'')?.split_once('\''))
        .map_or("", |(d, _)| d);
    let fortran = after("'fortran_order'").is_some_and(|v| v.starts_with("True"));
    let shape = after("'shape'")
        .and_then(|v| v.strip_prefix('(')?.split_once(')'))
        .map_or("", |(s, _)| s);
    let shape: Option<Vec<usize>> = shape
        .split(',')
        .map(str::trim)
        .filter(|w| !w.is_empty())
        .map(|w| w.parse().ok())
        .collect();
    let [z, y, x] = match shape.as_deref() {
        Some([y, x]) => [1, *y, *x],
        Some([z, y, x]) => [*z, *y, *x],
        _ => return Err(wrong("does not hold an array of three dimensions")),
    };
    let scalar =
        scalar(descr).ok_or_else(|| wrong(&format!("numbers of kind `{descr}` are not read")))?;
    let n = if fortran { [z, y, x] } else { [x, y, z] };
    let layout = Layout {
        scalar,
        big_endian: descr.starts_with('>'),
        n,
        slope: 1.0,
        intercept: 0.0,
    };
    let (mut source, file_bytes, compressed) = raw::open(path)?;
    raw::skip(&mut *source, data_at);
    let mut values = raw::read(&mut *source, &layout, path, file_bytes, compressed)?;
    if fortran {
        // Stored with z fastest: turn it round.
        let turn = Turn {
            from: [2, 1, 0],
            reversed: [false; 3],
        };
        let stored = Volume::from_vec(Grid::new(n, [1.0; 3]), values);
        values = turned(stored, &turn).as_slice().to_vec();
    }
    Ok(Stored {
        format: format!("NumPy array, {}", scalar.name()),
        n: [x, y, z],
        values,
        ..Stored::default()
    })
}

/// The dictionary's text and where the data begin.
fn header(bytes: &[u8]) -> Option<(String, u64)> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (start, length): (usize, usize) = match rest.first()? {
        1 => (
            10,
            usize::from(u16::from_le_bytes(rest.get(2..4)?.try_into().ok()?)),
        ),
        2 | 3 => (
            12,
            u32::from_le_bytes(rest.get(2..6)?.try_into().ok()?) as usize,
        ),
        _ => return None,
    };
    let text = bytes.get(start..start.checked_add(length)?)?;
    Some((
        String::from_utf8_lossy(text).into_owned(),
        (start + length) as u64,
    ))
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
}
