//! Owns how a label image of supports comes to lie on a segmented scan: on its mask as it is, or from the scan's grid as the scan came
//! there.

use crate::error::{Error, Result};
use crate::format::orient;
use crate::grid::Axis;
use crate::image::scan::{self, Reading, Scan};
use crate::pipeline::apparent::SolveParams;
use crate::pipeline::apparent::ends::label_image::{Laid, whole_numbers};
use crate::pipeline::segment::{labels_like, laid};
use crate::record::specimen::{self, MASK, SegmentRecord};
use crate::volume::Volume;
use std::path::Path;
use std::sync::Arc;

/// Reads the label image of the settings, where they name one, and lays it on the specimen that `segment` left in `dir`.
///
/// # Errors
/// An image that cannot be read, of other voxels than the scan's, at another place, or of values that are no labels.
pub fn lay(dir: &Path, params: &mut SolveParams) -> Result<()> {
    let Some(image) = &mut params.supports else {
        if params.names_labels() {
            params.own_labels = Some(specimen::load(dir)?.record.input.blake3);
        }
        return Ok(());
    };
    let path = image.path.as_path();
    let record = specimen::load(dir)?.record;
    let volume = laid_on(dir, path, &record)?;
    let values = whole_numbers(volume.as_slice()).ok_or_else(|| {
        Error::file(
            path,
            "holds values that are no labels (whole numbers up to a million)",
            "give a label image: 0 where nothing is, one whole number for each support",
        )
    })?;
    image.laid = Some(Arc::new(Laid {
        blake3: scan::hash(path)?,
        labels: Volume::from_vec(volume.grid, values),
    }));
    Ok(())
}

fn laid_on(dir: &Path, path: &Path, record: &SegmentRecord) -> Result<Volume<f32>> {
    let results = &record.results;
    let reading = Reading {
        spacing_mm: Some(results.spacing_mm),
        ..Reading::default()
    };
    let mut notes = Vec::new();
    let mask = scan::read_as(&dir.join(MASK), &reading)?;
    let to_specimen = mask.turn.inverse().then(&record.input.axes);
    // On the mask as it is written.
    let on_mask = laid::on(&mask, path, &mut notes);
    let is_whole = |volume: &Volume<f32>| {
        let own = orient::turned_copy(volume, &to_specimen).into_owned();
        (own.grid.n == results.voxels).then_some(own)
    };
    let is_turned = record.settings.turn != Axis::Z || results.rotation.is_some();
    let refused = match on_mask {
        Ok(volume) => match is_whole(&volume) {
            Some(own) if is_turned && fits_the_scan(path, record) => {
                return Err(two_ways(path, own.grid.n));
            }
            Some(own) => return Ok(own),
            None => None,
        },
        Err(refused) => Some(refused),
    };
    let settings = &record.settings;
    let whole = match (as_scanned(record), refused) {
        (Ok(whole), _) => whole,
        (Err(_), Some(refused)) => return Err(refused),
        (Err(unread), None) => return Err(unread),
    };
    let labels = laid::on(&whole, path, &mut notes)?;
    let labels = labels_like(&labels, settings, results)?;
    match labels.grid.n == results.voxels {
        true => Ok(labels),
        false => Err(Error::file(
            path,
            format!(
                "comes to {:?} voxels where the specimen has {:?}: the scan was changed since it was segmented",
                labels.grid.n, results.voxels
            ),
            "segment the scan again, or give the labels on the grid of mask.nii.gz",
        )),
    }
}

/// The scan as it came.
fn as_scanned(record: &SegmentRecord) -> Result<Scan> {
    let settings = &record.settings;
    let reading = Reading {
        spacing_mm: settings.spacing_mm,
        unit: settings.units,
        raw: settings.raw,
    };
    scan::read_as(&record.input.path, &reading)
}

/// Whether a label image that fits the mask fits the scan, which lies otherwise, as well: then nothing says on which it lies.
fn fits_the_scan(path: &Path, record: &SegmentRecord) -> bool {
    as_scanned(record).is_ok_and(|whole| laid::on(&whole, path, &mut Vec::new()).is_ok())
}

fn two_ways(path: &Path, n: [usize; 3]) -> Error {
    Error::file(
        path,
        format!(
            "has {n:?} voxels and no place in space: it fits the scan and the mask, which is turned against the scan"
        ),
        "give the labels as NIfTI, NRRD or MetaImage with the orientation of mask.nii.gz",
    )
}
