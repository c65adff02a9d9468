//! Owns scenes of bonds that resist shear, and of several load cases.

use crate::discretisation::plane::family::{Family, Stencil};
use crate::error::{Error, Result};
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::bond_based::shear::{Micromoduli, ShearBonds, ShearStep};
use crate::physics::growth::Weight;
use crate::scene::remodelling::body::Motion;
use crate::scene::remodelling::bond_based::{
    BondBasedParams, CENTRAL, Case, Micromodulus, Start, require_modulus,
};
use crate::scene::remodelling::marcher::{Marcher, Model, Stage};
use crate::scene::setting::{Inputs, Setting};

/// Poisson's ratios this near to 1/3 are 1/3: no shear resistance is left, and points would turn freely.
const NEAR: f64 = 1e-9;

impl BondBasedParams {
    /// Whether bonds resist shear.
    fn shears(&self) -> bool {
        self.poisson < CENTRAL - NEAR
    }

    /// Whether the scene needs more than bonds under stretch in one load case.
    pub fn is_extended(&self) -> bool {
        let off = (self.poisson - CENTRAL).abs();
        !self.cases.is_empty() || off.is_nan() || off > NEAR
    }

    fn micromoduli(&self, stencil: &Stencil) -> Result<Micromoduli> {
        let key = |name: &str| format!("physics.bond-based.{name}");
        require_modulus(self.young)?;
        if !(-0.99..=CENTRAL + NEAR).contains(&self.poisson) {
            return Err(Error::setting(
                key("poisson"),
                format!("found {}", self.poisson),
                "give a Poisson's ratio from -0.99 to 1/3 (plane stress): above 1/3 bonds would have to push where they are sheared, and \
                 the body is not stable; [physics.continuum] takes -0.99 to 0.99",
            ));
        }
        match self.micromodulus {
            Micromodulus::Discrete => Ok(Micromoduli::discrete(self.young, self.poisson, stencil)),
            Micromodulus::Continuous => {
                Ok(Micromoduli::continuous(self.young, self.poisson, stencil))
            }
            Micromodulus::Finite(e) => Err(Error::setting(
                key("micromodulus.finite"),
                format!(
                    "found {e} together with poisson or cases, for which no fit at finite strain is known"
                ),
                "take \"discrete\" or \"continuous\"",
            )),
        }
    }
}

/// The weight of each case, their sum 1.
fn weights(cases: &[Case]) -> Result<Vec<f64>> {
    for (k, case) in cases.iter().enumerate() {
        let key = |name: &str| format!("physics.bond-based.cases[{k}].{name}");
        if !(case.weight.is_finite() && case.weight > 0.0) {
            let found = format!("found {}", case.weight);
            let advice = "give its cycles or its share of them, above 0";
            return Err(Error::setting(key("weight"), found, advice));
        }
        if case.name.is_empty() || cases[..k].iter().any(|c| c.name == case.name) {
            let found = format!("found \"{}\"", case.name);
            return Err(Error::setting(
                key("name"),
                found,
                "give each case a name of its own",
            ));
        }
    }
    let sum: f64 = cases.iter().map(|c| c.weight).sum();
    Ok(match cases {
        [] => vec![1.0],
        _ => cases.iter().map(|c| c.weight / sum).collect(),
    })
}

/// # Errors
/// A case without loads: it would only take from the stimulus, and silently so where its name was meant for another.
fn require_loads(scene: &Setting, cases: &[Case]) -> Result<()> {
    let bare = |case: &&Case| {
        let own = |name: &Option<String>| name.as_ref().is_none_or(|n| *n == case.name);
        !scene.load.iter().any(|l| own(&l.case))
    };
    match cases.iter().find(bare) {
        None => Ok(()),
        Some(case) => Err(Error::setting(
            "physics.bond-based.cases",
            format!("no [[load]] belongs to case \"{}\"", case.name),
            "give a load with this case, or leave the case out",
        )),
    }
}

/// The body of a scene, at rest.
pub fn marcher(
    scene: &Setting,
    params: &BondBasedParams,
    inputs: &Inputs,
) -> Result<Marcher<ShearBonds>> {
    let cases = weights(&params.cases)?;
    require_loads(scene, &params.cases)?;
    let motion = Motion {
        cases: cases.len(),
        turns: params.shears(),
    };
    let start = Start::new(scene, params, inputs, motion)?;
    let (body, stencil) = (start.body, start.stencil);
    let horizon = stencil.horizon;
    let model = ShearBonds {
        micromoduli: params.micromoduli(&stencil)?,
        family: Family::new(&body.points, body.material, stencil),
        young: params.young,
        weight: start.weight,
        growth: start.growth,
        shares: start.shares,
        points: body.points.len(),
        cases,
        turns: motion.turns,
    };
    let (density, probes, loads) = (start.density, start.probes, start.loads);
    Marcher::new(body, model, density, probes, loads, &params.solver, horizon)
}

impl Model for ShearBonds {
    type Step<'a> = ShearStep<'a>;

    fn step<'a>(&'a self, of: Stage<'a>) -> ShearStep<'a> {
        of.of_bonds(self)
    }

    fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse {
        ShearBonds::pattern_from(self, map, first)
    }

    fn weight(&self) -> &Weight {
        &self.weight
    }

    fn bonds(&self) -> usize {
        self.family.len() / 2
    }
}
