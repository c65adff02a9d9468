//! Owns a remodelling body on its way through time: its state, and how a step takes it to the next.

use crate::error::Result;
use crate::operator::nonlinear::Staggered;
use crate::operator::reduction::Reduction;
use crate::operator::sparse::Sparse;
use crate::physics::bond_based::Step;
use crate::physics::growth::Weight;
use crate::scene::frame::{Frame, Summary};
use crate::scene::remodelling::body::{Body, NUDGE, nudge, rate_of};
use crate::scene::remodelling::density::Probes;
use crate::scene::remodelling::loads::Loads;
use crate::scene::remodelling::solver::{Advance, Equilibrium, FactorOrigin, SolverParams};
use crate::scene::state::State;
use crate::solver::newton::NotConverged;

/// What bonds and elements differ in.
pub trait Model {
    /// The equations of a step.
    type Step<'a>: Staggered
    where
        Self: 'a;

    fn step<'a>(&'a self, of: Stage<'a>) -> Self::Step<'a>;

    /// Entries of `∂R/∂q` among the unknowns from `first` on, numbered from there.
    fn pattern_from(&self, map: &Reduction, first: usize) -> Sparse;

    /// How energy depends on density.
    fn weight(&self) -> &Weight;

    /// Densities at the material points, where `own` are the model's. By default they are those.
    fn at_points(&self, own: &[f64]) -> Vec<f64> {
        own.to_vec()
    }

    /// The model's own densities after a step of `dt` from `old` to `values`. By default they come first among the values.
    fn own_after(&self, values: &[f64], old: &[f64], _dt: f64) -> Vec<f64> {
        values[..old.len()].to_vec()
    }

    /// Bonds, each counted once.
    fn bonds(&self) -> usize {
        0
    }
}

/// What a step's equations are made from.
pub struct Stage<'a> {
    pub map: &'a Reduction,
    pub given: &'a [f64],
    /// The model's own densities before the step.
    pub old: &'a [f64],
    pub dt: f64,
    /// Force on each value; empty: none.
    pub load: &'a [f64],
}

impl<'a> Stage<'a> {
    /// The equations of a model of bonds.
    pub fn of_bonds<M>(self, model: &'a M) -> Step<'a, M> {
        Step {
            model,
            map: self.map,
            given: self.given,
            old: self.old,
            dt: self.dt,
            load: self.load,
        }
    }
}

/// A body and its state.
pub struct Marcher<M> {
    body: Body,
    model: M,
    solver: Equilibrium,
    probes: Probes,
    /// None for a model that bears none.
    loads: Option<Loads>,
    /// Unknowns now, and how far they moved in the step before (per unit of time).
    q: Vec<f64>,
    rate: Option<Vec<f64>>,
    /// Whether a step has been taken: before, supports are where the body is.
    started: bool,
    values: Vec<f64>,
    /// The model's own densities.
    own: Vec<f64>,
    /// Of the solver's factor.
    factor_origin: Option<FactorOrigin>,
}

impl<M: Model> Marcher<M> {
    /// `own` are the model's densities at the start; `reach` is how far its equations reach.
    pub fn new(
        body: Body,
        model: M,
        own: Vec<f64>,
        probes: Probes,
        loads: Option<Loads>,
        solver: &SolverParams,
        reach: f64,
    ) -> Result<Self> {
        let local = body.map.unknowns_before(body.points.len());
        let solver = Equilibrium::new(
            solver,
            || model.pattern_from(&body.map, 0),
            || model.pattern_from(&body.map, local),
            &body.unknown_positions(local),
            reach,
        )?;
        let q = body.start();
        let mut values = vec![0.0; body.map.values()];
        body.map.expand(&q, &body.given(0.0), &mut values);
        Ok(Marcher {
            body,
            model,
            solver,
            probes,
            loads,
            q,
            rate: None,
            started: false,
            values,
            own,
            factor_origin: None,
        })
    }

    /// What is known before the first step.
    pub fn summary(&self) -> Summary {
        Summary {
            points: self.body.material,
            unknowns: self.body.map.unknowns(),
            bonds: self.model.bonds(),
            ..Summary::default()
        }
    }

    /// Solves one step. On failure the state stays as it was.
    pub fn advance(&mut self, before: f64, now: f64) -> std::result::Result<Advance, NotConverged> {
        let dt = now - before;
        let given = self.body.given(now);
        let held = match self.started {
            true => self.body.given(before),
            false => self.body.at_rest(),
        };
        let load_at = |t: f64| {
            let loads = self.loads.as_ref();
            loads.map_or_else(Vec::new, |loads| loads.at(t, given.len()))
        };
        let load = load_at(now);
        let loads_move = self.loads.is_some() && (!self.started || load != load_at(before));
        let nudged = nudge(&held, &given);
        let factor_origin = |given: &[f64]| FactorOrigin {
            given: given.to_vec(),
            dt,
            old: self.own.clone(),
        };
        let step = |given| {
            self.model.step(Stage {
                map: &self.body.map,
                given,
                old: &self.own,
                dt,
                load: &load,
            })
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
        let steady = !moved && !loads_move;
        let rate = self.rate.as_deref().filter(|_| steady).map(|r| (r, dt));
        let whole = || self.model.pattern_from(&self.body.map, 0);
        let advance = self.solver.solve(&step(&given), &mut q, rate, whole)?;
        if advance.factorisations > 0 {
            self.factor_origin = Some(factor_origin(&given));
        }
        // What a change of supports or loads moved does not go on.
        self.rate = steady.then(|| rate_of(&self.q, &q, dt));
        self.started = true;
        self.q = q;
        self.body.map.expand(&self.q, &given, &mut self.values);
        self.own = self.model.own_after(&self.values, &self.own, dt);
        Ok(advance)
    }

    /// Times at which supports or loads jump or bend.
    pub fn corners(&self) -> Vec<f64> {
        let loads = self.loads.iter().flat_map(Loads::corners);
        self.body.corners().into_iter().chain(loads).collect()
    }

    /// Relative densities, as far as they change.
    pub fn densities(&self) -> Vec<f64> {
        let reference = self.model.weight().reference;
        let relative = |rho: f64| (rho - reference) / reference;
        let densities = self.model.at_points(&self.own);
        densities.into_iter().map(relative).collect()
    }

    /// The current state at time `t`.
    pub fn frame(&self, t: f64, with_fields: bool) -> Frame {
        let change = self.densities();
        self.probes
            .frame(t, &self.body, &self.values, change, with_fields)
    }

    /// Everything that later steps depend on.
    pub fn save(&self, state: &mut State) {
        state.put("q", self.q.as_slice());
        state.put("values", self.values.as_slice());
        state.put("old", self.own.as_slice());
        if let Some(rate) = &self.rate {
            state.put("rate", rate.as_slice());
        }
        self.solver.save(state);
        self.factor_origin.iter().for_each(|s| s.save(state));
    }

    /// Goes back to a saved state: what follows is what would have followed it.
    pub fn restore(&mut self, state: &State) -> Result<()> {
        let n = self.q.len();
        self.q = state.array("q", n)?.to_vec();
        self.values = state.array("values", self.values.len())?.to_vec();
        self.own = state.array("old", self.own.len())?.to_vec();
        self.started = true;
        self.rate = state.find("rate").map(<[f64]>::to_vec);
        self.factor_origin = FactorOrigin::restore(state, self.values.len())?;
        let Some(origin) = &self.factor_origin else {
            return Ok(());
        };
        let step = self.model.step(Stage {
            map: &self.body.map,
            given: &origin.given,
            old: &origin.old,
            dt: origin.dt,
            load: &[],
        });
        self.solver.restore(&step, state, n)
    }
}
