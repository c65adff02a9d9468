//! Owns what a row of results follows from: the scan, the method, the load, the supports and the tissue.

pub mod by_label;
pub mod load_steps;

use crate::discretisation::lattice::placement::Boundary;
use crate::discretisation::lattice::stencil::Structure;
use crate::grid::Axis;
pub use crate::result::load::{Conditions, Ends, Load, Motion, Sed};
use load_steps::LoadSteps;
use serde::{Deserialize, Serialize};

/// Column `method`: how a specimen is discretised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Bonds between the sites of a lattice.
    #[default]
    Lattice,
    /// Bricks on the voxels' grid.
    VoxelFe,
    /// Ten-node tetrahedra inside a smooth surface.
    GeometryFe,
}

impl Method {
    /// The words of settings and results, in the order of the variants.
    pub const WORDS: &[&str] = &["lattice", "voxel-fe", "geometry-fe"];

    /// The word of settings and results.
    pub fn name(self) -> &'static str {
        Method::WORDS[self as usize]
    }
}

/// Column `structure`: what a model is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum CellType {
    /// Sites of such a lattice.
    Lattice(Structure),
    /// Bricks of eight nodes.
    Hex8,
    /// Tetrahedra of ten nodes.
    Tet10,
}

impl CellType {
    /// Whether it is a lattice.
    pub fn is_lattice(self) -> bool {
        matches!(self, CellType::Lattice(_))
    }

    /// The word of results.
    pub fn name(self) -> &'static str {
        match self {
            CellType::Lattice(structure) => structure.name(),
            CellType::Hex8 => "hex8",
            CellType::Tet10 => "tet10",
        }
    }
}

impl Default for CellType {
    fn default() -> Self {
        CellType::Lattice(Structure::Sc)
    }
}

/// Column `boundary`: the rule by which a lattice's sites exist, or how a modulus follows from those of other rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum BoundaryRule {
    /// Sites within 1.1 first-neighbour distances of bone.
    Firm,
    /// Sites that lie in a bone voxel.
    Floppy,
    /// Sites that go with the bone in a cell: connected SC lattices, weighted BCC and FCC lattices.
    Graded,
    /// Mean of firm and floppy.
    Ffb,
    /// Limit of several resolutions, of lattices or of elements.
    Extrapolated,
}

impl BoundaryRule {
    /// The word of results.
    pub fn name(self) -> &'static str {
        match self {
            BoundaryRule::Firm => "firm",
            BoundaryRule::Floppy => "floppy",
            BoundaryRule::Graded => "graded",
            BoundaryRule::Ffb => "ffb",
            BoundaryRule::Extrapolated => "extrapolated",
        }
    }

    /// The method's own name: files say `graded` of two of them.
    pub fn method_name(self, structure: CellType) -> &'static str {
        match (self, structure) {
            (BoundaryRule::Graded, CellType::Lattice(Structure::Sc)) => Boundary::Connected.name(),
            (BoundaryRule::Graded, _) => Boundary::Weighted.name(),
            _ => self.name(),
        }
    }

    /// True for a value that follows from other rows, without a solve of its own.
    pub fn is_derived(self) -> bool {
        matches!(self, BoundaryRule::Ffb | BoundaryRule::Extrapolated)
    }
}

impl From<Boundary> for BoundaryRule {
    fn from(boundary: Boundary) -> Self {
        match boundary {
            Boundary::Firm => BoundaryRule::Firm,
            Boundary::Floppy => BoundaryRule::Floppy,
            Boundary::Connected | Boundary::Weighted => BoundaryRule::Graded,
        }
    }
}

/// Column `ends`: how the loaded faces are held, or all faces where `load` is `stiffness`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Supports {
    /// The two loaded ends.
    Ends(Ends),
    /// All six faces, under unit strains.
    Faces(Conditions),
    /// The labels of an image, as column `supports` says.
    Labels,
}

impl Supports {
    /// The word of results.
    pub fn name(self) -> &'static str {
        match self {
            Supports::Ends(ends) => ends.name(),
            Supports::Faces(conditions) => conditions.name(),
            Supports::Labels => Load::Labels.name(),
        }
    }
}

impl Default for Supports {
    fn default() -> Self {
        Supports::Ends(Ends::Free)
    }
}

/// Reads and writes an enum as the word that its `name` gives, one of a fixed list.
macro_rules! words {
    ($kind:ty, [$($value:expr),+]) => {
        impl From<$kind> for &'static str {
            fn from(value: $kind) -> Self {
                value.name()
            }
        }

        impl TryFrom<String> for $kind {
            type Error = String;

            fn try_from(word: String) -> Result<Self, String> {
                let all = [$($value),+];
                all.into_iter().find(|value| value.name() == word).ok_or_else(|| {
                    let names = all.map(<$kind>::name).join(", ");
                    format!("expected one of {names}, found `{word}`")
                })
            }
        }
    };
}

words!(
    CellType,
    [
        CellType::Lattice(Structure::Sc),
        CellType::Lattice(Structure::Bcc),
        CellType::Lattice(Structure::Fcc),
        CellType::Hex8,
        CellType::Tet10
    ]
);
words!(
    BoundaryRule,
    [
        BoundaryRule::Firm,
        BoundaryRule::Floppy,
        BoundaryRule::Graded,
        BoundaryRule::Ffb,
        BoundaryRule::Extrapolated
    ]
);
words!(
    Supports,
    [
        Supports::Ends(Ends::Free),
        Supports::Ends(Ends::Bonded),
        Supports::Faces(Conditions::Kinematic),
        Supports::Faces(Conditions::Mixed),
        Supports::Faces(Conditions::Symshear),
        Supports::Labels
    ]
);

/// Column `elements`: what voxel elements follow from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Elements {
    /// One element a voxel of bone.
    #[default]
    Voxels,
    /// Interpolated grey values, thresholded again.
    InterpolatedGrey,
    /// Grey values smoothed once more, one element a voxel: shows what a coarser image would change, and answers nothing.
    SmoothedGrey,
    /// The mask's voxels, split: they converge to the voxel staircase.
    SplitVoxels,
    /// Means of blocks of voxels, thresholded.
    BlockMeans,
    /// Blocks of voxels, their moduli weighted by bone fraction.
    BoneFractions,
    /// Inside the surface where interpolated grey values cross the threshold.
    SmoothGrey,
    /// Inside that surface, corrected for the blur of the image.
    SmoothDeblurred,
    /// Inside the surface of a smoothed mask.
    SmoothMask,
}

/// All that a row follows from. Rows with equal settings are of the same solve.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Settings {
    /// Name of the scan.
    pub scan: String,
    /// How the specimen is discretised.
    pub method: Method,
    /// What the model is made of.
    pub structure: CellType,
    /// None for voxel FE.
    pub boundary: Option<BoundaryRule>,
    /// Lattice parameter, or element size for voxel FE.
    pub lp_mm: f64,
    /// None for lattices.
    pub elements: Option<Elements>,
    /// Offset of the lattice.
    pub registration_mm: Option<[f64; 3]>,
    /// Voxel edges.
    pub voxel_mm: [f64; 3],
    /// The bone's mean where `material` is given.
    pub young_mpa: f64,
    /// Poisson's ratio of the tissue.
    pub poisson: f64,
    /// What is done to the specimen.
    pub load: Load,
    /// How ends or faces are held.
    pub supports: Supports,
    /// The load axis.
    pub axis: Axis,
    /// 0 under a load that an angle describes.
    pub strain: f64,
    /// Of bending and torsion; None otherwise.
    pub angle_deg: Option<f64>,
    /// 0 for end planes.
    pub grip_mm: f64,
    /// What TV is, in words.
    pub tv_definition: String,
    /// Volume of interest, pores included.
    pub tv_mm3: f64,
    /// Bone volume fraction, 0 to 1.
    pub bv_tv: f64,
    /// Relative algebraic error allowed in the headline.
    pub tolerance: Option<f64>,
    /// The law by which tissue differs from voxel to voxel.
    pub material: Option<String>,
    /// Which strain energy density is reported, and Pistoia's criterion reads. None for lattices.
    pub sed: Option<Sed>,
    /// The law by which tissue yields; None where it is elastic.
    pub plasticity: Option<String>,
    /// Load steps of such tissue.
    pub steps: Option<LoadSteps>,
    /// Which labels are held, moved and pushed, or to which depth uneven ends are gripped; None for plane ends.
    pub held_by: Option<String>,
}

impl Settings {
    /// True for a value that follows from other rows, without a solve of its own.
    pub fn is_derived(&self) -> bool {
        self.boundary.is_some_and(BoundaryRule::is_derived)
    }

    /// The same of any boundary.
    pub fn without_boundary(&self) -> Settings {
        Settings {
            boundary: None,
            ..self.clone()
        }
    }

    /// The same of any method, resolution, place of the lattice and accuracy of the solver: what was done to which specimen.
    pub fn without_discretisation(&self) -> Settings {
        Settings {
            method: Method::default(),
            structure: CellType::default(),
            boundary: None,
            sed: None,
            ..self.without_resolution()
        }
    }

    /// The same of any resolution, place of the lattice and accuracy of the solver.
    pub fn without_resolution(&self) -> Settings {
        Settings {
            lp_mm: 0.0,
            elements: None,
            registration_mm: None,
            tolerance: None,
            ..self.clone()
        }
    }
}
