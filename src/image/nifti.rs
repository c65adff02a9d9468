//! Owns NIfTI-1: reading with orientation, units and scaling applied, and writing masks and fields.

use crate::error::{Error, Result};
use crate::image::orient::{Affine, column_norms};
use crate::image::raw;
use crate::image::raw::{Layout, Scalar};
use crate::image::stored::Stored;
use crate::volume::Volume;
use nifti::{NiftiHeader, writer::WriterOptions};
use std::io::Read;
use std::path::{Path, PathBuf};

const DAMAGED: &str = "the file is damaged or is no NIfTI-1: export it again";

/// Reads `.nii`, `.nii.gz` or the header of a `.hdr`/`.img` pair.
pub fn read(path: &Path) -> Result<Stored> {
    let (mut source, file_bytes, compressed) = raw::open(path)?;
    let mut head = [0u8; 348];
    source.read_exact(&mut head).map_err(|e| {
        Error::file(
            path,
            format!("its NIfTI header of 348 bytes is incomplete ({e})"),
            DAMAGED,
        )
    })?;
    let header = parse(&head, path)?;
    let n = dimensions(&header, path)?;
    let scaled = header.scl_slope != 0.0 && header.scl_slope.is_finite();
    let layout = Layout {
        scalar: scalar(&header, path)?,
        big_endian: header.endianness == nifti::Endianness::Big,
        n,
        slope: if scaled {
            decimal(header.scl_slope)
        } else {
            1.0
        },
        intercept: if scaled && header.scl_inter.is_finite() {
            decimal(header.scl_inter)
        } else {
            0.0
        },
    };
    let pair = &header.magic == b"ni1\0";
    let values = if pair {
        let image = image_of(path);
        let (mut source, file_bytes, compressed) = raw::open(&image)?;
        raw::skip(&mut *source, header.vox_offset.max(0.0) as u64);
        raw::read(&mut source, &layout, &image, file_bytes, compressed)?
    } else {
        raw::skip(
            &mut source,
            (header.vox_offset.max(0.0) as u64).saturating_sub(348),
        );
        raw::read(&mut source, &layout, path, file_bytes, compressed)?
    };
    let mut notes = Vec::new();
    let to_mm = unit_mm(&header, &mut notes);
    let affine = affine(&header).map(|a| a.map(|row| row.map(|v| v * to_mm)));
    let spacing_mm = spacing(&header, affine.as_ref(), to_mm, &mut notes);
    Ok(Stored {
        format: format!(
            "NIfTI-1{}, {}",
            if compressed { " (gzip)" } else { "" },
            layout.scalar.name()
        ),
        n,
        values,
        spacing_mm,
        affine,
        notes,
        ..Stored::default()
    })
}

/// The `.img` that goes with a `.hdr`, compressed or not.
pub fn image_of(path: &Path) -> PathBuf {
    let plain = path.with_extension("").with_extension("img");
    let gz = path.with_extension("").with_extension("img.gz");
    if plain.exists() || !gz.exists() {
        plain
    } else {
        gz
    }
}

fn parse(head: &[u8; 348], path: &Path) -> Result<NiftiHeader> {
    let size = i32::from_le_bytes([head[0], head[1], head[2], head[3]]);
    if size == 540 || size == i32::from_be(540) {
        return Err(Error::file(
            path,
            "is NIfTI-2, which is not read",
            "save it as NIfTI-1 (sides up to 32767 voxels)",
        ));
    }
    let header = NiftiHeader::from_reader(&head[..])
        .map_err(|e| Error::file(path, format!("is no NIfTI-1 file ({e})"), DAMAGED))?;
    if header.sizeof_hdr != 348 {
        return Err(Error::file(
            path,
            format!(
                "is no NIfTI-1 file: the header should say 348 bytes, it says {}",
                header.sizeof_hdr
            ),
            DAMAGED,
        ));
    }
    Ok(header)
}

fn dimensions(header: &NiftiHeader, path: &Path) -> Result<[usize; 3]> {
    let dim = header.dim().map_err(|e| {
        Error::file(
            path,
            format!("has unusable dimensions {:?} ({e})", header.dim),
            DAMAGED,
        )
    })?;
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

/// Codes of the NIfTI-1 standard, `nifti1.h`.
fn scalar(header: &NiftiHeader, path: &Path) -> Result<Scalar> {
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

/// Millimetres per unit of length in the header.
fn unit_mm(header: &NiftiHeader, notes: &mut Vec<String>) -> f64 {
    match header.xyzt_units & 7 {
        1 => 1000.0,
        2 => 1.0,
        3 => 1e-3,
        _ => {
            notes.push("the header does not say its unit of length: millimetres assumed".into());
            1.0
        }
    }
}

/// The shortest decimal that is this `f32`: 0.0195, not 0.01949999965727329.
pub fn decimal(v: f32) -> f64 {
    v.to_string().parse().unwrap_or(f64::from(v))
}

/// sform if set, else qform if set, else none: the order of the standard's own recommendation for aligned images.
fn affine(h: &NiftiHeader) -> Option<Affine> {
    let rows = if h.sform_code > 0 {
        [h.srow_x, h.srow_y, h.srow_z].map(|row| row.map(decimal))
    } else if h.qform_code > 0 {
        qform(h)
    } else {
        return None;
    };
    let usable = rows.iter().flatten().all(|v| v.is_finite())
        && column_norms(&rows).iter().all(|&l| l > 0.0);
    usable.then_some(rows)
}

/// Rotation of a quaternion times spacing, third column times qfac (`nifti1.h`, method 2).
fn qform(h: &NiftiHeader) -> Affine {
    let [b, c, d] = [h.quatern_b, h.quatern_c, h.quatern_d].map(f64::from);
    let a = (1.0 - b * b - c * c - d * d).max(0.0).sqrt();
    let r = [
        [
            a * a + b * b - c * c - d * d,
            2.0 * (b * c - a * d),
            2.0 * (b * d + a * c),
        ],
        [
            2.0 * (b * c + a * d),
            a * a + c * c - b * b - d * d,
            2.0 * (c * d - a * b),
        ],
        [
            2.0 * (b * d - a * c),
            2.0 * (c * d + a * b),
            a * a + d * d - b * b - c * c,
        ],
    ];
    let qfac = if h.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let scale = [
        decimal(h.pixdim[1]),
        decimal(h.pixdim[2]),
        decimal(h.pixdim[3]) * qfac,
    ];
    let offset = [h.quatern_x, h.quatern_y, h.quatern_z].map(decimal);
    std::array::from_fn(|i| {
        [
            r[i][0] * scale[0],
            r[i][1] * scale[1],
            r[i][2] * scale[2],
            offset[i],
        ]
    })
}

fn spacing(
    h: &NiftiHeader,
    affine: Option<&Affine>,
    to_mm: f64,
    notes: &mut Vec<String>,
) -> Option<[f64; 3]> {
    let pixdim: [f64; 3] = std::array::from_fn(|a| decimal(h.pixdim[a + 1].abs()) * to_mm);
    let usable = |s: &[f64; 3]| s.iter().all(|&v| v.is_finite() && v > 0.0);
    let found = match affine.map(column_norms).filter(usable) {
        Some(s) if !usable(&pixdim) || (0..3).any(|a| (s[a] / pixdim[a] - 1.0).abs() > 1e-3) => {
            notes.push(format!(
                "pixdim {pixdim:?} and the affine's spacing {s:?} differ: the affine is used"
            ));
            s
        }
        _ if usable(&pixdim) => pixdim,
        _ => return None,
    };
    if found == [1.0; 3] && h.xyzt_units & 7 == 0 {
        notes.push(
            "voxel size 1 × 1 × 1 without a unit is what programs write when they do not know it: give --spacing".into(),
        );
    }
    Some(found)
}

/// Writes `volume` on its grid, in millimetres; compressed when the name ends in `.gz`. Fields and masks carry the
/// scan's affine, so that they lie over it in any viewer.
pub fn write<T>(path: &Path, volume: &Volume<T>) -> Result<()>
where
    T: nifti::DataElement + bytemuck::Pod,
{
    let n = volume.grid.n;
    if n.iter().any(|&n| n > 32_767) {
        return Err(Error::file(
            path,
            format!(
                "{} × {} × {} voxels exceed NIfTI-1's 32767 a side",
                n[0], n[1], n[2]
            ),
            "crop the scan first",
        ));
    }
    let failed = |e: &dyn std::fmt::Display| {
        Error::file(
            path,
            format!("cannot be written: {e}"),
            "check that the folder exists, is writable and has space left",
        )
    };
    let dir = path
        .parent()
        .filter(|d| !d.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    crate::io::atomic::create_dir(dir)?;
    let gz = path.extension().is_some_and(|e| e == "gz");
    // The crate writes by name and eats dots in stems: a plain temporary name, then rename.
    let suffix = if gz { ".nii.gz" } else { ".nii" };
    let file = crate::io::atomic::temporary(dir, suffix).map_err(|e| failed(&e))?;
    WriterOptions::new(file.path())
        .reference_header(&header_of(volume))
        .write_nifti(&volume.values.t())
        .map_err(|e| failed(&e))?;
    let written = std::fs::metadata(file.path())
        .map_err(|e| failed(&e))?
        .len();
    let whole = 352 + (volume.grid.len() * std::mem::size_of::<T>()) as u64;
    if !gz && written != whole {
        // The crate drops the error of its last flush: a full disk shows only in the size.
        return Err(failed(&format!("{written} of {whole} bytes went out")));
    }
    crate::io::atomic::keep(file, path)
}

fn header_of<T>(volume: &Volume<T>) -> NiftiHeader {
    let s = volume.grid.spacing_mm;
    let affine = volume.affine.unwrap_or([
        [s[0], 0.0, 0.0, 0.0],
        [0.0, s[1], 0.0, 0.0],
        [0.0, 0.0, s[2], 0.0],
    ]);
    let straight = (0..3).all(|r| (0..3).all(|c| r == c || affine[r][c] == 0.0))
        && (0..3).all(|r| affine[r][r] > 0.0);
    let [srow_x, srow_y, srow_z] = affine.map(|row| row.map(|v| v as f32));
    NiftiHeader {
        pixdim: [
            1.0,
            s[0] as f32,
            s[1] as f32,
            s[2] as f32,
            0.0,
            0.0,
            0.0,
            0.0,
        ],
        xyzt_units: 2,
        sform_code: 1,
        qform_code: i16::from(straight),
        quatern_x: srow_x[3],
        quatern_y: srow_y[3],
        quatern_z: srow_z[3],
        srow_x,
        srow_y,
        srow_z,
        ..NiftiHeader::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

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
        let h = NiftiHeader {
            pixdim: [-1.0, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0],
            sform_code: 0,
            quatern_b: 0.0,
            quatern_c: 0.0,
            quatern_d: std::f32::consts::FRAC_1_SQRT_2,
            ..NiftiHeader::default()
        };
        let a = affine(&h).unwrap();
        let expected = [[0.0, -0.2, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, -0.3]];
        for r in 0..3 {
            for c in 0..3 {
                assert!((a[r][c] - expected[r][c]).abs() < 1e-7, "{a:?}");
            }
        }
    }
}
