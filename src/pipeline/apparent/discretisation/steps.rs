//! Owns the load steps of a body that yields: how they are taken, halved where one fails, and what each came to.

pub mod length;

use crate::operator::SinglePreconditioner;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::physics::hex8::plastic::{Balance, PlasticBricks, State, Tissue};
use crate::pipeline::apparent::discretisation::steps::length::Lengths;
use crate::solver::load_step::{Balanced, Bounds, StepParams, Workspace, balance, work_between};

/// Supports and load. The load grows from 0 to 1.
pub struct Loading<'a> {
    /// Which unknowns are held.
    pub held: &'a Held,
    /// Displacements of the elastic body under the whole load, those of the supports among them.
    pub elastic: &'a [[f64; 3]],
    /// Under the whole load, N.
    pub external: Option<&'a [[f64; 3]]>,
}

/// How the load grows, and how exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// From 0 to the whole load.
    pub lengths: Lengths,
    /// A step is halved so many times at most.
    pub halvings: u32,
    /// How exactly each step is balanced.
    pub params: StepParams,
}

/// The end of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Step {
    /// Share of the whole load, 0 to 1.
    pub load: f64,
    /// Work per unit of the load, N mm: forces along the change of the displacements.
    pub conjugate_nmm: f64,
    /// Since the start.
    pub work_nmm: f64,
    /// By plastic flow since the start.
    pub dissipated_nmm: f64,
    /// Stored now.
    pub elastic_nmm: f64,
    /// Corrections of the displacements in this step.
    pub newton_iterations: usize,
    /// Iterations of conjugate gradients in this step.
    pub iterations: usize,
    /// Looks at the forces, each about as long as an iteration.
    pub evaluations: usize,
    /// Attempts that failed before.
    pub cuts: u32,
    /// Integration points that have ever flowed.
    pub yielded_points: usize,
}

/// Where a body is between two steps: all that a stopped solve resumes from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// The steps so far.
    pub steps: Vec<Step>,
    /// States of the elements that have ever flowed.
    pub states: Vec<State>,
    /// Displacements now and at the step before, mm.
    pub u: Vec<[f64; 3]>,
    /// Displacements at the step before, mm.
    pub before: Vec<[f64; 3]>,
    /// Halvings of the step to come.
    pub halved: u32,
}

/// How steps ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The whole load.
    Done,
    /// No equilibrium was found beyond the last step, however small the next: the body bears no more, or flows faster than its tangent
    /// foresees.
    Stopped {
        /// Length of the last step that was tried, as a share of the load.
        length: f64,
    },
}

impl History {
    /// A body at rest of this many sites.
    pub fn new(sites: usize) -> Self {
        History {
            u: vec![[0.0; 3]; sites],
            before: vec![[0.0; 3]; sites],
            ..History::default()
        }
    }

    fn load(&self) -> f64 {
        self.steps.last().map_or(0.0, |s| s.load)
    }

    /// The load before the last step.
    fn load_before(&self) -> f64 {
        match self.steps.len() {
            0 | 1 => 0.0,
            n => self.steps[n - 2].load,
        }
    }

    /// The last increment carried on; of a body at rest its elastic response.
    fn guess(&self, loading: &Loading, load: f64) -> Vec<[f64; 3]> {
        let share = (load - self.load()) / (self.load() - self.load_before());
        let at = |i: usize, a: usize| match self.steps.is_empty() {
            true => load * loading.elastic[i][a],
            false => match loading.held.is_held(i, a) {
                true => load * loading.elastic[i][a],
                false => self.u[i][a] + share * (self.u[i][a] - self.before[i][a]),
            },
        };
        (0..self.u.len())
            .map(|i| std::array::from_fn(|a| at(i, a)))
            .collect()
    }
}

/// Loads a body step by step from where `history` left it; `each` sees every new step, and stops where it is false.
pub fn load<E: Coarsen, T: Fn(usize) -> Tissue + Sync>(
    body: PlasticBricks<'_, E, T>,
    loading: &Loading,
    preconditioner: &impl SinglePreconditioner<3>,
    how: &Stepping,
    history: &mut History,
    mut each: impl FnMut(&History) -> bool,
) -> Outcome {
    let mut body = body.with_states(std::mem::take(&mut history.states));
    let mut work = Workspace::new(history.u.len());
    let mut cuts = 0;
    let mut ended = Outcome::Done;
    let onset = match how.lengths {
        Lengths::Even(_) => None,
        Lengths::Adaptive(_) => Some(body.onset(loading.elastic)),
    };
    while history.load() < 1.0 {
        let whole = how.lengths.next(&history.steps, onset.as_ref());
        let length = whole * 0.5f64.powi(history.halved as i32);
        // Sums of steps fall short of 1 by rounding.
        let load = match history.load() + length {
            load if load > 1.0 - 1e-9 => 1.0,
            load => load,
        };
        let mut u = history.guess(loading, load);
        let outside: Option<Vec<[f64; 3]>> = loading
            .external
            .map(|f| f.iter().map(|f| f.map(|v| load * v)).collect());
        let found = balance(
            &mut body,
            &Bounds {
                held: loading.held,
                external: outside.as_deref(),
                from: &history.u,
            },
            preconditioner,
            &mut u,
            &how.params,
            &mut work,
        );
        let Ok(found) = found else {
            if history.halved >= how.halvings {
                ended = Outcome::Stopped { length };
                break;
            }
            history.halved += 1;
            cuts += 1;
            continue;
        };
        let balance = body.accept(&history.u, &u, &work.forces);
        let step = Step {
            yielded_points: yielded_points(body.states()),
            ..step(
                (history, loading),
                load,
                &u,
                &work.forces,
                (balance, found, cuts),
            )
        };
        history.steps.push(step);
        history.before = std::mem::replace(&mut history.u, u);
        if cuts == 0 {
            history.halved = history.halved.saturating_sub(1);
        }
        cuts = 0;
        history.states = body.states().to_vec();
        if !each(history) {
            break;
        }
    }
    history.states = body.states().to_vec();
    ended
}

fn step(
    (history, loading): (&History, &Loading),
    load: f64,
    u: &[[f64; 3]],
    forces: &[[f64; 3]],
    (balance, found, cuts): (Balance, Balanced, u32),
) -> Step {
    let earlier = history.steps.last().copied().unwrap_or_default();
    let length = load - earlier.load;
    let conjugate_nmm = work_between(forces, &history.u, u) / length;
    // The mean of the forces at both ends of the step; displacements of the supports are in proportion to the load, those that
    // external forces move are not.
    let work_nmm = match loading.external {
        None => 0.5 * (earlier.conjugate_nmm + conjugate_nmm) * length,
        Some(outside) => 0.5 * (earlier.load + load) * work_between(outside, &history.u, u),
    };
    Step {
        load,
        conjugate_nmm,
        work_nmm: earlier.work_nmm + work_nmm,
        dissipated_nmm: earlier.dissipated_nmm + balance.dissipated_nmm,
        elastic_nmm: balance.elastic_nmm,
        newton_iterations: found.newton_iterations,
        iterations: found.cg_iterations,
        evaluations: found.evaluations,
        cuts,
        yielded_points: 0,
    }
}

fn yielded_points(states: &[State]) -> usize {
    let points = states.iter().flat_map(|state| &state.points);
    points.filter(|point| point.hardening > 0.0).count()
}
