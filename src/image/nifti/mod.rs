//! Owns NIfTI-1, NIfTI-2 and Analyze 7.5: reading with orientation, units and scaling applied. Writing is in `write`.
//!
//! What is done with the fields of the header (`nifti1.h`; Analyze's own names in brackets):
//!
//! | field | use | why |
//! |---|---|---|
//! | sizeof_hdr | read | byte order, and which of the formats it is |
//! | data_type | harmless | unused name of the type |
//! | db_name | harmless | unused text |
//! | extents | harmless | unused number |
//! | session_error | harmless | unused number |
//! | regular | harmless | unused letter |
//! | dim_info | harmless | which axis an MR scanner encoded how |
//! | dim | read | sizes; times, channels and vectors are refused |
//! | intent_p1 | harmless | parameter of a statistic |
//! | intent_p2 | harmless | parameter of a statistic |
//! | intent_p3 | harmless | parameter of a statistic |
//! | intent_code | harmless | what values are of; one number a voxel either way |
//! | datatype | read | colours, complex numbers and bits are refused |
//! | bitpix | harmless | follows from datatype |
//! | slice_start | harmless | timing of an MR scanner |
//! | pixdim | read | voxel size, and handedness of the qform |
//! | vox_offset | read | below 352 it is refused in a file of one piece |
//! | scl_slope | read | 0 means that values are as stored |
//! | scl_inter | read | with scl_slope |
//! | slice_end | harmless | timing of an MR scanner |
//! | slice_code | harmless | timing of an MR scanner |
//! | xyzt_units | read | unit of length; that of time does not matter |
//! | cal_max | harmless | window of a display |
//! | cal_min | harmless | window of a display |
//! | slice_duration | harmless | timing of an MR scanner |
//! | toffset | harmless | timing of an MR scanner |
//! | glmax | harmless | unused number |
//! | glmin | harmless | unused number |
//! | descrip | harmless | any text |
//! | aux_file | harmless | name of a colour table or the like |
//! | qform_code | read | whether the quaternion is set |
//! | sform_code | read | whether the affine is set; it comes before the quaternion |
//! | quatern_b | read | orientation |
//! | quatern_c | read | orientation |
//! | quatern_d | read | orientation |
//! | qoffset_x | read | place |
//! | qoffset_y | read | place |
//! | qoffset_z | read | place |
//! | srow_x | read | orientation and place |
//! | srow_y | read | orientation and place |
//! | srow_z | read | orientation and place |
//! | intent_name | harmless | any text |
//! | magic | read | one piece, a pair of files, or Analyze |
//! | extension | harmless | skipped: vox_offset says where voxels begin |
//! | \[vox_units\] | read | Analyze's unit of length |
//! | \[funused1\] | read | SPM's scale factor; 0 means none |
//! | \[orient\] | refused | other planes than 0, which Analyze's programs read differently |
//! | \[originator\] | harmless | place of SPM's origin |

mod gzip;
mod header;
mod place;
mod write;

pub use header::decimal;
pub use write::{Voxel, write, write_field, write_grey};

use crate::error::{Error, Result};
use crate::format::raw::{self, Layout, Scalar, Source};
use crate::image::stored::Stored;
use header::{Header, Version};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

const DAMAGED: &str = "the file is damaged or is no NIfTI: export it again";

/// Reads `.nii`, `.nii.gz`, or a pair of `.hdr` and `.img` by either name.
pub fn read(path: &Path) -> Result<Stored> {
    let path = &header_of(path);
    of_source(path, raw::open(path)?)
}

/// The same of the bytes of a file that was read before; `path` names it in errors.
pub fn of_bytes(path: &Path, bytes: Vec<u8>) -> Result<Stored> {
    of_source(path, raw::of_bytes(bytes))
}

fn of_source(
    path: &Path,
    (mut source, file_bytes, compressed): (Source, u64, bool),
) -> Result<Stored> {
    let header = header::read(&mut source, path)?;
    let layout = layout(&header, path)?;
    let offset = offset(&header, path)?;
    let mut notes = Vec::new();
    let place = place::place(&header, path, &mut notes)?;
    let (values, compressed) = if header.pair {
        let image = image_of(path);
        let (mut source, file_bytes, compressed) = raw::open(&image)?;
        raw::skip(&mut *source, offset);
        let values = raw::read(&mut source, &layout, &image, file_bytes, compressed)?;
        (values, compressed)
    } else {
        raw::skip(&mut source, offset - header.version.header_bytes());
        let values = raw::read(&mut source, &layout, path, file_bytes, compressed)?;
        (values, compressed)
    };
    Ok(Stored {
        format: format!(
            "{}{}, {}",
            header.version.name(),
            if compressed { " (gzip)" } else { "" },
            layout.scalar.name()
        ),
        n: layout.n,
        values,
        spacing_mm: place.spacing_mm,
        affine: place.affine,
        notes,
        ..Stored::default()
    })
}

/// Sizes and voxel size (mm) by the header alone; None where it does not say.
pub fn extent(path: &Path) -> Option<([usize; 3], Option<[f64; 3]>)> {
    let path = &header_of(path);
    let (mut source, ..) = raw::open(path).ok()?;
    let header = header::read(&mut source, path).ok()?;
    let n = dimensions(&header, path).ok()?;
    let place = place::place(&header, path, &mut Vec::new()).ok()?;
    Some((n, place.spacing_mm))
}

/// The file of voxels of a pair, by either of its names; None for a file of one piece.
pub fn data_file(path: &Path) -> Option<PathBuf> {
    let header = header_of(path);
    let (mut source, ..) = raw::open(&header).ok()?;
    let pair = header::read(&mut source, &header).ok()?.pair;
    pair.then(|| image_of(&header))
}

/// Whether a file is the `.img` of a pair, by its name.
pub fn is_image_half(path: &Path) -> bool {
    ending(path) == Some("img")
}

/// The `.hdr` that goes with an `.img`; other paths as they are.
fn header_of(path: &Path) -> PathBuf {
    let ends = ["hdr", "HDR", "hdr.gz", "HDR.GZ", "HDR.gz"];
    match ending(path) {
        Some("img") => other_half(path, &ends),
        _ => path.to_path_buf(),
    }
}

/// The `.img` that goes with a `.hdr`, compressed or not, in small letters or capitals.
fn image_of(path: &Path) -> PathBuf {
    other_half(path, &["img", "IMG", "img.gz", "IMG.GZ", "IMG.gz"])
}

/// `img` or `hdr` where the name ends so, with or without `.gz`.
fn ending(path: &Path) -> Option<&'static str> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    ["img", "hdr"].into_iter().find(|end| {
        let stem = name.strip_suffix(end);
        stem.is_some_and(|stem| stem.ends_with('.'))
    })
}

/// The first of the names with the same stem that exists, else the first. Dots in the stem stay.
fn other_half(path: &Path, ends: &[&str]) -> PathBuf {
    let gz = |p: &Path| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz"));
    let name = if gz(path) {
        path.with_extension("")
    } else {
        path.to_path_buf()
    };
    let stem: OsString = name.file_stem().unwrap_or_default().to_os_string();
    let named = |end: &str| {
        let mut file = stem.clone();
        file.push(".");
        file.push(end);
        path.with_file_name(file)
    };
    let found = ends.iter().map(|end| named(end)).find(|p| p.is_file());
    found.unwrap_or_else(|| named(ends[0]))
}

fn layout(header: &Header, path: &Path) -> Result<Layout> {
    let scaled = header.slope != 0.0 && !header.slope.is_nan();
    if scaled && !(header.slope.is_finite() && header.intercept.is_finite()) {
        return Err(Error::file(
            path,
            format!(
                "has scl_slope {} and scl_inter {}, which are no scale",
                header.slope, header.intercept
            ),
            "set both to finite numbers and save it again",
        ));
    }
    if header.orient != 0 {
        return Err(Error::file(
            path,
            format!(
                "is Analyze 7.5 with orient {}: which way its axes run differs from program to program",
                header.orient
            ),
            "save it as NIfTI with the program that wrote it",
        ));
    }
    Ok(Layout {
        scalar: scalar(header, path)?,
        big_endian: header.big_endian,
        n: dimensions(header, path)?,
        slope: if scaled { header.slope } else { 1.0 },
        intercept: if scaled { header.intercept } else { 0.0 },
    })
}

/// Byte at which voxels begin.
fn offset(header: &Header, path: &Path) -> Result<u64> {
    let (offset, least) = match (header.pair, header.version) {
        (true, _) => (header.vox_offset, 0.0),
        (false, Version::Two) => (header.vox_offset, 544.0),
        (false, _) => (header.vox_offset, 352.0),
    };
    if offset >= least && offset.fract() == 0.0 && offset < 9e15 {
        return Ok(offset as u64);
    }
    Err(Error::file(
        path,
        format!("says that voxels begin at byte {offset} (vox_offset), where {least} is the least"),
        "programs disagree where such voxels begin: set vox_offset and save the file again",
    ))
}

fn dimensions(header: &Header, path: &Path) -> Result<[usize; 3]> {
    let count = header.dim[0];
    let dim = match count {
        1..=7 => &header.dim[1..=count as usize],
        _ => &[],
    };
    if dim.is_empty() || dim.iter().any(|&d| d < 1) {
        return Err(Error::file(
            path,
            format!("has unusable dimensions {:?}", header.dim),
            DAMAGED,
        ));
    }
    if dim.iter().skip(3).any(|&d| d > 1) {
        return Err(Error::file(
            path,
            format!(
                "holds {} dimensions ({dim:?}), one scan has three",
                dim.len()
            ),
            "extract the volume that you want as a file of its own",
        ));
    }
    Ok(std::array::from_fn(|a| {
        dim.get(a).map_or(1, |&d| d as usize)
    }))
}

/// Codes of `nifti1.h`.
fn scalar(header: &Header, path: &Path) -> Result<Scalar> {
    Ok(match header.datatype {
        2 => Scalar::U8,
        4 => Scalar::I16,
        8 => Scalar::I32,
        16 => Scalar::F32,
        64 => Scalar::F64,
        256 => Scalar::I8,
        512 => Scalar::U16,
        768 => Scalar::U32,
        1024 => Scalar::I64,
        1280 => Scalar::U64,
        code => {
            return Err(Error::file(
                path,
                format!(
                    "stores voxels as NIfTI type {code}; integers and floats of one number per voxel are read"
                ),
                "convert it to a grey-value type such as int16 or float32",
            ));
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::volume::Volume;

    fn sample() -> Volume<i16> {
        let grid = Grid::new([3, 4, 5], [0.0195, 0.02, 0.03]);
        Volume::from_vec(grid, (0..60).map(|v| v * 7 - 100).collect())
    }

    #[test]
    fn what_is_written_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["a.nii", "out.0195.nii.gz"] {
            let path = dir.path().join(name);
            write(&path, &sample()).unwrap();
            let back = read(&path).unwrap();
            assert_eq!(back.n, [3, 4, 5]);
            assert_eq!(back.spacing_mm, Some([0.0195, 0.02, 0.03]));
            let expected: Vec<f32> = sample().as_slice().iter().map(|&v| f32::from(v)).collect();
            assert_eq!(back.values, expected);
            assert!(back.notes.is_empty(), "{:?}", back.notes);
            assert_eq!(extent(&path), Some(([3, 4, 5], Some([0.0195, 0.02, 0.03]))));
        }
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
    }

    #[test]
    fn truncated_files_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("t.nii");
        write(&path, &sample()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        for keep in [0, 100, 348, 400, bytes.len() - 1] {
            std::fs::write(&path, &bytes[..keep]).unwrap();
            let e = read(&path).unwrap_err().to_string();
            assert!(e.contains("t.nii") && e.contains("what to do"), "{e}");
        }
    }

    #[test]
    fn a_quaternion_is_the_rotation_it_stands_for() {
        let mut bytes = vec![0u8; 348];
        bytes[0..4].copy_from_slice(&348i32.to_le_bytes());
        bytes[344..347].copy_from_slice(b"n+1");
        let mut float = |at: usize, v: f32| bytes[at..at + 4].copy_from_slice(&v.to_le_bytes());
        for (i, v) in [-1.0, 0.1, 0.2, 0.3].into_iter().enumerate() {
            float(76 + 4 * i, v);
        }
        float(264, std::f32::consts::FRAC_1_SQRT_2);
        let header = header::read(&mut &bytes[..], Path::new("x")).unwrap();
        let a = place::qform(&header);
        let expected = [[0.0, -0.2, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, -0.3]];
        for r in 0..3 {
            for c in 0..3 {
                assert!((a[r][c] - expected[r][c]).abs() < 1e-7, "{a:?}");
            }
        }
    }
}
