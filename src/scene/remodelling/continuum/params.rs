//! Owns the settings of the local continuum.

use crate::error::{Error, Result};
use crate::physics::bond_based::micromodulus_discrete;
use crate::physics::bond_based::shear::Micromoduli;
use crate::physics::hyperelastic::Energy;
use crate::scene::remodelling::density::{DensityParams, GrowthParams};
use crate::scene::remodelling::solver::SolverParams;
use crate::scene::setting::Setting;
use serde::{Deserialize, Serialize};

/// `[physics.continuum]`: bilinear quadrilaterals whose nodes are the points of the grid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ContinuumParams {
    /// Young's modulus at the reference density.
    pub young: f64,
    /// In plane stress. Bonds take up to 1/3; below, they resist shear.
    #[serde(default = "third")]
    pub poisson: f64,
    #[serde(default)]
    pub energy: EnergyLaw,
    /// Where densities live.
    #[serde(default)]
    pub density_at: DensityAt,
    #[serde(default)]
    pub density: DensityParams,
    /// Absent: densities stay.
    #[serde(default)]
    pub growth: Option<GrowthParams>,
    #[serde(default)]
    pub solver: SolverParams,
}

fn third() -> f64 {
    1.0 / 3.0
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum EnergyLaw {
    #[default]
    StVenantKirchhoff,
    NeoHooke,
    /// The local limit of peridynamics: harmonic bonds in all directions.
    IsotropicBonds,
    /// The local limit at fixed δ/Δ: harmonic bonds along the grid's stencil.
    StencilBonds,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum DensityAt {
    #[default]
    Nodes,
    Gauss,
}

impl ContinuumParams {
    /// The energy of a strain at the reference density.
    pub fn law(&self, scene: &Setting) -> Result<Energy> {
        if !(self.young.is_finite() && self.young > 0.0) {
            return Err(Error::setting(
                "physics.continuum.young",
                format!("found {}", self.young),
                "give a positive modulus",
            ));
        }
        if !(-0.99..=0.99).contains(&self.poisson) {
            return Err(Error::setting(
                "physics.continuum.poisson",
                format!("found {}", self.poisson),
                "give a plane-stress Poisson's ratio from -0.99 to 0.99",
            ));
        }
        let is_of_bonds = matches!(
            self.energy,
            EnergyLaw::IsotropicBonds | EnergyLaw::StencilBonds
        );
        if is_of_bonds && self.poisson > third() {
            return Err(Error::setting(
                "physics.continuum.poisson",
                format!("found {}, which no bonds have", self.poisson),
                "give at most 1/3, or energy = \"st-venant-kirchhoff\" or \"neo-hooke\"",
            ));
        }
        Ok(match self.energy {
            EnergyLaw::StVenantKirchhoff => Energy::plane_stress(self.young, self.poisson),
            EnergyLaw::NeoHooke => Energy::neo_hooke(self.young, self.poisson),
            EnergyLaw::IsotropicBonds if self.poisson < third() => {
                Energy::isotropic_shear_bonds(self.young, self.poisson)
            }
            EnergyLaw::StencilBonds if self.poisson < third() => {
                let stencil = scene.stencil()?;
                let c = Micromoduli::discrete(self.young, self.poisson, &stencil);
                let quarter = 0.25 * stencil.spacing.powi(2);
                let bond = |b: &crate::discretisation::plane::family::Bond| {
                    let share = quarter * b.length * b.share;
                    let n = b.xi.map(|v| v / b.length);
                    (n, [share * c.axial, share * c.shear])
                };
                Energy::ShearBonds(stencil.bonds.iter().map(bond).collect())
            }
            EnergyLaw::IsotropicBonds => Energy::isotropic_bonds(self.young),
            EnergyLaw::StencilBonds => {
                let stencil = scene.stencil()?;
                let quarter =
                    0.25 * micromodulus_discrete(self.young, &stencil) * stencil.spacing.powi(2);
                let bond = |b: &crate::discretisation::plane::family::Bond| {
                    (b.xi.map(|v| v / b.length), quarter * b.length * b.share)
                };
                Energy::Bonds(stencil.bonds.iter().map(bond).collect())
            }
        })
    }
}
