//! Owns scenes of bond-based peridynamics, with or without growth.

use crate::discretisation::plane::family::Stencil;
use crate::error::{Error, Result};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::bond_based::{
    BondBased, Material, Step, micromodulus_continuous, micromodulus_discrete,
};
use crate::physics::growth::{Growth, Weight};
use crate::scene::remodelling::body::{Body, Conditions, Motion};
use crate::scene::remodelling::density::{DensityParams, GrowthParams, Probes};
use crate::scene::remodelling::loads::Loads;
use crate::scene::remodelling::marcher::{Marcher, Model, Stage};
use crate::scene::remodelling::solver::SolverParams;
use crate::scene::setting::{Inputs, Setting};
use serde::{Deserialize, Serialize};

/// `[physics.bond-based]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BondBasedParams {
    /// Young's modulus at the reference density.
    pub young: f64,
    /// Poisson's ratio in plane stress. Below 1/3, that of bonds under stretch alone, bonds resist shear too, and points turn.
    #[serde(default = "third")]
    pub poisson: f64,
    /// Several load cases; the stimulus is the weighted mean of their energies. Absent: one.
    #[serde(default)]
    pub cases: Vec<Case>,
    #[serde(default)]
    pub micromodulus: Micromodulus,
    #[serde(default)]
    pub density: DensityParams,
    /// Absent: densities are no unknowns.
    #[serde(default)]
    pub growth: Option<GrowthParams>,
    #[serde(default)]
    pub solver: SolverParams,
}

/// Poisson's ratio of bonds that resist stretch alone, in plane stress.
pub const CENTRAL: f64 = 1.0 / 3.0;

fn third() -> f64 {
    CENTRAL
}

/// Where the bond stiffness comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Default)]
#[serde(rename_all = "kebab-case")]
pub enum Micromodulus {
    /// `6E / Σ L V` over the stencil: exact energy of small biaxial strain on this grid.
    #[default]
    Discrete,
    /// `9E / (π δ³)`: the continuum's.
    Continuous,
    /// The continuum's, fitted at this finite biaxial strain `e` to St. Venant-Kirchhoff: `× (1 + e/2)²`. Above 0.
    Finite(f64),
}

/// One of several load cases that act on the same densities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// What its loads name.
    pub name: String,
    /// Its cycles, or its share of them: only ratios matter.
    pub weight: f64,
}

/// What all models of bonds start from.
pub(super) struct Start {
    pub body: Body,
    pub stencil: Stencil,
    pub growth: Option<Growth>,
    pub weight: Weight,
    pub density: Vec<f64>,
    pub probes: Probes,
    pub loads: Option<Loads>,
    pub shares: Option<Vec<f64>>,
}

impl Start {
    /// # Errors
    /// What a run would refuse before its first step.
    pub fn new(
        scene: &Setting,
        params: &BondBasedParams,
        inputs: &Inputs,
        motion: Motion,
    ) -> Result<Self> {
        let stencil = scene.stencil()?;
        let material = scene.points(inputs)?;
        let growth = params
            .growth
            .as_ref()
            .map(|g| g.checked(&params.density))
            .transpose()?;
        let density = params.density.initial(&material, inputs)?;
        let conditions = Conditions {
            layers: scene.layers.as_ref(),
            reach: stencil.reach() as usize,
            holds: &scene.hold,
            density: density.clone(),
            reference_density: params.density.reference,
            grows: growth.is_some(),
            motion,
        };
        let body = Body::new(material.clone(), conditions)?;
        let names: Vec<&str> = params.cases.iter().map(|c| c.name.as_str()).collect();
        let loads = match scene.load.is_empty() {
            true => None,
            false => Some(Loads::new(scene, &body, &names)?),
        };
        let shares = body.shares();
        let areas = match &shares {
            Some(shares) => shares[..body.material].to_vec(),
            None => vec![1.0; body.material],
        };
        Ok(Start {
            probes: Probes::new(&scene.probe, &material, areas)?,
            weight: Weight {
                reference: params.density.reference,
                exponent: params.density.exponent,
            },
            body,
            stencil,
            growth,
            density,
            loads,
            shares,
        })
    }
}

/// The body of a scene, at rest.
pub fn marcher(
    scene: &Setting,
    params: &BondBasedParams,
    inputs: &Inputs,
) -> Result<Marcher<BondBased>> {
    let start = Start::new(scene, params, inputs, Motion::PLAIN)?;
    let substance = Material {
        micromodulus: params.micromodulus.value(params.young, &start.stencil)?,
        young: params.young,
        weight: start.weight,
        growth: start.growth,
    };
    let (body, stencil, shares) = (start.body, start.stencil, start.shares);
    let model = BondBased::new(&body.points, body.material, stencil, substance, shares);
    let horizon = model.family.stencil.horizon;
    let (density, probes, loads) = (start.density, start.probes, start.loads);
    Marcher::new(body, model, density, probes, loads, &params.solver, horizon)
}

impl Model for BondBased {
    type Step<'a> = Step<'a>;

    fn step<'a>(&'a self, of: Stage<'a>) -> Step<'a> {
        of.of_bonds(self)
    }

    fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        BondBased::pattern_from(self, map, first)
    }

    fn weight(&self) -> &Weight {
        &self.weight
    }

    fn bonds(&self) -> usize {
        self.family.len() / 2
    }
}

/// # Errors
/// A modulus that is not positive.
pub(super) fn require_modulus(young: f64) -> Result<()> {
    if young.is_finite() && young > 0.0 {
        return Ok(());
    }
    Err(Error::setting(
        "physics.bond-based.young",
        format!("found {young}"),
        "give a positive modulus",
    ))
}

impl Micromodulus {
    fn value(self, young: f64, stencil: &Stencil) -> Result<f64> {
        require_modulus(young)?;
        if let Micromodulus::Finite(e) = self
            && !(e.is_finite() && e > 0.0)
        {
            return Err(Error::setting(
                "physics.bond-based.micromodulus.finite",
                format!("found a biaxial strain of {e}"),
                "give a positive one, such as 0.163, or micromodulus = \"continuous\" for small strain",
            ));
        }
        Ok(match self {
            Micromodulus::Discrete => micromodulus_discrete(young, stencil),
            Micromodulus::Continuous => micromodulus_continuous(young, stencil),
            Micromodulus::Finite(e) => {
                micromodulus_continuous(young, stencil) * (1.0 + 0.5 * e).powi(2)
            }
        })
    }
}
