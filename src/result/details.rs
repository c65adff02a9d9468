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
    pub force_x_n: f64,
    pub force_y_n: f64,
    pub force_z_n: f64,
    pub moment_x_nmm: f64,
    pub moment_y_nmm: f64,
    pub moment_z_nmm: f64,
    /// What the moment is about, from the corner of the specimen.
    pub about_x_mm: f64,
    pub about_y_mm: f64,
    pub about_z_mm: f64,
}

impl EndForces {
    pub fn force_n(&self) -> [f64; 3] {
        [self.force_x_n, self.force_y_n, self.force_z_n]
    }

    pub fn moment_nmm(&self) -> [f64; 3] {
        [self.moment_x_nmm, self.moment_y_nmm, self.moment_z_nmm]
    }

    pub fn about_mm(&self) -> [f64; 3] {
        [self.about_x_mm, self.about_y_mm, self.about_z_mm]
    }
}

/// Failure by Pistoia's criterion at one critical volume.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct FailureAt {
    /// Share of the bone, 0 to 1.
    pub critical_volume: f64,
    pub critical_strain: f64,
    /// Labels whose bone counts, as `100;127`; `all` where every voxel does.
    pub labels: String,
    /// Effective strain that this share of the bone exceeds under the load applied.
    pub strain_at_volume: f64,
    /// What the load applied is multiplied by to fail.
    pub factor: f64,
    pub failure_load_n: Option<f64>,
    pub failure_moment_nmm: Option<f64>,
    pub failure_displacement_mm: Option<f64>,
    pub failure_strain: Option<f64>,
    pub failure_angle_deg: Option<f64>,
}

/// What one tissue carries through a layer of elements across the load axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct SectionShare {
    /// `lower`, `middle` or `upper`.
    pub section: String,
    /// Of a labelled scan; `all` for the whole section.
    pub label: String,
    pub elements: u64,
    pub force_n: Option<f64>,
    pub moment_nmm: Option<f64>,
    /// Of the section's force or moment.
    pub share: f64,
}

/// How a quantity is distributed over the elements of one tissue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
pub struct TissueSpread {
    /// Of a labelled scan; `all` for all bone.
    pub label: String,
    pub quantity: String,
    /// `MPa`, or empty for strains.
    pub unit: String,
    pub elements: u64,
    pub mean: f64,
    pub sd: f64,
    pub skewness: Option<f64>,
    pub minimum: f64,
    pub p5: f64,
    pub p25: f64,
    pub median: f64,
    pub p75: f64,
    pub p95: f64,
    pub maximum: f64,
}
