//! Owns the record of one solve: a row of `results.csv`. Missing values are `None` here and `NA` in the file.

use serde::{Deserialize, Serialize};

/// One row of `results.csv`, its columns in the order of the fields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, Default)]
#[serde(default)]
pub struct Row {
    pub scan: String,
    /// `lattice` or `voxel-fe`.
    pub method: String,
    /// `sc`, `bcc`, `fcc` or `hex8`.
    pub structure: String,
    /// `firm`, `floppy`, `graded`, `ffb`, `extrapolated`; None for voxel FE.
    pub boundary: Option<String>,
    /// Lattice parameter, or element size for voxel FE.
    pub lp_mm: f64,
    /// Offset of the lattice, `x;y;z` in mm.
    pub registration: Option<String>,
    /// Voxel edge; `x;y;z` where they differ.
    pub voxel_mm: String,
    pub young_mpa: f64,
    pub poisson: f64,
    pub load: String,
    pub ends: String,
    pub axis: String,
    pub strain: f64,
    /// 0 for end planes.
    pub grip_mm: f64,
    pub tv_definition: String,
    pub tv_mm3: f64,
    pub bv_tv: f64,
    pub sites: Option<u64>,
    pub dropped_sites: Option<u64>,
    pub unknowns: Option<u64>,
    pub iterations: Option<u64>,
    pub residual: Option<f64>,
    pub converged: Option<bool>,
    /// The headline: energy for floppy, graded and voxel FE; stress of the fully coordinated sites for firm.
    pub e_app_mpa: Option<f64>,
    pub e_app_reaction_mpa: Option<f64>,
    pub e_app_stress_mpa: Option<f64>,
    pub algebraic_error_mpa: Option<f64>,
    pub discretization_error_mpa: Option<f64>,
    pub wall_s: Option<f64>,
    pub peak_mib: Option<f64>,
    /// Quick estimate of the struts' thickness, 2 BV / BS.
    pub mean_thickness_mm: Option<f64>,
    /// Relative algebraic error asked for in the headline.
    pub tolerance: Option<f64>,
    /// What a reader must know of this row (no path between the faces, not converged, ...).
    pub note: Option<String>,
    /// From a manifest.
    pub group: Option<String>,
    pub subject: Option<String>,
    /// Motions that cost next to no energy, rigid motions of the whole apart; where `--mechanisms` asks for them.
    pub mechanisms: Option<u64>,
    /// The law by which tissue differs from voxel to voxel; `young_mpa` is then the bone's mean.
    pub material: Option<String>,
    /// By Pistoia's criterion, on request: magnitude of the reaction at failure, and what the load is multiplied by.
    pub failure_load_n: Option<f64>,
    pub failure_factor: Option<f64>,
    /// Of the whole mask, where `segment --morphometry` measured it: mean local thickness of bone and of pores,
    /// connectivity density, degree of anisotropy by mean intercept lengths.
    pub tb_th_mm: Option<f64>,
    pub tb_sp_mm: Option<f64>,
    pub conn_d_per_mm3: Option<f64>,
    pub da: Option<f64>,
}
