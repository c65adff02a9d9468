//! Owns the lattice stage's settings.

use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Structure {
    #[default]
    Sc,
    Bcc,
    Fcc,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    Firm,
    Floppy,
    Graded,
}

/// Settings of `lattice`: one lattice per structure × lattice parameter × boundary.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LatticeParams {
    pub structure: Vec<Structure>,
    pub lp_mm: Vec<f64>,
    pub boundary: Vec<Boundary>,
    /// Offset of the lattice in mm.
    pub registration_mm: [f64; 3],
}

impl Default for LatticeParams {
    fn default() -> Self {
        LatticeParams {
            structure: vec![Structure::Sc],
            lp_mm: vec![0.06, 0.08, 0.10, 0.12],
            boundary: vec![Boundary::Firm, Boundary::Floppy],
            registration_mm: [0.0; 3],
        }
    }
}
