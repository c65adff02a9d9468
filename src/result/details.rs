//! Owns what a solve says in addition to its row: forces at both ends, failure at other volumes, sections, tissue by label. Each
//! list is a tidy table of its own.

use crate::result::strength::{CurvePoint, YieldedShare};
use serde::{Deserialize, Serialize};

/// What goes with one row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct Details {
    /// `reactions.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ends: Vec<EndForces>,
    /// `labels.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<LabelForces>,
    /// `failure.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failure: Vec<FailureAt>,
    /// `sections.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sections: Vec<SectionShare>,
    /// `tissue.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tissue: Vec<TissueSpread>,
    /// `curve.csv`, of the last solve of its kind.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curve: Vec<CurvePoint>,
    /// `yielded.csv`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub yielded: Vec<YieldedShare>,
}

/// Force and moment that the support puts on one end, the moment about the middle of that end's plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct EndForces {
    /// `lower` or `upper`.
    pub end: String,
    /// Force of the supports on the end, along x.
    pub force_x_n: f64,
    /// The same along y.
    pub force_y_n: f64,
    /// The same along z.
    pub force_z_n: f64,
    /// Moment of the supports on the end, about x.
    pub moment_x_nmm: f64,
    /// The same about y.
    pub moment_y_nmm: f64,
    /// The same about z.
    pub moment_z_nmm: f64,
    /// What the moment is about, from the corner of the specimen.
    pub about_x_mm: f64,
    /// The same along y.
    pub about_y_mm: f64,
    /// The same along z.
    pub about_z_mm: f64,
}

impl EndForces {
    /// The force along x, y, z.
    pub fn force_n(&self) -> [f64; 3] {
        [self.force_x_n, self.force_y_n, self.force_z_n]
    }

    /// The moment about x, y, z.
    pub fn moment_nmm(&self) -> [f64; 3] {
        [self.moment_x_nmm, self.moment_y_nmm, self.moment_z_nmm]
    }

    /// The place that the moment is about.
    pub fn about_mm(&self) -> [f64; 3] {
        [self.about_x_mm, self.about_y_mm, self.about_z_mm]
    }
}

/// What a label that is held, moved or pushed comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct LabelForces {
    /// Value of the label image.
    pub label: i32,
    /// `held`, `moved` or `pushed`.
    pub role: String,
    /// Nodes of bone at the corners of its voxels.
    pub nodes: u64,
    /// Force from outside on its nodes, along x.
    pub force_x_n: f64,
    /// The same along y.
    pub force_y_n: f64,
    /// The same along z.
    pub force_z_n: f64,
    /// Moment of those forces about the mean place of the nodes, about x.
    pub moment_x_nmm: f64,
    /// The same about y.
    pub moment_y_nmm: f64,
    /// The same about z.
    pub moment_z_nmm: f64,
    /// Mean place of the nodes, from the corner of the specimen.
    pub about_x_mm: f64,
    /// The same along y.
    pub about_y_mm: f64,
    /// The same along z.
    pub about_z_mm: f64,
    /// Mean displacement of the nodes, along x.
    pub displacement_x_mm: f64,
    /// The same along y.
    pub displacement_y_mm: f64,
    /// The same along z.
    pub displacement_z_mm: f64,
    /// Sum of force times displacement over the nodes: twice what these nodes put into the elastic energy.
    pub work_nmm: f64,
}

/// Failure by Pistoia's criterion at one critical volume.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct FailureAt {
    /// Share of the bone, 0 to 1.
    pub critical_volume: f64,
    /// Effective strain `√(2 SED / E)` that the share must exceed.
    pub critical_strain: f64,
    /// Labels whose bone counts, as `100;127`; `all` where every voxel does.
    pub labels: String,
    /// Effective strain that this share of the bone exceeds under the load applied.
    pub strain_at_volume: f64,
    /// What the load applied is multiplied by to fail.
    pub factor: f64,
    /// Force at failure, a magnitude. None under bending and torsion.
    pub failure_load_n: Option<f64>,
    /// Moment at failure, a magnitude. None under other loads.
    pub failure_moment_nmm: Option<f64>,
    /// Displacement of the ends at failure, a magnitude. None under bending and torsion.
    pub failure_displacement_mm: Option<f64>,
    /// Nominal strain at failure, a magnitude. None under bending and torsion.
    pub failure_strain: Option<f64>,
    /// Angle of the ends at failure, a magnitude. None under other loads.
    pub failure_angle_deg: Option<f64>,
}

/// What one tissue carries through a layer of elements across the load axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct SectionShare {
    /// `lower`, `middle` or `upper`.
    pub section: String,
    /// Of a labelled scan; `all` for the whole section.
    pub label: String,
    /// Elements of this tissue in the layer.
    pub elements: u64,
    /// Along the displacement of the ends, signed. None under bending and torsion.
    pub force_n: Option<f64>,
    /// About the middle of the grid, signed. None under other loads.
    pub moment_nmm: Option<f64>,
    /// Of the section's force or moment.
    pub share: f64,
}

/// How a quantity is distributed over the elements of one tissue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct TissueSpread {
    /// Of a labelled scan; `all` for all bone.
    pub label: String,
    /// `sed`, `effective_strain`, `von_mises`, or `principal_strain_1` to `3`, largest first.
    pub quantity: String,
    /// `MPa`, or empty for strains.
    pub unit: String,
    /// Elements of this tissue.
    pub elements: u64,
    /// Mean by volume.
    pub mean: f64,
    /// Standard deviation over all elements.
    pub sd: f64,
    /// Third central moment over `sd` cubed; None where values do not vary.
    pub skewness: Option<f64>,
    /// Least value.
    pub minimum: f64,
    /// 5th percentile.
    pub p5: f64,
    /// 25th percentile.
    pub p25: f64,
    /// 50th percentile.
    pub median: f64,
    /// 75th percentile.
    pub p75: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Largest value.
    pub maximum: f64,
}
