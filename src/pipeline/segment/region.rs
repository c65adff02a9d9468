//! Owns what part of a scan is looked at: the crop, and the volume of interest in words and voxels.

use super::Voi;
use crate::error::{Error, Result};
use crate::grid::Grid;
use crate::mask::voi::Inside;
use crate::volume::Volume;
use std::path::Path;

pub(super) fn check_crop(crop: &[[usize; 2]; 3], n: [usize; 3]) -> Result<()> {
    for (a, [from, to]) in crop.iter().enumerate() {
        if from >= to || *to > n[a] {
            let axis = ["x", "y", "z"][a];
            return Err(Error::setting(
                "crop",
                format!(
                    "{from}:{to} along {axis}, where the scan has voxels 0:{}",
                    n[a]
                ),
                "give first and past-the-last voxel along x, y, z, as 0:100,0:100,20:180",
            ));
        }
    }
    Ok(())
}

pub(super) fn same_grid(path: &Path, mask: &Volume<u8>, grid: Grid) -> Result<()> {
    if mask.grid.n == grid.n {
        return Ok(());
    }
    Err(Error::setting(
        "voi",
        format!(
            "{} has {:?} voxels, the scan has {:?}",
            path.display(),
            mask.grid.n,
            grid.n
        ),
        "give a mask on the scan's own grid",
    ))
}

pub(super) fn inside<'a>(
    voi: &Voi,
    grid: Grid,
    mask: Option<&'a Volume<u8>>,
    corner_mm: [f64; 3],
) -> Result<(Inside<'a>, String)> {
    match voi {
        Voi::Box => Ok((Inside::Box, "box".into())),
        Voi::Cylinder {
            diameter_mm,
            center_mm,
        } => {
            let size = grid.size_mm();
            let diameter_mm = diameter_mm.unwrap_or(size[0].min(size[1]));
            let center_mm = center_mm
                .map(|c| [c[0] - corner_mm[0], c[1] - corner_mm[1]])
                .unwrap_or([size[0] / 2.0, size[1] / 2.0]);
            let out = (0..2).any(|a| {
                let reach = diameter_mm / 2.0;
                // A voxel of slack: diameters are typed rounded.
                center_mm[a] - reach < -grid.spacing_mm[a]
                    || center_mm[a] + reach > size[a] + grid.spacing_mm[a]
            });
            if out || diameter_mm.is_nan() || diameter_mm <= 0.0 {
                return Err(Error::setting(
                    "voi",
                    format!(
                        "a cylinder of {diameter_mm} mm about {center_mm:?} mm does not lie in the volume of {:.3} × {:.3} mm",
                        size[0], size[1]
                    ),
                    "choose a smaller diameter or another centre (millimetres from the scan's corner)",
                ));
            }
            let words = format!("cylinder d={} mm", rounded(diameter_mm));
            Ok((
                Inside::Cylinder {
                    center_mm,
                    diameter_mm,
                },
                words,
            ))
        }
        Voi::Mask(path) => {
            let Some(mask) = mask else {
                return Err(Error::setting(
                    "voi",
                    format!("{} was not read", path.display()),
                    "give a mask file that exists",
                ));
            };
            same_grid(path, mask, grid)?;
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            Ok((Inside::Mask(mask), format!("mask {name}")))
        }
    }
}

/// At most four decimals, without zeros at the end.
fn rounded(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}
