//! Owns scenes of the local continuum, the twin of bond-based peridynamics.

mod params;

pub use params::{ContinuumParams, DensityAt, EnergyLaw};

use crate::error::{Error, Result};
use crate::physics::continuum::{Continuum, Old, Step};
use crate::physics::growth::Weight;
use crate::scene::frame::{Frame, Observer, Summary};
use crate::scene::remodelling::body::{Body, Conditions, NUDGE, nudge, rate_of};
use crate::scene::remodelling::density::Probes;
use crate::scene::remodelling::loads::Loads;
use crate::scene::remodelling::solver::{Equilibrium, FactorOrigin};
use crate::scene::remodelling::time_loop;
use crate::scene::remodelling::time_loop::{Advance, Marching, run_time_loop};
use crate::scene::setting::{Inputs, Setting};
use crate::scene::state::State;
use crate::solver::newton::NotConverged;

/// The model that [`run`] starts from.
///
/// # Errors
/// What a run would refuse before its first step.
pub fn check(scene: &Setting, params: &ContinuumParams, inputs: &Inputs) -> Result<Local> {
    let model = Local::new(scene, params, inputs)?;
    time_loop::check(scene.marching_time()?)?;
    Ok(model)
}

/// Runs the scene.
pub fn run(mut model: Local, scene: &Setting, observer: &mut dyn Observer) -> Result<Summary> {
    let time = scene.marching_time()?;
    let mut summary = Summary {
        points: model.body.material,
        unknowns: model.body.map.unknowns(),
        ..Summary::default()
    };
    observer.start(&model.body.points, (time.end / time.step).round() as usize)?;
    run_time_loop(&mut model, time, &scene.output, observer, &mut summary)?;
    Ok(summary)
}

/// A body of elements on its way through time.
pub struct Local {
    body: Body,
    model: Continuum,
    solver: Equilibrium,
    probes: Probes,
    loads: Loads,
    /// Unknowns now, and how far they moved in the step before (per unit of time).
    q: Vec<f64>,
    rate: Option<Vec<f64>>,
    /// Whether a step has been taken: before, supports are where the body is.
    started: bool,
    values: Vec<f64>,
    old: Old,
    /// Of the solver's factor.
    factor_origin: Option<FactorOrigin>,
}

impl Local {
    fn new(scene: &Setting, params: &ContinuumParams, inputs: &Inputs) -> Result<Self> {
        if scene.layers.is_some() {
            return Err(Error::setting(
                "layers",
                "a continuum has no fictitious layers",
                "prescribe its edges with [[hold]] (a rectangle with nodal = true has points on them)",
            ));
        }
        let material = scene.points(inputs)?;
        let growth = params
            .growth
            .as_ref()
            .map(|g| g.checked(&params.density))
            .transpose()?;
        let density = params.density.initial(&material, inputs)?;
        let weight = Weight {
            reference: params.density.reference,
            exponent: params.density.exponent,
        };
        let model = Continuum::new(&material, params.young, params.law(scene)?, weight, growth);
        require_elements(&model)?;
        let areas: Vec<f64> = (0..model.nodes).map(|p| model.area(p)).collect();
        let probes = Probes::weighted(&scene.probe, &material, areas)?;
        let at_nodes = params.density_at == DensityAt::Nodes;
        let conditions = Conditions {
            layers: None,
            reach: 0,
            holds: &scene.hold,
            density: density.clone(),
            reference_density: params.density.reference,
            grows: growth.is_some() && at_nodes,
        };
        let body = Body::new(material, conditions)?;
        let old = match params.density_at {
            DensityAt::Nodes => Old::Nodes(density),
            DensityAt::Gauss => {
                let mean = |c: &[u32; 4]| c.iter().map(|&p| density[p as usize]).sum::<f64>() / 4.0;
                Old::Gauss(model.elements.iter().map(|c| [mean(c); 4]).collect())
            }
        };
        let local = body.map.unknowns_before(model.nodes);
        let solver = Equilibrium::new(
            &params.solver,
            || model.pattern_from(&body.map, 0),
            || model.pattern_from(&body.map, local),
            &body.unknown_positions(local),
            model.spacing,
        )?;
        let loads = Loads::new(scene, &body)?;
        let q = body.start();
        let mut values = vec![0.0; body.map.values()];
        body.map.expand(&q, &body.given(0.0), &mut values);
        Ok(Local {
            body,
            model,
            solver,
            probes,
            loads,
            q,
            rate: None,
            started: false,
            values,
            old,
            factor_origin: None,
        })
    }

    /// Densities at the nodes: of Gauss densities, the mean of the nearest in each element around.
    fn at_nodes(&self) -> Vec<f64> {
        // Gauss point nearest to each corner: they are numbered along x first, corners go round.
        const NEAREST: [usize; 4] = [0, 1, 3, 2];
        match &self.old {
            Old::Nodes(_) => self.values[..self.model.nodes].to_vec(),
            Old::Gauss(gauss) => (0..self.model.nodes)
                .map(|p| {
                    let around = self.model.around(p);
                    let sum: f64 = around
                        .iter()
                        .map(|&(e, c)| gauss[e as usize][NEAREST[c as usize]])
                        .sum();
                    sum / around.len() as f64
                })
                .collect(),
        }
    }
}

fn require_elements(model: &Continuum) -> Result<()> {
    let bare = (0..model.nodes)
        .filter(|&p| model.around(p).is_empty())
        .count();
    if bare == 0 {
        return Ok(());
    }
    Err(Error::specimen(
        format!("{bare} points of the geometry belong to no square of four neighbouring points"),
        "smooth or thicken the outline by at least one grid.spacing, or set grid.prune = true to drop them",
    ))
}

impl Marching for Local {
    fn advance(&mut self, before: f64, now: f64) -> std::result::Result<Advance, NotConverged> {
        let given = self.body.given(now);
        let held = match self.started {
            true => self.body.given(before),
            false => self.body.at_rest(),
        };
        let load = self.loads.at(now, given.len());
        let loads_move = !self.started || load != self.loads.at(before, given.len());
        let nudged = nudge(&held, &given);
        let factor_origin = |given: &[f64]| FactorOrigin {
            given: given.to_vec(),
            dt: now - before,
            old: self.old.flat().to_vec(),
        };
        let step = |given| Step {
            model: &self.model,
            map: &self.body.map,
            given,
            old: &self.old,
            dt: now - before,
            load: &load,
        };
        let mut q = self.q.clone();
        let moved = given != held;
        if moved {
            let (from, to) = (step(&held), step(&nudged));
            if self.solver.predict(&from, &to, NUDGE, &mut q)? {
                self.factor_origin = Some(factor_origin(&held));
            }
        }
        let steady = !moved && !loads_move;
        let rate = self
            .rate
            .as_deref()
            .filter(|_| steady)
            .map(|r| (r, now - before));
        let whole = || self.model.pattern_from(&self.body.map, 0);
        let advance = self.solver.solve(&step(&given), &mut q, rate, whole)?;
        if advance.factorisations > 0 {
            self.factor_origin = Some(factor_origin(&given));
        }
        // What a change of supports or loads moved does not go on.
        self.rate = steady.then(|| rate_of(&self.q, &q, now - before));
        self.started = true;
        self.q = q;
        self.body.map.expand(&self.q, &given, &mut self.values);
        self.old = match &self.old {
            Old::Nodes(_) => Old::Nodes(self.values[..self.model.nodes].to_vec()),
            Old::Gauss(gauss) => Old::Gauss(self.model.gauss_densities(
                &self.values,
                gauss,
                now - before,
            )),
        };
        Ok(advance)
    }

    fn corners(&self) -> Vec<f64> {
        let held = self.body.corners().into_iter();
        held.chain(self.loads.corners()).collect()
    }

    fn densities(&self) -> Vec<f64> {
        let reference = self.model.weight.reference;
        self.at_nodes()
            .iter()
            .map(|rho| (rho - reference) / reference)
            .collect()
    }

    fn frame(&self, t: f64, with_fields: bool) -> Frame {
        let change = self.densities();
        self.probes
            .frame(t, &self.body, &self.values, change, with_fields)
    }

    fn save(&self, state: &mut State) {
        state.put("q", self.q.as_slice());
        state.put("values", self.values.as_slice());
        state.put("old", self.old.flat());
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
        self.old = self.old.like(state.array("old", self.old.flat().len())?);
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
            old: &self.old.like(&factor_origin.old),
            dt: factor_origin.dt,
            load: &[],
        };
        self.solver.restore(&step, state, n)
    }
}
