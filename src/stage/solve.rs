//! Owns the solve stage's settings: material, load, supports, accuracy.

use crate::grid::Axis;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    #[default]
    Lattice,
    VoxelFe,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Load {
    #[default]
    Uniaxial,
    /// Sides held against lateral motion.
    Confined,
    /// All six unit strains: the apparent stiffness matrix.
    Stiffness,
}

/// What the gripped sites may do sideways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Ends {
    #[default]
    Free,
    Bonded,
}

/// Settings of `solve`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolveParams {
    pub method: Method,
    pub young_mpa: f64,
    pub poisson: f64,
    /// Nominal strain u / L_g; negative is compression.
    pub strain: f64,
    /// Thickness of each grip; 0: the end planes.
    pub grip_mm: f64,
    pub load: Load,
    pub ends: Ends,
    pub axis: Axis,
    /// Relative algebraic error allowed in the headline modulus (0.001 is 0.1 %).
    pub tolerance: f64,
    pub max_iterations: usize,
}

impl Default for SolveParams {
    fn default() -> Self {
        SolveParams {
            method: Method::Lattice,
            young_mpa: 1000.0,
            poisson: 0.3,
            strain: -0.01,
            grip_mm: 0.0,
            load: Load::Uniaxial,
            ends: Ends::Free,
            axis: Axis::Z,
            tolerance: 1e-3,
            max_iterations: 200_000,
        }
    }
}
