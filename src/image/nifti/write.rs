//! Owns the writing of NIfTI-1: masks, grey values and fields, in millimetres.

use super::gzip;
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::volume::Volume;
use std::io::Write;
use std::path::Path;

/// A number that a voxel may be, with NIfTI's number of its type (`nifti1.h`).
pub trait Voxel: bytemuck::Pod + Sync {
    const CODE: i16;
}

impl Voxel for u8 {
    const CODE: i16 = 2;
}

impl Voxel for i16 {
    const CODE: i16 = 4;
}

impl Voxel for i32 {
    const CODE: i16 = 8;
}

impl Voxel for f32 {
    const CODE: i16 = 16;
}

impl Voxel for f64 {
    const CODE: i16 = 64;
}

impl Voxel for u16 {
    const CODE: i16 = 512;
}

/// Writes `volume` on its grid, in millimetres; compressed when the name ends in `.gz`. Fields and masks carry the
/// scan's affine, so that they lie over it in any viewer.
///
/// # Errors
/// More voxels a side than the format holds; a folder that cannot be written to, a full disk.
pub fn write<T: Voxel>(path: &Path, volume: &Volume<T>) -> Result<()> {
    refuse_long(path, volume)?;
    let header = header_of(volume);
    let voxels: &[u8] = bytemuck::cast_slice(volume.as_slice());
    let gz = path.extension().is_some_and(|e| e == "gz");
    atomic::write_with(path, |out| match gz {
        true => gzip::write(out, &[&header, voxels]),
        false => out.write_all(&header).and_then(|()| out.write_all(voxels)),
    })
}

fn refuse_long<T>(path: &Path, volume: &Volume<T>) -> Result<()> {
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
    Ok(())
}

/// A field with its `about` in the header (79 bytes of it): one component as a volume, several as a vector image (five
/// dimensions, intent 1007), component by component.
///
/// # Errors
/// As [`write()`].
pub fn write_field(path: &Path, components: &[Volume<f32>], about: &str) -> Result<()> {
    let Some(first) = components.first() else {
        return Ok(());
    };
    refuse_long(path, first)?;
    let mut header = header_of(first);
    let about: String = about.chars().filter(char::is_ascii).take(79).collect();
    header[148..148 + about.len()].copy_from_slice(about.as_bytes());
    if components.len() > 1 {
        let mut put = |at: usize, v: i16| header[at..at + 2].copy_from_slice(&v.to_ne_bytes());
        put(40, 5);
        put(50, components.len() as i16);
        put(68, 1007);
    }
    let mut parts: Vec<&[u8]> = vec![&header];
    parts.extend(
        components
            .iter()
            .map(|c| bytemuck::cast_slice(c.as_slice())),
    );
    atomic::write_with(path, |out| gzip::write(out, &parts))
}

/// Grey values: where all are whole numbers of 16 bits, as those, which takes half the space and time.
///
/// # Errors
/// As [`write()`].
pub fn write_grey(path: &Path, volume: &Volume<f32>) -> Result<()> {
    if let Some(values) = whole::<i16>(volume) {
        return write(path, &values);
    }
    if let Some(values) = whole::<u16>(volume) {
        return write(path, &values);
    }
    write(path, volume)
}

/// The same values as integers, if all of them are.
fn whole<T>(volume: &Volume<f32>) -> Option<Volume<T>>
where
    T: Voxel + Send + TryFrom<i32> + Into<f32>,
{
    use rayon::prelude::*;
    let values = volume.as_slice().par_iter().with_min_len(1 << 14);
    let integers: Option<Vec<T>> = values
        .map(|&v| {
            let integer = T::try_from(v as i32).ok()?;
            let back: f32 = integer.into();
            (back == v).then_some(integer)
        })
        .collect();
    Some(Volume {
        affine: volume.affine,
        ..Volume::from_vec(volume.grid, integers?)
    })
}

/// The header (348 bytes) and the four bytes after it that say that no extension follows.
fn header_of<T: Voxel>(volume: &Volume<T>) -> [u8; 352] {
    let s = volume.grid.spacing_mm;
    let affine = volume.affine.unwrap_or([
        [s[0], 0.0, 0.0, 0.0],
        [0.0, s[1], 0.0, 0.0],
        [0.0, 0.0, s[2], 0.0],
    ]);
    let straight = (0..3).all(|r| (0..3).all(|c| r == c || affine[r][c] == 0.0))
        && (0..3).all(|r| affine[r][r] > 0.0);
    let mut header = [0u8; 352];
    let mut put = |at: usize, bytes: &[u8]| header[at..at + bytes.len()].copy_from_slice(bytes);
    let shorts =
        |values: &[i16]| -> Vec<u8> { values.iter().flat_map(|v| v.to_ne_bytes()).collect() };
    let floats = |values: &[f64]| -> Vec<u8> {
        let single = values.iter().map(|v| *v as f32);
        single.flat_map(f32::to_ne_bytes).collect()
    };
    let [nx, ny, nz] = volume.grid.n.map(|n| n as i16);
    put(0, &348i32.to_ne_bytes());
    put(40, &shorts(&[3, nx, ny, nz, 1, 1, 1, 1]));
    put(70, &shorts(&[T::CODE, 8 * size_of::<T>() as i16]));
    put(76, &floats(&[1.0, s[0], s[1], s[2]]));
    // vox_offset, scl_slope.
    put(108, &floats(&[352.0, 1.0]));
    // Millimetres.
    put(123, &[2]);
    // The quaternion without a turn holds where the affine has none.
    put(252, &shorts(&[i16::from(straight), 1]));
    put(268, &floats(&affine.map(|row| row[3])));
    put(280, &floats(affine.as_flattened()));
    put(344, b"n+1\0");
    header
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::image::scan;

    #[test]
    fn grey_values_are_kept_in_the_smallest_type_that_holds_them() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("grey.nii.gz");
        let n = [50, 40, 30];
        for (factor, offset, kind) in [
            (1.0, -30_000.0, "int16"),
            (1.0, 5000.0, "uint16"),
            (2.0, 0.0, "float32"),
            (0.5, 0.0, "float32"),
            (-1.0, 0.0, "float32"),
        ] {
            let values = (0..60_000).map(|i| (i % 60_000) as f32 * factor + offset);
            let mut volume = Volume::from_vec(Grid::new(n, [0.1, 0.2, 0.3]), values.collect());
            volume.affine = Some([
                [0.0, 0.2, 0.0, 5.0],
                [0.1, 0.0, 0.0, -2.0],
                [0.0, 0.0, 0.3, 1.0],
            ]);
            write_grey(&path, &volume).unwrap();
            let found = scan::stored(&path).unwrap();
            assert!(found.format.ends_with(kind), "{} {kind}", found.format);
            assert_eq!((found.n, &found.values[..]), (n, volume.as_slice()));
            let rows = found.affine.unwrap().into_iter().flatten();
            let own = volume.affine.unwrap().into_iter().flatten();
            assert!(rows.zip(own).all(|(a, b)| (a - b).abs() < 1e-6), "{kind}");
        }
    }

    #[test]
    fn values_that_are_no_numbers_stay_floats() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.nii");
        let volume = Volume::from_vec(Grid::new([2, 1, 1], [0.1; 3]), vec![1.0, f32::NAN]);
        write_grey(&path, &volume).unwrap();
        assert!(scan::stored(&path).unwrap().values[1].is_nan());
    }
}
