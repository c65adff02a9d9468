//! Owns what a reader found in a file, before orientation and units are applied.

use crate::format::calibration::Calibration;
use crate::format::orient::Affine;
use crate::image::description::imagej::Grey;

/// What a reader found in a file, axes as stored.
#[derive(Debug, Clone, Default)]
pub struct Stored {
    /// Format and storage type, as `NIfTI-1 (gzip), int16`.
    pub format: String,
    pub n: [usize; 3],
    /// x fastest.
    pub values: Vec<f32>,
    /// None where the file does not say.
    pub spacing_mm: Option<[f64; 3]>,
    /// None where the file has no orientation. Where the spacing is unknown its columns are unit vectors.
    pub affine: Option<Affine>,
    /// Unit of the grey values where known: `HU`, `mg HA/cm3`.
    pub unit: Option<String>,
    /// From stored values to HU and density, where the format has its own.
    pub calibration: Option<Calibration>,
    /// Values from the first to the second stand for no measurement, in the unit of the values.
    pub padding: Option<[f32; 2]>,
    /// Further facts for `info`, key and value. Never names of persons.
    pub details: Vec<(String, String)>,
    pub notes: Vec<String>,
}

/// One decoded slice.
#[derive(Debug, Clone)]
pub struct Slice {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
    /// Storage type, as `uint16`.
    pub stored_as: String,
    /// Voxel size where the slice's file carries one; z is None where only the pixel's size is known.
    pub pixel_mm: Option<[f64; 2]>,
    pub slice_mm: Option<f64>,
    /// What ImageJ notes of the values; they are as it says.
    pub grey: Grey,
    /// What a user should know of how the file was understood.
    pub notes: Vec<String>,
}

/// Voxel size from what a file says of its pixels and slices; their distance is taken as the pixel's where it does not say.
pub fn spacing(
    pixel_mm: Option<[f64; 2]>,
    slice_mm: Option<f64>,
    slices: usize,
    notes: &mut Vec<String>,
) -> Option<[f64; 3]> {
    let [x, y] = pixel_mm?;
    if slice_mm.is_none() && slices > 1 {
        notes.push(
            "the distance between slices is not in the file: taken as the pixel's height".into(),
        );
    }
    Some([x, y, slice_mm.unwrap_or(y)])
}
