//! Owns what of a solved model is kept on request: of voxel elements fields on the scan's grid, and the failure load; of a
//! lattice values at its sites; of smooth elements values of their nodes and middles.

use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::tetrahedra::nodes::Ten;
use crate::measure::surface_energy::SurfaceEnergy;
use crate::result::details::{Details, FailureAt};
use crate::solver::cg::CgInfo;
use crate::volume::Volume;
use serde::{Deserialize, Serialize};

/// Displacements (mm) in equilibrium and the nodal forces (N) that they take.
#[derive(Clone, Copy)]
pub struct Equilibrated<'a> {
    /// Displacement of each site, mm.
    pub u: &'a [[f64; 3]],
    /// Nodal force of each site, N.
    pub force: &'a [[f64; 3]],
    /// What the solve came to.
    pub info: &'a CgInfo,
    /// Equivalent plastic strain of the elements that have yielded, by index in the mesh's grid, rising; None where nothing can yield.
    pub plastic: Option<&'a [(usize, f32)]>,
}

/// A field of a solved model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Field {
    /// Displacement, mm: three components.
    Displacement,
    /// Strain energy density.
    Sed,
    /// Von Mises stress, MPa.
    VonMises,
    /// Bone fraction of the elements.
    Fraction,
    /// Six components, engineering shears.
    Strain,
    /// Six components, MPa.
    Stress,
    /// Three values, largest first, and their directions.
    PrincipalStrain,
    /// The same of stresses, MPa.
    PrincipalStress,
    /// `√(2 SED / E)` (Pistoia et al. 2002).
    EffectiveStrain,
    /// What the supports put on the nodes.
    NodalForce,
    /// Equivalent plastic strain.
    PlasticStrain,
}

impl Field {
    /// The words of settings, in the order of the variants.
    pub const WORDS: &[&str] = &[
        "displacement",
        "sed",
        "von-mises",
        "fraction",
        "strain",
        "stress",
        "principal-strain",
        "principal-stress",
        "effective-strain",
        "nodal-force",
        "plastic-strain",
    ];

    /// Those that a body that has yielded has: displacements and what follows from them.
    pub const OF_YIELDED: &[Field] = &[
        Field::Displacement,
        Field::Strain,
        Field::PrincipalStrain,
        Field::Fraction,
        Field::NodalForce,
        Field::PlasticStrain,
    ];

    /// Those that lattices have.
    pub const OF_LATTICES: &[Field] = &[
        Field::Displacement,
        Field::Sed,
        Field::Fraction,
        Field::NodalForce,
    ];
}

/// One field on the scan's grid, 0 where no element is.
#[derive(Debug, Clone)]
pub struct FieldVolume {
    /// With the unit, as `sed_mpa`.
    pub name: String,
    /// One volume a component; of nodes one longer than the scan along each axis.
    pub components: Vec<Volume<f32>>,
    /// What the components are, as `xx`; empty for a scalar.
    pub labels: &'static [&'static str],
    /// Where the values lie.
    pub place: Place,
    /// In words, at most 79 characters: NIfTI headers hold no more.
    pub about: String,
}

/// Where the values of a field lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Middles of the voxels.
    Voxels,
    /// Corners of the voxels.
    Nodes,
}

/// What was recorded of a solve, as far as the settings ask for it.
#[derive(Debug, Clone, Default)]
pub struct Recorded {
    /// On the scan's grid.
    pub fields: Vec<FieldVolume>,
    /// Failure by the criterion of the settings.
    pub failure: Option<FailureAt>,
    /// How the modulus answers to the surface; of voxel elements of one tissue.
    pub surface: Option<SurfaceEnergy>,
    /// What a reader must know of the model.
    pub note: Option<String>,
    /// Euler numbers of smooth elements and of the mask.
    pub euler: Option<[i64; 2]>,
    /// At the sites of a lattice.
    pub sites: Option<SiteFields>,
    /// At the nodes and in the middles of smooth elements.
    pub mesh: Option<MeshFields>,
    /// Forces at the ends and what else the settings ask for.
    pub details: Details,
}

/// Fields of ten-node elements.
#[derive(Debug, Clone)]
pub struct MeshFields {
    /// Places of the nodes, from the corner of the specimen.
    pub nodes_mm: Vec<[f64; 3]>,
    /// The ten nodes of each element.
    pub elements: Vec<Ten>,
    /// Fields with values at the nodes.
    pub of_nodes: Vec<MeshArray>,
    /// Fields with values in the elements' middles.
    pub of_elements: Vec<MeshArray>,
}

/// One field of a mesh: `components` values a node or element.
#[derive(Debug, Clone)]
pub struct MeshArray {
    /// With the unit, as `sed_mpa`.
    pub name: &'static str,
    /// Values a node or element.
    pub components: usize,
    /// Node by node, or element by element.
    pub values: Vec<f32>,
}

impl MeshArray {
    /// A field of `components` values a node or element.
    pub fn new(name: &'static str, components: usize, values: Vec<f32>) -> MeshArray {
        MeshArray {
            name,
            components,
            values,
        }
    }
}

/// Fields of a lattice, by site.
#[derive(Debug, Clone)]
pub struct SiteFields {
    /// Places of the sites, from the corner of the specimen.
    pub at_mm: Vec<[f64; 3]>,
    /// Displacement of each site.
    pub displacement_mm: Option<Vec<[f64; 3]>>,
    /// A site's energy over the volume of a whole site's cell.
    pub sed_mpa: Option<Vec<f64>>,
    /// A site's share of a whole site's stiffness.
    pub fraction: Option<Vec<f64>>,
    /// What the supports put on a site.
    pub force_n: Option<Vec<[f64; 3]>>,
}

impl SiteFields {
    /// Of a solved lattice, as far as `fields` ask for them; None where they do not. `energy_nmm` and `fraction` are
    /// those of a site.
    pub fn of(
        fields: &[Field],
        (frame, indices): (&Frame, &[[i32; 3]]),
        solved: &Equilibrated,
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
            displacement_mm: asked(Field::Displacement).then(|| solved.u.to_vec()),
            sed_mpa: asked(Field::Sed).then(|| sites().map(|s| energy_nmm(s) / cell_mm3).collect()),
            fraction: asked(Field::Fraction).then(|| sites().map(&fraction).collect()),
            force_n: asked(Field::NodalForce).then(|| solved.force.to_vec()),
        })
    }
}
