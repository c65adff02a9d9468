//! Owns scenes of bond-based peridynamics, with or without growth.

use crate::error::{Error, Result};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::bond_based::{
    BondBased, Material, Step, micromodulus_continuous, micromodulus_discrete,
};
use crate::physics::growth::Weight;
use crate::scene::remodelling::body::{Body, Conditions};
use crate::scene::remodelling::density::{DensityParams, GrowthParams, Probes};
use crate::scene::remodelling::marcher::{Marcher, Model, Stage};
use crate::scene::remodelling::solver::SolverParams;
use crate::scene::setting::{Inputs, Setting};
use serde::{Deserialize, Serialize};

/// `[physics.bond-based]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BondBasedParams {
    /// Young's modulus at the reference density. Poisson's ratio is 1/3 (plane stress).
    pub young: f64,
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

/// The body of a scene, at rest.
pub fn marcher(
    scene: &Setting,
    params: &BondBasedParams,
    inputs: &Inputs,
) -> Result<Marcher<BondBased>> {
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
    };
    if !scene.load.is_empty() {
        return Err(Error::setting(
            "load",
            "bond-based scenes are driven by displacements",
            "obtain displacements from the same scene under [physics.continuum], and prescribe them with [[hold]]",
        ));
    }
    let body = Body::new(material.clone(), conditions)?;
    let shares = body.shares();
    let areas = match &shares {
        Some(shares) => shares[..body.material].to_vec(),
        None => vec![1.0; body.material],
    };
    let probes = Probes::new(&scene.probe, &material, areas)?;
    let substance = Material {
        micromodulus: params.micromodulus.value(params.young, &stencil)?,
        young: params.young,
        weight: Weight {
            reference: params.density.reference,
            exponent: params.density.exponent,
        },
        growth,
    };
    let model = BondBased::new(&body.points, body.material, stencil, substance, shares);
    let horizon = model.family.stencil.horizon;
    Marcher::new(body, model, density, probes, None, &params.solver, horizon)
}

impl Model for BondBased {
    type Step<'a> = Step<'a>;

    fn step<'a>(&'a self, of: Stage<'a>) -> Step<'a> {
        Step {
            model: self,
            map: of.map,
            given: of.given,
            old: of.old,
            dt: of.dt,
        }
    }

    fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        BondBased::pattern_from(self, map, first)
    }

    fn reference(&self) -> f64 {
        self.weight.reference
    }

    fn at_points(&self, own: &[f64]) -> Vec<f64> {
        own.to_vec()
    }

    fn own_after(&self, values: &[f64], old: &[f64], _: f64) -> Vec<f64> {
        values[..old.len()].to_vec()
    }

    fn bonds(&self) -> usize {
        self.family.len() / 2
    }
}

impl Micromodulus {
    fn value(
        self,
        young: f64,
        stencil: &crate::discretisation::plane::family::Stencil,
    ) -> Result<f64> {
        if !(young.is_finite() && young > 0.0) {
            return Err(Error::setting(
                "physics.bond-based.young",
                format!("found {young}"),
                "give a positive modulus",
            ));
        }
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
