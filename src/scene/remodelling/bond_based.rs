//! Owns scenes of bond-based peridynamics, with or without growth.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use crate::physics::bond_based::{
    BondBased, Material, Step, micromodulus_continuous, micromodulus_discrete,
};
use crate::physics::growth::Weight;
use crate::scene::frame::{Frame, Observer, Summary};
use crate::scene::remodelling::body::{Body, Conditions, NUDGE, nudge, rate_of};
use crate::scene::remodelling::density::{DensityParams, GrowthParams, Probes};
use crate::scene::remodelling::solver::{Equilibrium, FactorOrigin, SolverParams};
use crate::scene::remodelling::time_loop;
use crate::scene::remodelling::time_loop::{Advance, Marching, run_time_loop};
use crate::scene::setting::{Inputs, Setting};
use crate::scene::state::State;
use crate::solver::newton::NotConverged;
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

/// The model that [`run`] starts from.
///
/// # Errors
/// What a run would refuse before its first step.
pub fn check(scene: &Setting, params: &BondBasedParams, inputs: &Inputs) -> Result<Peridynamic> {
    let model = Peridynamic::new(scene, params, inputs)?;
    time_loop::check(scene.marching_time()?)?;
    Ok(model)
}

/// Runs the scene, of these material points.
pub fn run(
    mut model: Peridynamic,
    scene: &Setting,
    points: &Points,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let time = scene.marching_time()?;
    let mut summary = model.summary();
    observer.start(points, (time.end / time.step).round() as usize)?;
    run_time_loop(&mut model, time, &scene.output, observer, &mut summary)?;
    Ok(summary)
}

/// A body of bonds on its way through time.
pub struct Peridynamic {
    body: Body,
    model: BondBased,
    solver: Equilibrium,
    probes: Probes,
    reference: f64,
    /// Unknowns now, and how far they moved in the step before (per unit of time).
    q: Vec<f64>,
    rate: Option<Vec<f64>>,
    /// Whether a step has been taken: before, supports are where the body is.
    started: bool,
    values: Vec<f64>,
    /// Of the solver's factor.
    factor_origin: Option<FactorOrigin>,
}

impl Peridynamic {
    fn new(scene: &Setting, params: &BondBasedParams, inputs: &Inputs) -> Result<Self> {
        let stencil = scene.stencil()?;
        let material = scene.points(inputs)?;
        let growth = params
            .growth
            .as_ref()
            .map(|g| g.checked(&params.density))
            .transpose()?;
        let conditions = Conditions {
            layers: scene.layers.as_ref(),
            reach: stencil.reach() as usize,
            holds: &scene.hold,
            density: params.density.initial(&material, inputs)?,
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
        let probes = match &shares {
            Some(shares) => {
                Probes::weighted(&scene.probe, &material, shares[..body.material].to_vec())?
            }
            None => Probes::new(&scene.probe, &material)?,
        };
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
        let local = body.map.unknowns_before(body.points.len());
        let positions = body.unknown_positions(local);
        let solver = Equilibrium::new(
            &params.solver,
            || model.pattern(&body.map),
            || model.pattern_from(&body.map, local),
            &positions,
            model.family.stencil.horizon,
        )?;
        let q = body.start();
        let mut values = vec![0.0; body.map.values()];
        body.map.expand(&q, &body.given(0.0), &mut values);
        Ok(Peridynamic {
            body,
            model,
            solver,
            probes,
            reference: params.density.reference,
            q,
            rate: None,
            started: false,
            values,
            factor_origin: None,
        })
    }

    fn summary(&self) -> Summary {
        Summary {
            points: self.body.material,
            unknowns: self.body.map.unknowns(),
            bonds: self.model.family.len() / 2,
            ..Summary::default()
        }
    }
}

impl Marching for Peridynamic {
    fn advance(&mut self, before: f64, now: f64) -> std::result::Result<Advance, NotConverged> {
        let given = self.body.given(now);
        let held = match self.started {
            true => self.body.given(before),
            false => self.body.at_rest(),
        };
        let old = &self.values[..self.body.material];
        let nudged = nudge(&held, &given);
        let factor_origin = |given: &[f64]| FactorOrigin {
            given: given.to_vec(),
            dt: now - before,
            old: old.to_vec(),
        };
        let step = |given| Step {
            model: &self.model,
            map: &self.body.map,
            given,
            old,
            dt: now - before,
        };
        let mut q = self.q.clone();
        let moved = given != held;
        let from = self.started.then_some(before);
        if moved && !self.body.stretch(&mut q, from, now) {
            let (from, to) = (step(&held), step(&nudged));
            if self.solver.predict(&from, &to, NUDGE, &mut q)? {
                self.factor_origin = Some(factor_origin(&held));
            }
        }
        let rate = self
            .rate
            .as_deref()
            .filter(|_| !moved)
            .map(|r| (r, now - before));
        let whole = || self.model.pattern(&self.body.map);
        let advance = self.solver.solve(&step(&given), &mut q, rate, whole)?;
        if advance.factorisations > 0 {
            self.factor_origin = Some(factor_origin(&given));
        }
        // What a change of the supports moved does not go on.
        self.rate = (!moved).then(|| rate_of(&self.q, &q, now - before));
        self.started = true;
        self.q = q;
        self.body.map.expand(&self.q, &given, &mut self.values);
        Ok(advance)
    }

    fn corners(&self) -> Vec<f64> {
        self.body.corners()
    }

    fn densities(&self) -> Vec<f64> {
        let relative = |rho: &f64| (rho - self.reference) / self.reference;
        let densities = &self.values[..self.body.material];
        densities.iter().map(relative).collect()
    }

    fn frame(&self, t: f64, with_fields: bool) -> Frame {
        let change = self.densities();
        self.probes
            .frame(t, &self.body, &self.values, change, with_fields)
    }

    fn save(&self, state: &mut State) {
        state.put("q", self.q.as_slice());
        state.put("values", self.values.as_slice());
        if let Some(rate) = &self.rate {
            state.put("rate", rate.as_slice());
        }
        self.solver.save(state);
        self.factor_origin.iter().for_each(|s| s.save(state));
    }

    fn restore(&mut self, state: &State) -> Result<()> {
        let n = self.q.len();
        self.q = state.array("q", n)?.to_vec();
        self.values = state.array("values", self.values.len())?.to_vec();
        self.started = true;
        self.rate = state.find("rate").map(<[f64]>::to_vec);
        self.factor_origin = FactorOrigin::restore(state, self.values.len())?;
        let Some(factor_origin) = &self.factor_origin else {
            return Ok(());
        };
        let step = Step {
            model: &self.model,
            map: &self.body.map,
            given: &factor_origin.given,
            old: &factor_origin.old,
            dt: factor_origin.dt,
        };
        self.solver.restore(&step, state, n)
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
