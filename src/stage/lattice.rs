//! Owns the lattice stage's settings.

use crate::error::{Error, Result};
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

impl LatticeParams {
    /// Refuses what no lattice can be built from.
    pub fn check(&self) -> Result<()> {
        for (key, empty) in [
            ("lattice.structure", self.structure.is_empty()),
            ("lattice.lp_mm", self.lp_mm.is_empty()),
            ("lattice.boundary", self.boundary.is_empty()),
        ] {
            if empty {
                return Err(Error::setting(key, "an empty list", "name at least one"));
            }
        }
        if let Some(lp) = self.lp_mm.iter().find(|lp| !(lp.is_finite() && **lp > 0.0)) {
            return Err(Error::setting(
                "lattice.lp_mm",
                format!("expected lengths in mm above 0, found {lp}"),
                "the paper uses 0.06, 0.08, 0.10, 0.12",
            ));
        }
        if self.registration_mm.iter().any(|r| !r.is_finite()) {
            return Err(Error::setting(
                "lattice.registration_mm",
                "expected three finite lengths in mm",
                "0,0,0 centres the lattice",
            ));
        }
        Ok(())
    }
}
