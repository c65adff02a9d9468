//! Owns the writing of NIfTI-1: masks and fields, in millimetres.

use crate::error::{Error, Result};
use crate::volume::Volume;
use nifti::{NiftiHeader, writer::WriterOptions};
use std::path::Path;

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
