//! Owns how much memory and time smooth elements take, from the volume of bone.

use super::size;
use crate::measure::thickness::plate_thickness_mm;
use crate::pipeline::apparent::discretisation::{ASSUMED_BONE, Cost, Known, Prepared, Resolution};
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::Specimen;

/// Elements per cell inside bone.
const PER_CELL: f64 = 12.0;

/// Elements more that the surface takes, per cell's edge over the thickness `2 BV / BS`.
const AT_SURFACE: f64 = 0.6;

/// Bytes per element at the highest (717 to 744 measured on 0.5 and 1 million), per vertex of the lattice, and per voxel of the
/// values that the surface keeps; seconds per element on two cores, half of the 25 µs of one.
const BYTES: f64 = 730.0;
const BYTES_PER_VERTEX: f64 = 9.0;
const BYTES_PER_VOXEL: f64 = 4.0;
const S_PER_ELEMENT: f64 = 1.25e-5;

/// Edge of a cell in voxels where nothing but the header is known.
const ASSUMED_VOXELS: f64 = 2.0;

/// What a solve takes.
pub fn of(params: &SolveParams, known: Known) -> Cost {
    match known {
        Known::Header { voxels, volume_mm3 } => {
            let cell = match (params.element_mm, volume_mm3) {
                (Some(size), Some(volume)) => size.powi(3) * voxels / volume,
                _ => ASSUMED_VOXELS.powi(3),
            };
            let elements = PER_CELL * 1.5 * ASSUMED_BONE * voxels / cell;
            let vertices = 2.0 * voxels / cell;
            cost(elements, vertices, voxels, params.element_mm.unwrap_or(0.0))
        }
        Known::Bone(prepared) => of_bone(params, prepared),
    }
}

fn of_bone(params: &SolveParams, Prepared { specimen, .. }: Prepared) -> Cost {
    let size_mm = size::of(specimen, params);
    let volume = specimen.bone.grid.size_mm().iter().product::<f64>();
    let vertices = 2.0 * volume / size_mm.powi(3);
    let voxels = specimen.bone.grid.len() as f64;
    cost(elements(specimen, size_mm), vertices, voxels, size_mm)
}

/// About how many elements a specimen takes in cells of `size_mm`.
pub fn elements(specimen: &Specimen, size_mm: f64) -> f64 {
    let cells = specimen.bv_mm3() / size_mm.powi(3);
    let thickness = plate_thickness_mm(&specimen.bone);
    let at_surface = thickness.map_or(0.0, |t| AT_SURFACE * size_mm / t);
    PER_CELL * cells * (1.0 + at_surface)
}

fn cost(elements: f64, vertices: f64, voxels: f64, size_mm: f64) -> Cost {
    Cost {
        bytes: [elements * BYTES + vertices * BYTES_PER_VERTEX + voxels * BYTES_PER_VOXEL; 2],
        time_s: Some(elements * S_PER_ELEMENT),
        resolution: Resolution::Element(size_mm),
    }
}
