//! Owns the reading of what a scene's file names: outlines, images, slices of scans, an apparent stiffness.

use crate::error::{Error, Result};
use crate::io::{map, points, scan, stiffness};
use crate::stage::scene::{Inputs, Physics, Scene};
use crate::topology::outline::{Bitmap, Outline};
use std::path::Path;

/// Files that a scene's geometry names, relative to the scene file.
pub fn read(scene: &mut Scene, folder: &Path) -> Result<Inputs> {
    match &mut scene.geometry {
        Outline::Polygon(polygon) => {
            if let Some(file) = &polygon.file {
                polygon.corners = points::read_corners(&folder.join(file))?;
            }
            Ok(Inputs::default())
        }
        Outline::Image(image) => {
            let (n, values) = map::read_brightness(&folder.join(&image.file))?;
            let inside = values.iter().map(|v| *v >= 0.5).collect();
            Ok(Inputs {
                bitmap: Some(Bitmap { n, inside }),
                grey: Some(values),
                ..Inputs::default()
            })
        }
        Outline::Slice(slice) => {
            let (n, mask) = read_slice(&folder.join(&slice.file), slice.axis.index(), slice.index)?;
            let inside = mask.iter().map(|v| *v != 0.0).collect();
            let grey = match &slice.grey {
                Some(file) => {
                    let path = folder.join(file);
                    let (other, values) = read_slice(&path, slice.axis.index(), slice.index)?;
                    if other != n {
                        return Err(Error::file(
                            path,
                            format!("its slice has {other:?} pixels, the mask's {n:?}"),
                            "give the scan the mask was made from, cropped alike",
                        ));
                    }
                    Some(values)
                }
                None => None,
            };
            Ok(Inputs {
                bitmap: Some(Bitmap { n, inside }),
                grey,
                ..Inputs::default()
            })
        }
        _ => Ok(Inputs::default()),
    }
}

/// The apparent stiffness that a continuum-molecular scene takes from a scan, if it does.
pub fn read_stiffness(scene: &Scene, folder: &Path) -> Result<Option<[[f64; 6]; 6]>> {
    let Physics::ContinuumMolecular(model) = &scene.physics else {
        return Ok(None);
    };
    let scan = model.elasticity.as_ref().and_then(|e| e.from_scan.as_ref());
    scan.map(|s| stiffness::read(&folder.join(&s.file)))
        .transpose()
}

/// Slice `index` along `axis`: the two other axes in order, the first fastest.
fn read_slice(path: &Path, axis: usize, index: usize) -> Result<([usize; 2], Vec<f64>)> {
    let scan = scan::read(path, Some([1.0; 3]))?;
    let n = scan.volume.grid.n;
    if index >= n[axis] {
        return Err(Error::file(
            path,
            format!(
                "slice {index} was asked for, there are {} along {}",
                n[axis],
                ["x", "y", "z"][axis]
            ),
            "correct geometry.slice.index",
        ));
    }
    let across: Vec<usize> = (0..3).filter(|a| *a != axis).collect();
    let size = [n[across[0]], n[across[1]]];
    let values = scan.volume.as_slice();
    let at = |i: usize, j: usize| {
        let mut voxel = [0; 3];
        (voxel[axis], voxel[across[0]], voxel[across[1]]) = (index, i, j);
        values[scan.volume.grid.index(voxel)] as f64
    };
    let slice = (0..size[1])
        .flat_map(|j| (0..size[0]).map(move |i| (i, j)))
        .map(|(i, j)| at(i, j));
    Ok((size, slice.collect()))
}
