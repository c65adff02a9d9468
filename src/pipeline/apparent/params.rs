//! Owns the settings of a solve: material, load, supports, accuracy, and what is wanted besides the modulus.

use crate::error::{Error, Result};
use crate::grid::Axis;
use crate::io::percent;
use crate::measure::pistoia::Pistoia;
use crate::physics::material::Material;
use crate::pipeline::apparent::fields::Field;
pub use crate::result::settings::{Conditions, Ends, Load, Method};
use serde::{Deserialize, Serialize};

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

/// Settings of `solve`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveParams {
    pub method: Method,
    pub young_mpa: f64,
    pub poisson: f64,
    /// How tissue differs from voxel to voxel. None: E and ν as above everywhere.
    pub material: Option<Material>,
    /// Nominal strain u / L_g; negative is compression.
    #[serde(deserialize_with = "percent::deserialize")]
    pub strain: f64,
    /// Thickness of each grip; 0: the end planes.
    pub grip_mm: f64,
    pub load: Load,
    pub ends: Ends,
    /// load = "stiffness": what the unit strains do on the faces.
    pub conditions: Conditions,
    pub axis: Axis,
    /// Relative algebraic error allowed in the headline modulus (0.001 is 0.1 %).
    #[serde(deserialize_with = "percent::deserialize")]
    pub tolerance: f64,
    pub max_iterations: usize,
    /// voxel-fe: each voxel becomes this many elements along every axis.
    pub refine: usize,
    /// Split the mask's voxels where `refine` would interpolate grey values: elements of the voxel staircase.
    pub refine_mask: bool,
    /// voxel-fe: smooth the grey values once more, by [`crate::result::shape::AGAIN_VOXELS`], and threshold again.
    pub smoothed_again: bool,
    /// voxel-fe: this many voxels along every axis become one element.
    pub coarsen: usize,
    pub coarsen_by: CoarsenBy,
    /// geometry-fe: edge of the cells that elements are made in, in mm. None: from the struts' thickness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_mm: Option<f64>,
    /// Count mechanisms, too; takes a factorisation.
    pub mechanisms: bool,
    /// Fields to write.
    pub fields: Vec<Field>,
    /// voxel-fe: find the failure load by this criterion.
    pub pistoia: Option<Pistoia>,
}

impl Default for SolveParams {
    fn default() -> Self {
        SolveParams {
            method: Method::Lattice,
            young_mpa: 1000.0,
            poisson: 0.3,
            material: None,
            strain: -0.01,
            grip_mm: 0.0,
            load: Load::Uniaxial,
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
            mechanisms: false,
            fields: Vec::new(),
            pistoia: None,
        }
    }
}

impl SolveParams {
    /// Whether grey values of the scan are needed in addition to its mask.
    pub fn needs_grey(&self) -> bool {
        self.material.is_some()
            || self.smoothed_again
            || self.method == Method::GeometryFe
            || (self.refine > 1 && !self.refine_mask)
            || (self.coarsen > 1 && self.coarsen_by == CoarsenBy::Threshold)
    }

    /// Refuses what is no elastic material, no load or no accuracy.
    pub fn check(&self) -> Result<()> {
        let rules = [
            (
                "solve.young_mpa",
                self.young_mpa,
                self.young_mpa > 0.0,
                "a modulus in MPa above 0 (the paper: 1000)",
            ),
            (
                "solve.poisson",
                self.poisson,
                self.poisson > -1.0 && self.poisson < 0.5,
                "a ratio above -1 and below 0.5 (bone: 0.3; at 0.5 the material is incompressible and has no stiffness matrix)",
            ),
            (
                "solve.strain",
                self.strain,
                self.strain != 0.0,
                "a strain other than 0; negative is compression (the paper: -0.0042)",
            ),
            (
                "solve.grip_mm",
                self.grip_mm,
                self.grip_mm >= 0.0,
                "a thickness in mm; 0 grips the end planes (the paper: 0.6)",
            ),
            (
                "solve.tolerance",
                self.tolerance,
                self.tolerance > 0.0 && self.tolerance < 1.0,
                "a relative error between 0 and 1 (0.001 is 0.1 %)",
            ),
        ];
        for (key, value, ok, expected) in rules {
            if !ok || !value.is_finite() {
                return Err(Error::setting(
                    key,
                    format!("not usable: {value}"),
                    format!("give {expected}"),
                ));
            }
        }
        for (key, factor) in [
            ("solve.refine", self.refine),
            ("solve.coarsen", self.coarsen),
        ] {
            if factor == 0 {
                return Err(Error::setting(
                    key,
                    "found 0",
                    "give 1 or more; 1 is one element per voxel",
                ));
            }
        }
        if self.refine > 1 && self.coarsen > 1 {
            return Err(Error::setting(
                "solve.refine",
                format!(
                    "refine {} and coarsen {} exclude each other",
                    self.refine, self.coarsen
                ),
                "set one of them to 1",
            ));
        }
        if let Some(material) = &self.material {
            material.check(self.poisson)?;
        }
        if let Some(pistoia) = &self.pistoia {
            pistoia.check()?;
        }
        let recorded = !self.fields.is_empty() || self.pistoia.is_some();
        if recorded && self.load == Load::Stiffness {
            return Err(Error::setting(
                "solve.fields",
                "fields and the failure load come from one load",
                "add --load uniaxial or confined, or leave --fields and --failure out",
            ));
        }
        let of_elements = self.fields.contains(&Field::VonMises) || self.pistoia.is_some();
        if of_elements && self.method == Method::Lattice {
            return Err(Error::setting(
                "solve.fields",
                "the failure load and von Mises stresses come from voxel elements",
                "add --method voxel-fe, or ask for --fields displacement,sed,fraction of a lattice",
            ));
        }
        if let Some(size) = self.element_mm
            && !(size > 0.0 && size.is_finite())
        {
            return Err(Error::setting(
                "solve.element_mm",
                format!("not usable: {size}"),
                "give a size in mm above 0, or leave it out: it then follows from the struts",
            ));
        }
        if self.max_iterations == 0 {
            return Err(Error::setting(
                "solve.max_iterations",
                "0 iterations solve nothing",
                "give 1 or more",
            ));
        }
        Ok(())
    }
}
