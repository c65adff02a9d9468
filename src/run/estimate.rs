//! Owns rough needs of a scan before anything is read but its header: memory and time, to plan by, not to promise.

use crate::io::extent;
use crate::recipe::Recipe;
use crate::stage::solve::Method;
use serde::Serialize;
use std::fmt;
use std::path::Path;

/// Bytes per voxel while a scan is segmented: grey values, their smoothed copy, labels, mask.
const BYTES_PER_VOXEL: f64 = 14.0;

/// Bytes per lattice site while solved: 18 neighbours of 4 bytes, six vectors of three 8-byte numbers, indices.
const BYTES_PER_SITE: f64 = 260.0;

/// Bytes per hexahedron of voxel FE.
const BYTES_PER_ELEMENT: f64 = 300.0;

/// Share of candidate sites that a padded lattice of trabecular bone fills: 120 096 of 274 625 measured at LP 0.06 mm.
const FILLED: f64 = 0.5;

/// Site iterations per second: 120 096 sites, 708 iterations in 10.4 s measured (two cores, other work beside).
const SITE_ITERATIONS_PER_S: f64 = 8.0e6;

/// Iterations per site along the longest edge: 708 over 65 measured.
const ITERATIONS_PER_PLANE: f64 = 11.0;

/// What a scan needs, roughly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Estimate {
    /// None where the header does not tell.
    pub voxels: Option<[usize; 3]>,
    pub memory_mib: f64,
    /// None where the voxel size is not known before reading.
    pub time_s: Option<f64>,
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self.voxels {
            Some([x, y, z]) => write!(f, "{x} × {y} × {z} voxels, ")?,
            None => write!(f, "size not known before reading, ")?,
        }
        write!(f, "about {:.0} MiB", self.memory_mib)?;
        match self.time_s {
            Some(t) => write!(f, ", {t:.0} s"),
            None => Ok(()),
        }
    }
}

/// Needs of one scan under a recipe. Unknown sizes are taken as four times the bytes on disk.
pub fn estimate(input: &Path, spacing_mm: Option<[f64; 3]>, recipe: &Recipe) -> Estimate {
    let extent = extent::of(input);
    let voxels = match (recipe.segment.crop, extent) {
        (Some(crop), _) => Some(crop.map(|[first, end]| end.saturating_sub(first))),
        (None, extent) => extent.map(|e| e.voxels),
    };
    let count = |n: [usize; 3]| n.iter().map(|&v| v as f64).product::<f64>();
    let read = extent.map_or(4.0 * bytes_on_disk(input), |e| count(e.voxels));
    let spacing = spacing_mm.or(extent.and_then(|e| e.spacing_mm));
    let size_mm = voxels
        .zip(spacing)
        .map(|(n, h)| [0, 1, 2].map(|a| n[a] as f64 * h[a]));
    let (model_bytes, time_s) = match recipe.solve.method {
        Method::Lattice => lattice(size_mm, recipe),
        Method::VoxelFe => (
            voxels.map_or(read, count) * FILLED * BYTES_PER_ELEMENT,
            None,
        ),
    };
    Estimate {
        voxels: extent.map(|e| e.voxels),
        memory_mib: (20.0 * 1024.0 * 1024.0 + (read * BYTES_PER_VOXEL).max(model_bytes))
            / (1024.0 * 1024.0),
        time_s,
    }
}

/// Bytes of the largest lattice, seconds of all.
fn lattice(size_mm: Option<[f64; 3]>, recipe: &Recipe) -> (f64, Option<f64>) {
    let Some(size) = size_mm else {
        return (0.0, None);
    };
    let longest = size.iter().copied().fold(0.0, f64::max);
    let (mut bytes, mut time) = (0.0f64, 0.0);
    for case in recipe.lattice.cases() {
        let cell = case.structure.cell_volume() * case.lp_mm.powi(3);
        let sites = FILLED * size.iter().product::<f64>() / cell;
        bytes = bytes.max(sites * BYTES_PER_SITE);
        time += sites * ITERATIONS_PER_PLANE * longest / case.lp_mm / SITE_ITERATIONS_PER_S;
    }
    (bytes, Some(time))
}

fn bytes_on_disk(input: &Path) -> f64 {
    let len = |path: &Path| path.metadata().map_or(0, |m| m.len()) as f64;
    match std::fs::read_dir(input) {
        Ok(entries) => entries.flatten().map(|entry| len(&entry.path())).sum(),
        Err(_) => len(input),
    }
}
