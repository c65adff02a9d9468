//! Owns DICOM series, single-frame and multi-frame: slices in their order along the normal, rescaled to the unit that the
//! series names. Names of persons are not looked at.
//!
//! The elements are read here and not by a crate: crates take memory as an element's length says, and do not read VR UN with
//! implicit items.
//!
//! What is done with the attributes that place pixels or give them a meaning (PS3.3 and PS3.6); others describe the patient,
//! the study and the display, and are harmless:
//!
//! | attribute | use | why |
//! |---|---|---|
//! | (0002,0010) TransferSyntaxUID | read | byte order, deflation, RLE and JPEG; other compressions are refused |
//! | (0008,0008) ImageType | harmless | a localiser has another size or orientation and is refused by that |
//! | (0008,0016) SOPClassUID | read | CT without a RescaleType is in HU |
//! | (0008,0060) Modality | read | CT without a RescaleType is in HU |
//! | (0018,0050) SliceThickness | read | distance of slices where positions and spacing are missing |
//! | (0018,0088) SpacingBetweenSlices | read | distance of slices where positions are missing; below zero it is refused there |
//! | (0018,1120) GantryDetectorTilt | harmless | positions show a tilt, and are refused by that |
//! | (0018,1164) ImagerPixelSpacing | harmless | at the detector of a projection, not in the body |
//! | (0020,000E) SeriesInstanceUID | read | several series are refused |
//! | (0020,0013) InstanceNumber | read | order of slices without a place |
//! | (0020,0032) ImagePositionPatient | read | order, distance and place of slices |
//! | (0020,0037) ImageOrientationPatient | read | orientation |
//! | (0020,0100) TemporalPositionIdentifier | harmless | slices of two times lie at one place and are refused by that |
//! | (0020,1041) SliceLocation | read | order and distance of slices without a position |
//! | (0020,9113) PlanePositionSequence | read | of each frame |
//! | (0020,9116) PlaneOrientationSequence | read | of each frame |
//! | (0028,0002) SamplesPerPixel | read | colours are refused |
//! | (0028,0004) PhotometricInterpretation | read | colours and palettes are refused; MONOCHROME1 is not inverted |
//! | (0028,0006) PlanarConfiguration | harmless | of colours |
//! | (0028,0008) NumberOfFrames | read | slices of a multi-frame file |
//! | (0028,0010) Rows | read | size |
//! | (0028,0011) Columns | read | size |
//! | (0028,0030) PixelSpacing | read | voxel size; has to be that of all slices |
//! | (0028,0034) PixelAspectRatio | harmless | only where there is no voxel size, which is then asked for |
//! | (0028,0100) BitsAllocated | read | 1, 32 and 64 bits are refused |
//! | (0028,0101) BitsStored | read | higher bits may hold overlays |
//! | (0028,0102) HighBit | read | place of the stored bits |
//! | (0028,0103) PixelRepresentation | read | sign |
//! | (0028,0106) SmallestImagePixelValue | harmless | of the values |
//! | (0028,0120) PixelPaddingValue | read | no measurement: pore, and no part of Otsu's histogram |
//! | (0028,0121) PixelPaddingRangeLimit | read | the other end of a range of padding |
//! | (0028,1050) WindowCenter | harmless | of a display |
//! | (0028,1052) RescaleIntercept | read | scale, slice by slice |
//! | (0028,1053) RescaleSlope | read | scale, slice by slice |
//! | (0028,1054) RescaleType | read | unit |
//! | (0028,2110) LossyImageCompression | noted | values are not the scanner's |
//! | (0028,3000) ModalityLUTSequence | read | table of values and their unit |
//! | (0028,3010) VOILUTSequence | harmless | of a display |
//! | (0028,9110) PixelMeasuresSequence | read | of each frame |
//! | (0028,9145) PixelValueTransformationSequence | read | of each frame |
//! | (0040,9096) RealWorldValueMappingSequence | noted | a further scale, which is not used |
//! | (2050,0020) PresentationLUTShape | harmless | of a display |
//! | (3004,000C) GridFrameOffsetVector | read | places of the frames of a file without functional groups |
//! | (5200,9229) SharedFunctionalGroupsSequence | read | of all frames |
//! | (5200,9230) PerFrameFunctionalGroupsSequence | read | of each frame |
//! | (6000,3000) OverlayData | harmless | drawn over the image |
//! | (7FE0,0008) FloatPixelData | refused | floating-point pixels |
//! | (7FE0,0009) DoubleFloatPixelData | refused | floating-point pixels |
//! | (7FE0,0010) PixelData | read | the pixels |

mod coding;
mod compressed;
mod elements;
mod frames;
mod head;
mod pixels;
mod scale;
mod stack;
mod walk;

use crate::error::{Error, Result};
use crate::format::orient::{Affine, from_lps, scaled};
use crate::image::stored::Stored;
use frames::{Frame, normal};
use head::{Found, Image};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

const ADVICE: &str =
    "convert the series to NIfTI (dcm2niix), or export it again as uncompressed DICOM";

/// Reads the files of a folder, or one file, as one volume.
///
/// # Errors
/// No images, several series, slices that make no stack of boxes, codings that are not read.
pub fn read(folder: &Path, files: &[PathBuf]) -> Result<Stored> {
    let mut notes = Vec::new();
    let images = images(folder, files, &mut notes)?;
    let mut frames: Vec<Frame> = images.iter().flat_map(|i| i.frames.clone()).collect();
    for other in &frames[1..] {
        stack::same(&frames[0], other, &images)?;
    }
    check_size(&images, frames.len())?;
    let distance_mm = stack::sort(&mut frames, &images, &mut notes)?;
    let (first, image) = (&frames[0], &images[frames[0].file]);
    let n = [image.columns, image.rows, frames.len()];
    let spacing_mm = first
        .pixel_mm
        .zip(distance_mm)
        .map(|([row, column], z)| [column, row, z]);
    let values = values(&images, &frames, n)?;
    notes.extend(further(&images));
    Ok(Stored {
        format: match (files.len(), frames.len()) {
            (1, 1) => "DICOM".into(),
            (1, count) => format!("DICOM of {count} frames"),
            _ => format!("DICOM series of {} files", images.len()),
        },
        n,
        values,
        affine: affine(first, spacing_mm),
        spacing_mm,
        unit: first.scale.unit.clone(),
        padding: padding(&images, &frames, &mut notes),
        notes,
        ..Stored::default()
    })
}

/// The files with pixels. Directories and reports among them are left out and said.
fn images(folder: &Path, files: &[PathBuf], notes: &mut Vec<String>) -> Result<Vec<Image>> {
    let all: Vec<Found> = files
        .par_iter()
        .map(|file| head::found(file, 0))
        .collect::<Result<_>>()?;
    let mut images: Vec<Image> = Vec::new();
    let mut others = Vec::new();
    for (file, found) in files.iter().zip(all) {
        match found {
            Found::Image(image) => images.push(*image),
            Found::Other(what) => {
                let name = file.file_name().unwrap_or_default().to_string_lossy();
                others.push(format!("{name} ({what})"));
            }
        }
    }
    for (file, image) in images.iter_mut().enumerate() {
        image.frames.iter_mut().for_each(|frame| frame.file = file);
    }
    if images.is_empty() {
        return Err(Error::file(
            folder,
            format!("holds no image: {}", others.join(", ")),
            "give the files with the pixels, not their directory or report",
        ));
    }
    if !others.is_empty() {
        notes.push(format!("left out, without an image: {}", others.join(", ")));
    }
    Ok(images)
}

/// Refuses headers that promise more than their files can hold, before memory is taken.
fn check_size(images: &[Image], slices: usize) -> Result<()> {
    let on_disk: u64 = images
        .iter()
        .filter_map(|image| std::fs::metadata(&image.path).ok())
        .map(|m| m.len())
        .sum();
    let (rows, columns) = (images[0].rows, images[0].columns);
    let promised = (rows * columns).saturating_mul(slices) as u64;
    // Neither deflate nor run lengths nor JPEG pack more densely.
    if promised <= on_disk.saturating_mul(crate::format::raw::MAX_EXPANSION) {
        return Ok(());
    }
    Err(Error::file(
        &images[0].path,
        format!(
            "the headers promise {columns} × {rows} × {slices} voxels, the files hold {on_disk} bytes"
        ),
        ADVICE,
    ))
}

/// Every frame at its place, files in parallel.
fn values(images: &[Image], frames: &[Frame], [nx, ny, nz]: [usize; 3]) -> Result<Vec<f32>> {
    let mut values = vec![0f32; nx * ny * nz];
    let mut slices: Vec<Vec<(usize, &mut [f32])>> = images.iter().map(|_| Vec::new()).collect();
    for (frame, slice) in frames.iter().zip(values.chunks_mut(nx * ny)) {
        slices[frame.file].push((frame.index, slice));
    }
    images
        .par_iter()
        .zip(slices)
        .try_for_each(|(image, slices)| pixels::decode(image, slices))?;
    Ok(values)
}

fn further(images: &[Image]) -> Vec<String> {
    let mut notes = Vec::new();
    if images.iter().any(|image| image.lossy) {
        notes.push(
            "the series was once compressed with loss: its values are not the scanner's".into(),
        );
    }
    if images.iter().any(|image| image.other_scales) {
        notes.push("the series names a further scale of its values (RealWorldValueMapping), which is not used".into());
    }
    notes
}

/// Padding in the unit of the values. None, and said, where slices disagree or a table gives padding and measurements one value.
fn padding(images: &[Image], frames: &[Frame], notes: &mut Vec<String>) -> Option<[f32; 2]> {
    let of = |frame: &Frame| {
        let range = images[frame.file].padding?;
        let [a, b] = range.map(|v| frame.scale.value(f64::from(v)));
        Some([a.min(b), a.max(b)])
    };
    let first = of(&frames[0])?;
    if frames[0].scale.table.is_some() {
        notes.push("PixelPaddingValue is not used: values come from a table (Modality LUT)".into());
        return None;
    }
    if frames.iter().any(|frame| of(frame) != Some(first)) {
        notes.push("PixelPaddingValue is not used: it differs from slice to slice".into());
        return None;
    }
    Some(first)
}

/// Where the spacing is unknown the columns are unit vectors.
fn affine(first: &Frame, spacing_mm: Option<[f64; 3]>) -> Option<Affine> {
    let d = first.directions?;
    let normal = normal(&d);
    let origin = first.position_mm.unwrap_or([0.0; 3]);
    let directions: Affine = std::array::from_fn(|r| [d[r], d[3 + r], normal[r], origin[r]]);
    Some(scaled(
        &from_lps(directions),
        spacing_mm.unwrap_or([1.0; 3]),
    ))
}

/// Whether a file is DICOM by its first bytes, whatever its name.
pub fn is_dicom(path: &Path) -> bool {
    use std::io::Read;
    let mut head = Vec::new();
    std::fs::File::open(path)
        .and_then(|file| file.take(132).read_to_end(&mut head))
        .is_ok_and(|_| head.get(128..132) == Some(b"DICM") || walk::without_preamble(&head))
}
