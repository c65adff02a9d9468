//! Owns MetaImage: `.mha`, and `.mhd` with its data files. Directions are LPS, as ITK writes them.
//!
//! What is done with the keys of the header (MetaIO's definition); other keys are a writer's own text and harmless:
//!
//! | key | use | why |
//! |---|---|---|
//! | Comment | harmless | any text |
//! | ObjectType | read | anything but an image is refused |
//! | ObjectSubType | harmless | any text |
//! | NDims | read | has to be the number of sizes |
//! | Name | harmless | any text |
//! | ID | harmless | number of an object |
//! | ParentID | harmless | number of an object |
//! | AcquisitionDate | harmless | any text |
//! | Color | harmless | of a display |
//! | Modality | harmless | does not say the unit of the values |
//! | SequenceID | harmless | number of an image in a study |
//! | BinaryData | read | False: numbers as text |
//! | BinaryDataByteOrderMSB | read | byte order |
//! | ElementByteOrderMSB | read | byte order |
//! | CompressedData | read | zlib |
//! | CompressedDataSize | harmless | the stream knows its end |
//! | CompressionLevel | harmless | of the writer |
//! | TransformMatrix | read | orientation |
//! | Rotation | read | another name of TransformMatrix |
//! | Orientation | read | another name of TransformMatrix |
//! | Offset | read | place |
//! | Position | read | another name of Offset |
//! | Origin | read | another name of Offset |
//! | CenterOfRotation | harmless | the matrix is not applied about it |
//! | AnatomicalOrientation | noted | where there is no matrix; writers disagree on the sense of its letters |
//! | DistanceUnits | read | unit of length |
//! | ElementSpacing | read | voxel size |
//! | ElementSize | read | voxel size where there is no ElementSpacing |
//! | ElementMin | harmless | of the values |
//! | ElementMax | harmless | of the values |
//! | ElementNumberOfChannels | refused | several numbers a voxel |
//! | ElementToIntensityFunctionSlope | read | scale of the values |
//! | ElementToIntensityFunctionOffset | read | scale of the values |
//! | ElementType | read | arrays are refused |
//! | DimSize | read | axes after the third have one voxel |
//! | HeaderSize | read | bytes before the data; -1: they are the end of the file |
//! | ElementDataFile | read | LOCAL, a file, LIST, LIST 2D, or a pattern with its numbers |

mod data;
mod header;

use crate::error::{Error, Result};
use crate::format::header::Header;
use crate::format::length;
use crate::format::orient::{Affine, column_norms, from_lps, scaled};
use crate::format::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use std::path::{Path, PathBuf};

const ADVICE: &str = "export it again, for example with ITK-SNAP or SimpleITK";

pub fn read(path: &Path) -> Result<Stored> {
    let header = header::read(path)?;
    let layout = layout(&header, path)?;
    let mut notes = Vec::new();
    let spacing_mm = spacing(&header, path, &mut notes)?;
    let affine = affine(&header, spacing_mm, path, &mut notes)?;
    if header
        .fields
        .iter()
        .any(|(key, _)| key.starts_with("Seq_Frame"))
    {
        notes.push(
            "the header describes a sequence of frames: if the third axis is time, this is no scan"
                .into(),
        );
    }
    if (layout.slope, layout.intercept) != (1.0, 0.0) {
        notes.push(format!(
            "values are {} times the stored ones plus {} (ElementToIntensityFunction)",
            layout.slope, layout.intercept
        ));
    }
    let values = data::read(&header, &layout, path)?;
    Ok(Stored {
        format: format!(
            "MetaImage{}, {}",
            if header.is_true("CompressedData") {
                " (zlib)"
            } else {
                ""
            },
            layout.scalar.name()
        ),
        n: layout.n,
        values,
        spacing_mm,
        affine: Some(affine),
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

fn layout(header: &Header, path: &Path) -> Result<Layout> {
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let text = |key| header.get(key).unwrap_or("missing");
    if header
        .get("ObjectType")
        .is_some_and(|kind| !kind.eq_ignore_ascii_case("image"))
    {
        return Err(wrong(format!(
            "holds an object of type {}, no image",
            text("ObjectType")
        )));
    }
    let n = dimensions(header).ok_or_else(|| {
        wrong(format!(
            "DimSize should be three numbers above 0, as NDims ({}) says; it is `{}`",
            text("NDims"),
            text("DimSize")
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
    let scalar = scalar(text("ElementType"))
        .ok_or_else(|| wrong(format!("ElementType `{}` is not read", text("ElementType"))))?;
    let scale = |key, default| match header.get(key) {
        None => Ok(default),
        Some(word) => match word.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => Err(wrong(format!("{key} is `{word}`, which is no number"))),
        },
    };
    Ok(Layout {
        scalar,
        big_endian: header.is_true("BinaryDataByteOrderMSB")
            || header.is_true("ElementByteOrderMSB"),
        n,
        slope: scale("ElementToIntensityFunctionSlope", 1.0)?,
        intercept: scale("ElementToIntensityFunctionOffset", 0.0)?,
    })
}

fn dimensions(header: &Header) -> Option<[usize; 3]> {
    let n: Vec<usize> = header
        .get("DimSize")?
        .split_whitespace()
        .map(|w| w.parse().ok())
        .collect::<Option<_>>()?;
    if let Some(count) = header.get("NDims")
        && count.parse() != Ok(n.len())
    {
        return None;
    }
    match n.as_slice() {
        [x, y] => Some([*x, *y, 1]),
        [x, y, z, rest @ ..] if rest.iter().all(|&n| n == 1) => Some([*x, *y, *z]),
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

/// Along the first three axes, in mm; of a single slice its distance to the next is the pixel's height.
fn spacing(header: &Header, path: &Path, notes: &mut Vec<String>) -> Result<Option<[f64; 3]>> {
    let wrong = |found: String| Error::file(path, found, ADVICE);
    let Some(key) = ["ElementSpacing", "ElementSize"]
        .into_iter()
        .find(|key| header.get(key).is_some())
    else {
        return Ok(None);
    };
    let to_mm = match header.get("DistanceUnits") {
        None | Some("" | "?") => 1.0,
        Some(unit) => length::millimetres_per(unit).ok_or_else(|| {
            wrong(format!(
                "DistanceUnits is `{unit}`, which is no known unit of length"
            ))
        })?,
    };
    let found = header.numbers(key).unwrap_or_default();
    if found.len() < 2 || found.iter().take(3).any(|v| !v.is_finite() || *v < 0.0) {
        return Err(wrong(format!(
            "{key} should be a number above zero for each axis, it is `{}`",
            header.get(key).unwrap_or_default()
        )));
    }
    if found.len() == 2 {
        notes.push(
            "the distance between slices is not in the file: taken as the pixel's height".into(),
        );
    }
    let all = [
        found[0],
        found[1],
        found.get(2).copied().unwrap_or(found[1]),
    ];
    Ok(Some(all.map(|v| v * to_mm)).filter(|s| s.iter().all(|v| *v > 0.0)))
}

/// The matrix holds the direction of each axis in turn (MetaIO's order), in LPS.
fn affine(
    header: &Header,
    spacing_mm: Option<[f64; 3]>,
    path: &Path,
    notes: &mut Vec<String>,
) -> Result<Affine> {
    let matrix = numbers(header, ["TransformMatrix", "Rotation", "Orientation"], path)?;
    let offset = numbers(header, ["Offset", "Position", "Origin"], path)?.unwrap_or_default();
    let letters = header.get("AnatomicalOrientation").unwrap_or("RAI");
    if matrix.is_none() && !letters.contains('?') && letters != "RAI" {
        notes.push(format!(
            "AnatomicalOrientation {letters} comes without a TransformMatrix and is not used: axes are taken as left, posterior, superior"
        ));
    }
    let wrong = |found: String| Err(Error::file(path, found, ADVICE));
    let side = match matrix.as_ref().map_or(9, Vec::len) {
        4 => 2,
        9 => 3,
        16 => 4,
        other => {
            return wrong(format!(
                "TransformMatrix has {other} numbers, where 4, 9 or 16 are expected"
            ));
        }
    };
    let at = |axis: usize, r: usize| match &matrix {
        Some(m) if axis < side && r < side => m[side * axis + r],
        _ => f64::from(u8::from(axis == r)),
    };
    let place = |r: usize| offset.get(r).copied().unwrap_or(0.0);
    let directions: Affine = std::array::from_fn(|r| [at(0, r), at(1, r), at(2, r), place(r)]);
    let norms = column_norms(&directions);
    if norms.iter().any(|l| (l - 1.0).abs() > 1e-3) {
        return wrong(format!(
            "TransformMatrix should hold unit vectors, theirs have lengths {norms:?}"
        ));
    }
    Ok(scaled(
        &from_lps(directions),
        spacing_mm.unwrap_or([1.0; 3]),
    ))
}

/// The numbers of the first of `keys` that the header has.
fn numbers(header: &Header, keys: [&str; 3], path: &Path) -> Result<Option<Vec<f64>>> {
    let Some(key) = keys.into_iter().find(|key| header.get(key).is_some()) else {
        return Ok(None);
    };
    match header.numbers(key) {
        Some(found) if found.iter().all(|v| v.is_finite()) => Ok(Some(found)),
        _ => Err(Error::file(
            path,
            format!("{key} holds no finite numbers"),
            ADVICE,
        )),
    }
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
        let zlib = zlib.finish().unwrap();
        std::fs::write(dir.path().join("b.zraw"), &zlib).unwrap();
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
        let mut wrong = zlib;
        *wrong.last_mut().unwrap() ^= 1;
        std::fs::write(dir.path().join("b.zraw"), wrong).unwrap();
        let e = read(&apart).unwrap_err().to_string();
        assert!(e.contains("b.zraw") && e.contains("damaged"), "{e}");
    }
}
