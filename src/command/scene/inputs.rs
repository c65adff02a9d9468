//! Owns the reading of what a scene's file names: outlines, images, slices of scans, an apparent stiffness.

use crate::discretisation::plane::geometry::{Bitmap, Geometry, Slice};
use crate::draw::map;
use crate::error::{Error, Result};
use crate::export::points;
use crate::image::scan;
use crate::io::named;
use crate::record::stiffness;
use crate::scene::continuum_molecular::Material;
use crate::scene::setting::Inputs;
use crate::scene::{Physics, Scene};
use std::path::Path;

/// Files that a scene's geometry names, relative to the scene file. `say` is called with what a user should know of them.
pub fn read(scene: &mut Scene, folder: &Path, say: impl Fn(String)) -> Result<Inputs> {
    match &mut scene.setting.geometry {
        Geometry::Polygon(polygon) => {
            if let Some(file) = &polygon.file {
                polygon.corners = points::read_corners(&named::in_folder(folder, file))?;
            }
            Ok(Inputs::default())
        }
        Geometry::Image(image) => {
            let (n, values) = map::read_brightness(&named::in_folder(folder, &image.file))?;
            let inside = values.iter().map(|v| *v >= 0.5).collect();
            Ok(Inputs {
                bitmap: Some(Bitmap { n, inside }),
                grey: Some(values),
                ..Inputs::default()
            })
        }
        Geometry::Slice(slice) => {
            let mask = read_section(&named::in_folder(folder, &slice.file), slice)?;
            let grey = match &slice.grey {
                Some(file) => {
                    let path = named::in_folder(folder, file);
                    let grey = read_section(&path, slice)?;
                    mask.require_alike(&grey, &path)?;
                    Some(grey.values)
                }
                None => None,
            };
            if let Some(pixel) = mask
                .pixel_mm
                .filter(|p| !near(*p, scene.setting.grid.spacing))
            {
                say(format!(
                    "a pixel of the slice, {pixel} mm wide in its file, becomes a cell of grid.spacing = {}",
                    scene.setting.grid.spacing
                ));
            }
            let inside = mask.values.iter().map(|v| *v != 0.0).collect();
            Ok(Inputs {
                bitmap: Some(Bitmap { n: mask.n, inside }),
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
    match model.problem.elasticity().map(|e| &e.material) {
        Some(Material::FromScan { scan, .. }) => {
            stiffness::read(&named::in_folder(folder, &scan.file)).map(Some)
        }
        _ => Ok(None),
    }
}

/// One slice of a scan: the two other axes in order, the first fastest.
struct Section {
    n: [usize; 2],
    values: Vec<f64>,
    /// Edge of a pixel, where the file says.
    pixel_mm: Option<f64>,
}

impl Section {
    /// # Errors
    /// Grey values of another size than the mask's.
    fn require_alike(&self, grey: &Section, path: &Path) -> Result<()> {
        let pixels = self.pixel_mm.zip(grey.pixel_mm);
        if self.n == grey.n && pixels.is_none_or(|(a, b)| near(a, b)) {
            return Ok(());
        }
        let words = |s: &Section| {
            let pixel = s.pixel_mm.map_or(String::new(), |p| format!(" of {p} mm"));
            format!("{} x {} pixels{pixel}", s.n[0], s.n[1])
        };
        Err(Error::file(
            path,
            format!("its slice has {}, the mask's {}", words(grey), words(self)),
            "give the scan the mask was made from, cropped in the same way",
        ))
    }
}

fn near(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-3
}

fn read_section(path: &Path, slice: &Slice) -> Result<Section> {
    let (axis, index) = (slice.axis.index(), slice.index);
    // A file that does not give its voxel size will do: cells have that of the scene.
    let (scan, sized) = match scan::read(path, None) {
        Ok(scan) => (scan, true),
        Err(_) => (scan::read(path, Some([1.0; 3]))?, false),
    };
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
    let [width, height] = [0, 1].map(|a| scan.volume.grid.spacing_mm[across[a]]);
    if !near(width, height) {
        return Err(Error::file(
            path,
            format!(
                "its pixels are {width} mm wide and {height} mm high; a scene's cells are squares"
            ),
            "resample it to cubes first: bonepd-ct segment --resample",
        ));
    }
    let size = [n[across[0]], n[across[1]]];
    let values = scan.volume.as_slice();
    let at = |i: usize, j: usize| {
        let mut voxel = [0; 3];
        (voxel[axis], voxel[across[0]], voxel[across[1]]) = (index, i, j);
        values[scan.volume.grid.index(voxel)] as f64
    };
    let cells = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j)));
    Ok(Section {
        n: size,
        values: cells.map(|(i, j)| at(i, j)).collect(),
        pixel_mm: sized.then_some(width),
    })
}
