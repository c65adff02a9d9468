//! Owns NRRD: `.nrrd`, and `.nhdr` with its data files.
//!
//! What is done with the fields of the header (teem's definition of NRRD 5); case and blanks of their names do not count:
//!
//! | field | use | why |
//! |---|---|---|
//! | dimension | read | has to be the number of sizes |
//! | type | read | case does not count; blocks are refused |
//! | block size | refused | a voxel is one number |
//! | encoding | read | raw, text, hex, gzip, bzip2 |
//! | endian | read | refused where it is missing and numbers have several bytes |
//! | content | harmless | any text |
//! | old min | noted | values were quantised from this range |
//! | old max | noted | values were quantised from this range |
//! | data file | read | a file, LIST, or a pattern with its numbers |
//! | line skip | read | before the data, before decompression |
//! | byte skip | read | after decompression; -1: the data are the end of the file |
//! | number | harmless | of voxels; follows from the sizes |
//! | sample units | read | unit of the grey values |
//! | min | harmless | of the values |
//! | max | harmless | of the values |
//! | sizes | read | axes of one voxel are left out where there are more than three |
//! | spacings | read | below zero: refused |
//! | thicknesses | harmless | a slice may be thicker than the distance of slices |
//! | axis mins | read | with axis maxs and centerings a spacing, where none is given |
//! | axis maxs | read | with axis mins |
//! | centerings | read | only with axis mins |
//! | labels | harmless | names of axes |
//! | units | read | of spacings |
//! | kinds | read | colours, vectors, lists and times of more than one value are refused |
//! | space | read | right, left, anterior, posterior |
//! | space dimension | read | a space without a name: its axes are x, y, z |
//! | space units | read | of origin and directions |
//! | space origin | read | place of the first voxel |
//! | space directions | read | orientation and spacing |
//! | measurement frame | harmless | turns vectors, of which there are none |
//! | key:=value | harmless | any text |

mod axes;
mod data;
mod header;

use crate::error::{Error, Result};
use crate::format::calibration::unit_named;
use crate::format::header::Header;
use crate::format::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use std::path::{Path, PathBuf};

const ADVICE: &str = "export it again, for example with 3D Slicer or SimpleITK";

pub fn read(path: &Path) -> Result<Stored> {
    let header = header::read(path)?;
    let mut notes = header::notes(&header);
    let axes = axes::axes(&header, path, &mut notes)?;
    let layout = layout(&header, axes.n, path)?;
    let values = data::read(&header, &layout, path)?;
    if let (Some(min), Some(max)) = (header.get("oldmin"), header.get("oldmax")) {
        notes.push(format!(
            "values were quantised from a range of {min} to {max}; they are taken as they are stored"
        ));
    }
    Ok(Stored {
        format: format!(
            "NRRD ({}), {}",
            header.get("encoding").unwrap_or("?").to_lowercase(),
            layout.scalar.name()
        ),
        n: axes.n,
        values,
        spacing_mm: axes.spacing_mm,
        affine: axes.affine,
        unit: header.get("sampleunits").and_then(unit_named),
        notes,
        ..Stored::default()
    })
}

/// The files of voxels that a header names; none where they follow it.
pub fn data_files(path: &Path) -> Vec<PathBuf> {
    let header = header::read(path);
    header.map_or_else(
        |_| Vec::new(),
        |h| data::files(&h, path).unwrap_or_default(),
    )
}

fn layout(header: &Header, n: [usize; 3], path: &Path) -> Result<Layout> {
    let kind = header.get("type").unwrap_or("missing");
    let scalar = scalar(&kind.to_lowercase())
        .ok_or_else(|| Error::file(path, format!("type `{kind}` is not read"), ADVICE))?;
    let endian = header.get("endian").map(str::to_lowercase);
    let big_endian = match endian.as_deref() {
        Some("big") => true,
        Some("little") => false,
        None if scalar.bytes() == 1 || header::is_text(header) => false,
        other => {
            return Err(Error::file(
                path,
                format!(
                    "its endian should be little or big, it is {}",
                    other.unwrap_or("missing")
                ),
                "add the line `endian: little` or `endian: big` to its header",
            ));
        }
    };
    Ok(Layout {
        scalar,
        big_endian,
        n,
        slope: 1.0,
        intercept: 0.0,
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
        "longlong"
        | "long long"
        | "long long int"
        | "signed long long"
        | "signed long long int"
        | "int64"
        | "int64_t" => Scalar::I64,
        "float" => Scalar::F32,
        "double" => Scalar::F64,
        _ => return None,
    })
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
