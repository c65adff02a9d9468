//! Owns the settings of a solve: material, load, supports, accuracy, and what is wanted in addition to the modulus.

use crate::grid::Axis;
use crate::io::percent;
use crate::measure::pistoia::Pistoia;
use crate::physics::material::Material;
use crate::physics::plasticity::Plasticity;
use crate::pipeline::apparent::fields::Field;
pub use crate::result::settings::by_label::{HeldLabel, MovedLabel, PushedLabel};
pub use crate::result::settings::load_steps::LoadSteps;
pub use crate::result::settings::{Conditions, Ends, Load, Method, Sed};
use crate::volume::Volume;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// What becomes of a block of voxels that one element covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum CoarsenBy {
    /// Bone where at least half of it is bone, else pore.
    #[default]
    Threshold,
    /// An element whose modulus is that of bone times its bone fraction.
    Fraction,
}

/// Whose surface smooth elements have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SurfaceOf {
    /// Where the image crosses its threshold.
    Image,
    /// The same, corrected for what the image's blur, or the voxel's own box, does to it: it thins struts and fills joints.
    Body,
}

/// A label image of the settings: its file, and its labels once they were read.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(from = "PathBuf", into = "PathBuf")]
pub struct LabelImage {
    /// The file.
    pub path: PathBuf,
    /// None before it was read.
    pub laid: Option<Arc<Laid>>,
}

/// Labels on the voxels of a specimen.
#[derive(Debug)]
pub struct Laid {
    /// Of the file.
    pub blake3: String,
    /// One a voxel of the specimen; 0 is none.
    pub labels: Volume<i32>,
}

impl From<PathBuf> for LabelImage {
    fn from(path: PathBuf) -> Self {
        LabelImage { path, laid: None }
    }
}

impl From<LabelImage> for PathBuf {
    fn from(image: LabelImage) -> Self {
        image.path
    }
}

impl PartialEq for LabelImage {
    /// The same file; of two that were read, with the same contents.
    fn eq(&self, other: &Self) -> bool {
        let read = self.laid.as_ref().zip(other.laid.as_ref());
        self.path == other.path && read.is_none_or(|(a, b)| a.blake3 == b.blake3)
    }
}

/// Settings of `solve`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveParams {
    /// How the specimen is discretised.
    pub method: Method,
    /// Young's modulus of the tissue.
    pub young_mpa: f64,
    /// Poisson's ratio of the tissue.
    pub poisson: f64,
    /// How tissue differs from voxel to voxel. None: E and ν as above everywhere.
    pub material: Option<Material>,
    /// voxel-fe: how tissue yields. None: it is elastic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plasticity: Option<Plasticity>,
    /// Of plasticity: how the load grows. A step that fails is halved.
    pub steps: LoadSteps,
    /// Nominal strain u / L_g; negative is compression.
    #[serde(deserialize_with = "percent::deserialize")]
    pub strain: f64,
    /// Thickness of each grip; 0: the end planes.
    pub grip_mm: f64,
    /// voxel-fe: grips the bone that is seen from each end plane down to this depth; 0: the end planes.
    #[serde(skip_serializing_if = "is_zero")]
    pub ends_depth_mm: f64,
    /// What is done to the specimen.
    pub load: Load,
    /// load = "labels": labels that are held, as `LABEL[:xyz]`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<HeldLabel>,
    /// Labels that are displaced, as `LABEL:ux,uy,uz` in mm.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moved: Vec<MovedLabel>,
    /// Labels that a force acts on, as `LABEL:fx,fy,fz` in N.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pushed: Vec<PushedLabel>,
    /// The image of those labels, on the scan's grid. None: the scan's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub supports: Option<LabelImage>,
    /// blake3 of the scan, where its own labels are those.
    #[serde(skip)]
    pub own_labels: Option<String>,
    /// Bending and torsion: by how many degrees the ends turn against each other.
    pub angle_deg: f64,
    /// Uniaxial loads; other loads hold the ends in all components.
    pub ends: Ends,
    /// load = "stiffness": what the unit strains do on the faces.
    pub conditions: Conditions,
    /// The load axis.
    pub axis: Axis,
    /// Relative algebraic error allowed in the headline modulus (0.001 is 0.1 %).
    #[serde(deserialize_with = "percent::deserialize")]
    pub tolerance: f64,
    /// A solve that takes more is ended and marked as not converged.
    pub max_iterations: usize,
    /// voxel-fe: each voxel becomes this many elements along every axis.
    pub refine: usize,
    /// Split the mask's voxels where `refine` would interpolate grey values: elements of the voxel staircase.
    pub refine_mask: bool,
    /// voxel-fe: smooth the grey values once more, by [`crate::result::shape::AGAIN_VOXELS`], and threshold again.
    pub smoothed_again: bool,
    /// voxel-fe: this many voxels along every axis become one element.
    pub coarsen: usize,
    /// What becomes of such blocks.
    pub coarsen_by: CoarsenBy,
    /// geometry-fe: edge of the cells that elements are made in, in mm. None: from the struts' thickness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_mm: Option<f64>,
    /// geometry-fe: whose surface it is. None: the body's where `segment` was given the scanner's blur or none
    /// is seen, else the image's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceOf>,
    /// σ in voxels of the blur that the body's surface is corrected for: follows from the scan, so that a solve with another blur is another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub corrected_blur_voxels: Option<f64>,
    /// Also count mechanisms; takes a factorisation.
    pub mechanisms: bool,
    /// Fields to write.
    pub fields: Vec<Field>,
    /// voxel-fe: find the failure load by this criterion.
    pub pistoia: Option<Pistoia>,
    /// Labels whose bone counts in that criterion; all bone where there are none.
    pub failure_labels: Vec<i32>,
    /// voxel-fe: the strain energy density of elements.
    pub sed: Sed,
    /// voxel-fe: how strains and stresses are distributed over each tissue, and what each carries.
    pub statistics: bool,
}

fn is_zero(v: &f64) -> bool {
    *v == 0.0
}

impl Default for SolveParams {
    fn default() -> Self {
        SolveParams {
            method: Method::Lattice,
            young_mpa: 1000.0,
            poisson: 0.3,
            material: None,
            plasticity: None,
            steps: LoadSteps::default(),
            strain: -0.01,
            grip_mm: 0.0,
            ends_depth_mm: 0.0,
            load: Load::Uniaxial,
            held: Vec::new(),
            moved: Vec::new(),
            pushed: Vec::new(),
            supports: None,
            own_labels: None,
            angle_deg: 1.0,
            ends: Ends::Free,
            conditions: Conditions::Kinematic,
            axis: Axis::Z,
            tolerance: 1e-3,
            max_iterations: 200_000,
            refine: 1,
            refine_mask: false,
            smoothed_again: false,
            coarsen: 1,
            coarsen_by: CoarsenBy::default(),
            element_mm: None,
            surface: None,
            corrected_blur_voxels: None,
            mechanisms: false,
            fields: Vec::new(),
            pistoia: None,
            failure_labels: Vec::new(),
            sed: Sed::default(),
            statistics: false,
        }
    }
}

impl SolveParams {
    /// Whether grey values of the scan are needed in addition to its mask.
    pub fn needs_grey(&self) -> bool {
        self.material.is_some() || self.method != Method::Lattice || self.needs_labels()
    }

    /// Whether labels of an image are held, moved or pushed.
    pub fn names_labels(&self) -> bool {
        !(self.held.is_empty() && self.moved.is_empty() && self.pushed.is_empty())
    }

    /// Supports and loads by label in a line, with the file of the labels, or uneven ends. None for plane ends.
    pub fn supports_in_words(&self) -> Option<String> {
        if self.ends_depth_mm > 0.0 {
            let depth = self.ends_depth_mm;
            return Some(format!("bone seen from the ends to a depth of {depth} mm"));
        }
        if self.load != Load::Labels {
            return None;
        }
        let said = |role: &str, all: Vec<String>| match all.is_empty() {
            true => None,
            false => Some(format!("{role} {}", all.join(" "))),
        };
        let image = self.supports.as_ref().map(|image| {
            let name = image.path.file_name().unwrap_or_default().to_string_lossy();
            let hash = image.laid.as_ref().map_or("", |laid| &laid.blake3);
            format!("labels of {name} (blake3 {})", &hash[..hash.len().min(16)])
        });
        let own = self.own_labels.as_ref().filter(|_| self.supports.is_none());
        let own = own.map(|hash| {
            format!(
                "labels of the scan (blake3 {})",
                &hash[..hash.len().min(16)]
            )
        });
        let parts = [
            said("held", self.held.iter().map(ToString::to_string).collect()),
            said(
                "moved",
                self.moved.iter().map(ToString::to_string).collect(),
            ),
            said(
                "pushed",
                self.pushed.iter().map(ToString::to_string).collect(),
            ),
            image,
            own,
        ];
        Some(parts.into_iter().flatten().collect::<Vec<_>>().join("; "))
    }

    /// Whether labels of the scan are read where it has some.
    pub fn needs_labels(&self) -> bool {
        self.statistics || !self.failure_labels.is_empty() || self.plasticity.is_some()
    }
}
