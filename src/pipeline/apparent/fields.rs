//! Owns what of a solved model is kept on request: of voxel elements fields on the scan's grid, and the failure load; of a
//! lattice values at its sites.

use crate::discretisation::lattice::placement::Frame;
use crate::measure::pistoia::Failure;
use crate::measure::surface_energy::SurfaceEnergy;
use crate::volume::Volume;
use serde::{Deserialize, Serialize};

/// A field of a solved model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Field {
    Displacement,
    /// Strain energy density.
    Sed,
    VonMises,
    /// Bone fraction of the elements.
    Fraction,
}

/// One field by voxel of the scan, 0 where no element is.
#[derive(Debug, Clone)]
pub struct FieldVolume {
    /// With the unit, as `sed_mpa`.
    pub name: &'static str,
    pub values: Volume<f32>,
}

/// Fields and failure load, as far as the settings ask for them.
#[derive(Debug, Clone, Default)]
pub struct Recorded {
    /// On the scan's grid.
    pub fields: Vec<FieldVolume>,
    pub failure: Option<Failure>,
    /// How the modulus answers to the surface; of voxel elements of one tissue.
    pub surface: Option<SurfaceEnergy>,
    /// What a reader must know of the model.
    pub note: Option<String>,
    /// At the sites of a lattice.
    pub sites: Option<SiteFields>,
}

/// Fields of a lattice, by site.
#[derive(Debug, Clone)]
pub struct SiteFields {
    /// Places of the sites, from the corner of the specimen.
    pub at_mm: Vec<[f64; 3]>,
    pub displacement_mm: Option<Vec<[f64; 3]>>,
    /// A site's energy over the volume of a whole site's cell.
    pub sed_mpa: Option<Vec<f64>>,
    /// A site's share of a whole site's stiffness.
    pub fraction: Option<Vec<f64>>,
}

impl SiteFields {
    /// Of a solved lattice, as far as `fields` ask for them; None where they do not. `energy_nmm` and `fraction` are
    /// those of a site.
    pub fn of(
        fields: &[Field],
        (frame, indices): (&Frame, &[[i32; 3]]),
        u: &[[f64; 3]],
        energy_nmm: impl Fn(usize) -> f64,
        fraction: impl Fn(usize) -> f64,
    ) -> Option<SiteFields> {
        if fields.is_empty() {
            return None;
        }
        let asked = |field| fields.contains(&field);
        let cell_mm3 = frame.structure.cell_volume() * frame.lp_mm.powi(3);
        let sites = || 0..indices.len();
        Some(SiteFields {
            at_mm: indices.iter().map(|at| frame.position_mm(*at)).collect(),
            displacement_mm: asked(Field::Displacement).then(|| u.to_vec()),
            sed_mpa: asked(Field::Sed).then(|| sites().map(|s| energy_nmm(s) / cell_mm3).collect()),
            fraction: asked(Field::Fraction).then(|| sites().map(&fraction).collect()),
        })
    }
}
