//! Owns how a mask, labels or other values of one file are laid on the voxels of a scan from another.
//!
//! Where both files say how they lie in the world, places decide, and must agree. Where one of them has directions without a voxel
//! size, directions decide. Where one has no directions, both were made from the same array: their axes as stored are the same, and
//! the scan's turn is also that of the other.

use crate::error::{Error, Result};
use crate::format::orient::{self, Affine};
use crate::grid::Grid;
use crate::image::scan::{self, Scan};
use crate::image::stored::Stored;
use crate::volume::Volume;
use std::path::Path;

/// Voxels may lie this share of their edge off the scan's.
const OFF: f64 = 0.1;
/// Sizes of voxels without a place may differ by this share: tags are rounded.
const ROUNDED: f64 = 0.01;

/// Values of `path` on the grid of `scan`, which may have been turned. Notes say how they were laid.
///
/// # Errors
/// Another number or size of voxels, or another place in the world.
pub fn on(scan: &Scan, path: &Path, notes: &mut Vec<String>) -> Result<Volume<f32>> {
    let stored = scan::stored(path)?;
    let grid = scan.volume.grid;
    let sizes_known = stored.spacing_mm.is_some() && scan.file_spacing_mm.is_some();
    let volume = match (stored.affine, scan.file_affine) {
        (Some(affine), Some(place)) if sizes_known => {
            by_place(stored, affine, (place, grid), path)?
        }
        (Some(directions), Some(_)) => {
            notes.push(format!(
                "{} was laid on the scan by the directions of its axes: one of the two has no voxel size, so their places are not compared",
                shown(path)
            ));
            by_directions(stored, directions, grid, path)?
        }
        (affine, place) => {
            let lacks = if place.is_none() { "the scan" } else { "it" };
            let turned = !scan.turn.is_identity() || affine.is_some_and(|a| !is_upright(&a));
            if turned {
                notes.push(format!(
                    "{} was laid on the scan in the order of its voxels as stored: {lacks} has no orientation",
                    shown(path)
                ));
            }
            as_stored(stored, scan, path)?
        }
    };
    Ok(Volume {
        grid,
        affine: scan.volume.affine,
        ..volume
    })
}

fn is_upright(affine: &Affine) -> bool {
    orient::Turn::of(affine).is_some_and(|turn| turn.is_identity())
}

fn shown(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn by_place(
    stored: Stored,
    affine: Affine,
    (place, grid): (Affine, Grid),
    path: &Path,
) -> Result<Volume<f32>> {
    let own = Grid::new(stored.n, orient::column_norms(&affine));
    let (volume, _) = orient::canonical(own, stored.values, affine, &mut Vec::new());
    same_number(volume.grid.n, grid.n, path)?;
    let Some(own) = volume.affine else {
        return Err(elsewhere(path, "its orientation is unusable".to_owned()));
    };
    let edges = orient::column_norms(&place);
    let apart = (0..8).map(|corner| {
        let at = |a: usize| {
            if corner >> a & 1 == 1 {
                grid.n[a] as f64 - 1.0
            } else {
                0.0
            }
        };
        let world = |affine: &Affine| {
            affine.map(|row| (0..3).map(|a| row[a] * at(a)).sum::<f64>() + row[3])
        };
        let (p, q) = (world(&own), world(&place));
        (0..3).map(|r| (p[r] - q[r]).powi(2)).sum::<f64>().sqrt()
    });
    let apart = apart.fold(0.0, f64::max);
    let least = edges.into_iter().fold(f64::INFINITY, f64::min);
    if apart.is_nan() || apart > OFF * least {
        let sizes = orient::column_norms(&own);
        let found = match differ(sizes, edges, 1e-3) {
            true => format!(
                "its voxels are {} mm, the scan's {} mm",
                triple(sizes),
                triple(edges)
            ),
            false => format!("its corners lie up to {apart:.3} mm off the scan's"),
        };
        return Err(elsewhere(path, found));
    }
    Ok(volume)
}

/// Directions without a voxel size are no place: corners lie nowhere.
fn by_directions(
    stored: Stored,
    directions: Affine,
    grid: Grid,
    path: &Path,
) -> Result<Volume<f32>> {
    let own = Grid::new(stored.n, stored.spacing_mm.unwrap_or([1.0; 3]));
    let (volume, _) = orient::canonical(own, stored.values, directions, &mut Vec::new());
    same_number(volume.grid.n, grid.n, path)?;
    Ok(volume)
}

fn as_stored(stored: Stored, scan: &Scan, path: &Path) -> Result<Volume<f32>> {
    let back = scan.turn.inverse();
    let grid = scan.volume.grid;
    let expected = back.from.map(|r| grid.n[r]);
    same_number(stored.n, expected, path)?;
    if let (Some(own), Some(file)) = (stored.spacing_mm, scan.file_spacing_mm) {
        let file = back.from.map(|r| file[r]);
        if differ(own, file, ROUNDED) {
            return Err(elsewhere(
                path,
                format!(
                    "its voxels are {} mm, the scan's {} mm",
                    triple(own),
                    triple(file)
                ),
            ));
        }
    }
    let along = back.from.map(|r| grid.spacing_mm[r]);
    let volume = Volume::from_vec(Grid::new(stored.n, along), stored.values);
    Ok(orient::turned(volume, &scan.turn))
}

fn differ(a: [f64; 3], b: [f64; 3], share: f64) -> bool {
    (0..3).any(|i| (a[i] / b[i] - 1.0).abs() > share)
}

fn triple(v: [f64; 3]) -> String {
    v.map(|v| ((v * 1e6).round() / 1e6).to_string()).join(" × ")
}

fn same_number(own: [usize; 3], scan: [usize; 3], path: &Path) -> Result<()> {
    if own == scan {
        return Ok(());
    }
    let [words, of_scan] = [own, scan].map(|n| n.map(|n| n.to_string()).join(" × "));
    Err(Error::file(
        path,
        format!("has {words} voxels, the scan has {of_scan}"),
        "give a mask on the scan's own grid",
    ))
}

fn elsewhere(path: &Path, found: String) -> Error {
    Error::file(
        path,
        format!("does not lie where the scan does: {found}"),
        "save the mask with the scan's own header, or resample it to the scan (in 3D Slicer: Resample Image (BRAINS))",
    )
}
