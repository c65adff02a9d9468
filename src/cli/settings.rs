//! Settings that several verbs take: tissue, lattices.

pub mod overrides;

use super::words;
use bonepd_ct::error::{Error, Result};
use bonepd_ct::physics::material::{Law, Material};
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::lattice::{BoundaryWord, LatticeParams, Structure};
use clap::Args;
use overrides::lay_over;
use serde::Serialize;

/// What bone is made of.
#[derive(Args)]
pub struct TissueSettings {
    /// Young's modulus of the bone tissue in MPa [default: 1000]
    #[arg(long, value_name = "E", value_parser = words::positive)]
    young_mpa: Option<f64>,
    /// Moduli that differ from voxel to voxel: labels:100=6829/0.3,127=10000 (E, and ν if another), power:C,N (E = C·ρ^N),
    /// linear:A,B (E = A·ρ + B), homminga:FULL[,N] (E = young-mpa·(ρ/FULL)^N, N 1.7); ρ are the scan's values, which
    /// `segment` keeps
    #[arg(long, value_name = "LAW", value_parser = words::material)]
    material: Option<Law>,
    /// Density of the law is SLOPE·value + INTERCEPT [default: the scan's values]
    #[arg(long, value_name = "SLOPE,INTERCEPT", value_parser = words::pair, allow_hyphen_values = true)]
    density: Option<[f64; 2]>,
    /// Raise smaller moduli of a law to this
    #[arg(long, value_name = "E", value_parser = words::positive)]
    least_mpa: Option<f64>,
}

impl TissueSettings {
    /// Options that were given override `params`.
    pub fn apply(&self, params: &mut SolveParams) -> Result<()> {
        params.young_mpa = self.young_mpa.unwrap_or(params.young_mpa);
        if let Some(law) = &self.material {
            params.material = Some(Material::new(law.clone()));
        }
        match &mut params.material {
            Some(material) => {
                material.density = self.density.unwrap_or(material.density);
                material.least_mpa = self.least_mpa.or(material.least_mpa);
            }
            None if self.density.is_some() || self.least_mpa.is_some() => {
                return Err(Error::setting(
                    "--density, --least-mpa",
                    "they belong to a law of moduli, and none is given",
                    "add --material, or leave them out",
                ));
            }
            None => {}
        }
        Ok(())
    }
}

/// The fields are the keys of `[lattice]`.
#[derive(Args, Serialize)]
#[command(next_help_heading = "Lattice")]
pub struct LatticeSettings {
    /// Lattice structures, comma-separated [default: sc]
    #[arg(long, value_delimiter = ',', value_parser = words::choice::<Structure>(&["sc", "bcc", "fcc"]))]
    structure: Vec<Structure>,
    /// Lattice parameters in mm, comma-separated [default: 0.06,0.08,0.10,0.12]
    #[arg(long = "lp", value_name = "MM", value_delimiter = ',', value_parser = words::positive)]
    lp_mm: Vec<f64>,
    /// How the lattice meets the bone's surface, comma-separated: firm, floppy, connected (sc: a site per connected component
    /// of bone in a cell), weighted (bcc, fcc: sites weighted by the bone fraction of their cell). graded, the older word,
    /// means connected on sc and weighted on bcc and fcc; result files say graded for both [default: firm,floppy]
    #[arg(long, value_delimiter = ',', value_parser = words::choice::<BoundaryWord>(&["firm", "floppy", "connected", "weighted", "graded"]))]
    boundary: Vec<BoundaryWord>,
    /// Shift the lattice by this many mm along x, y, z
    #[arg(long = "registration", value_name = "X,Y,Z", value_parser = words::triple, allow_hyphen_values = true)]
    registration_mm: Option<[f64; 3]>,
}

impl LatticeSettings {
    /// Options that were given override `params`.
    pub fn apply(&self, params: &mut LatticeParams) -> Result<()> {
        lay_over(params, self)?;
        params.check()
    }
}
