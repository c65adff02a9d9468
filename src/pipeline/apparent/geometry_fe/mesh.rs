//! Owns the mesh of a specimen: its making, what is said of it against the mask, and the tissue of its elements.

use super::nodes::Grips;
use super::surface::Source;
use super::{size, surface};
use crate::discretisation::tetrahedra::fill::fill;
use crate::discretisation::tetrahedra::lattice::Lattice;
use crate::discretisation::tetrahedra::mesh::Mesh;
use crate::discretisation::tetrahedra::nodes::TetMesh;
use crate::discretisation::tetrahedra::pieces::{self, Keep, Loaded};
use crate::discretisation::tetrahedra::quality::{self, Quality};
use crate::discretisation::tetrahedra::surface::Surface;
use crate::error::{Error, Result};
use crate::measure::morphometry;
use crate::pipeline::apparent::params::SolveParams;
use crate::volume::Specimen;
use rayon::prelude::*;

/// What a reader should know of a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    pub loaded: Loaded,
    pub elements: usize,
    pub quality: Quality,
    pub volume_mm3: f64,
    /// Euler's number of the mesh and of the mask: of all bone where the mask holds more than its largest piece.
    pub euler: [i64; 2],
}

/// Whether the mask may hold more than one piece of bone. Grey values have specks that `segment` took out of it.
pub fn has_other_pieces(specimen: &Specimen) -> bool {
    let threshold = specimen.threshold.as_ref();
    threshold.is_none_or(|threshold| threshold.keep_all)
}

/// All elements of a specimen, in cells of `size_mm`.
///
/// # Errors
/// Too many vertices.
pub fn filled(specimen: &Specimen, surface: &Surface, grips: &Grips, size_mm: f64) -> Result<Mesh> {
    let planes = surface::planes_mm(&specimen.bone.grid, size_mm, grips.axis, grips.low_mm);
    let lattice = Lattice::new(planes).ending_at(grips.axis, &[grips.low_mm, grips.high_mm]);
    fill(surface, &lattice)
}

/// Keeps the pieces that carry load.
pub fn keep_loaded(mesh: &mut Mesh, grips: &Grips, params: &SolveParams) -> Loaded {
    let keep = match params.load.motion() {
        None => Keep::AtFaces,
        Some(_) => Keep::Between {
            axis: grips.axis,
            ends_mm: [grips.low_mm, grips.high_mm],
        },
    };
    pieces::keep(mesh, keep)
}

/// The part of a specimen's smooth elements that carries load.
///
/// # Errors
/// Too many vertices, an element turned inside out.
pub fn of(
    specimen: &Specimen,
    surface: &Surface,
    grips: &Grips,
    params: &SolveParams,
) -> Result<(TetMesh, Report)> {
    let mut all = filled(specimen, surface, grips, size::of(specimen, params))?;
    let quality = quality::quality(&all);
    if quality.least_degrees <= 0.0 {
        return Err(Error::specimen(
            "an element of the mesh is turned inside out",
            "take another --element-mm",
        ));
    }
    let of_all = has_other_pieces(specimen).then(|| quality::euler(&all));
    let loaded = keep_loaded(&mut all, grips, params);
    let of_mesh = of_all.unwrap_or_else(|| quality::euler(&all));
    let euler = [of_mesh, morphometry::euler(&specimen.bone)];
    let report = Report {
        loaded,
        elements: all.elements.len(),
        quality,
        volume_mm3: all.volume_mm3(),
        euler,
    };
    Ok((TetMesh::of(&all), report))
}

impl Report {
    /// What is said of the mesh in its row.
    pub fn words(&self, source: Source) -> String {
        let q = &self.quality;
        let from = source.words();
        let share = 100.0 * q.outside as f64 / self.elements.max(1) as f64;
        let mut words = format!(
            "{from}: {:.4} mm³ of bone carry load, dihedral angles {:.1} to {:.1} degrees, {share:.2} % of the elements beyond {} and {}",
            self.volume_mm3,
            q.least_degrees,
            q.largest_degrees,
            quality::BOUNDS_DEGREES[0],
            quality::BOUNDS_DEGREES[1],
        );
        let [mesh, mask] = self.euler;
        if mesh != mask {
            words += &format!(", Euler number {mesh} where the mask has {mask}");
        }
        words
    }
}

/// Each element's modulus over the mean: that of the bone voxel around its middle, or of the nearest around that.
pub fn factors(mesh: &TetMesh, specimen: &Specimen, of_voxels: &[f32]) -> Vec<f32> {
    let bone = &specimen.bone;
    let (grid, voxels) = (bone.grid, bone.as_slice());
    let of = |ten: &[u32; 10]| {
        let corners = [ten[0], ten[1], ten[2], ten[3]].map(|n| mesh.nodes_mm[n as usize]);
        let middle = [0, 1, 2].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 4.0);
        let around = grid.voxel_at(middle);
        if voxels[grid.index(around)] != 0 {
            return of_voxels[grid.index(around)];
        }
        let mut nearest = (f64::INFINITY, 1.0);
        let near = |a: usize| around[a].saturating_sub(2)..(around[a] + 3).min(grid.n[a]);
        for k in near(2) {
            for j in near(1) {
                for i in near(0) {
                    let at = [i, j, k];
                    let off = |a: usize| (at[a] as f64 + 0.5) * grid.spacing_mm[a] - middle[a];
                    let far: f64 = (0..3).map(|a| off(a).powi(2)).sum();
                    if voxels[grid.index(at)] != 0 && far < nearest.0 {
                        nearest = (far, of_voxels[grid.index(at)]);
                    }
                }
            }
        }
        nearest.1
    };
    mesh.elements.par_iter().map(of).collect()
}
