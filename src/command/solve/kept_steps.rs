//! Owns load steps on disk: a solve that was stopped goes on after the last step that it finished, to the same last digit.

use crate::error::Result;
use crate::machine::session::Session;
use crate::physics::hex8::plastic::State as ElementState;
use crate::physics::plasticity::Point;
use crate::pipeline::apparent::discretisation::steps::{History, Step};
use crate::pipeline::apparent::discretisation::yielded::Kept;
use crate::record::state::{self, StateFile};
use crate::scene::state::State;
use std::path::{Path, PathBuf};

/// Goes when the solve is done.
const FILE: &str = "load-steps.bin";

/// Numbers of a step, an element and a point as they are kept.
const OF_STEP: usize = 10;
const OF_POINT: usize = 7;
const OF_ELEMENT: usize = 1 + 8 * OF_POINT;

/// Steps of one solve in a scan's folder.
pub struct KeptSteps<'a> {
    path: PathBuf,
    fingerprint: String,
    session: &'a Session,
}

impl<'a> KeptSteps<'a> {
    /// `fingerprint` says of which solve.
    pub fn new(dir: &Path, fingerprint: String, session: &'a Session) -> Self {
        KeptSteps {
            path: dir.join(FILE),
            fingerprint,
            session,
        }
    }
}

/// Drops what a finished solve has kept.
pub fn forget(dir: &Path) {
    let _ = std::fs::remove_file(dir.join(FILE));
}

impl Kept for KeptSteps<'_> {
    fn resume(&mut self) -> Option<History> {
        if self.session.force {
            return None;
        }
        let StateFile::State(state) = state::read(&self.path, &self.fingerprint) else {
            return None;
        };
        let history = history(&state)?;
        let steps = history.steps.len();
        self.session.say(format!(
            "note: {steps} load steps were solved before: going on from there"
        ));
        Some(history)
    }

    fn keep(&mut self, history: &History) -> Result<()> {
        self.session.stop.obey();
        state::write(&self.path, &self.fingerprint, &kept(history))
    }
}

/// Steps of a scan in memory: nobody keeps them, but between them a solve may be stopped.
pub struct StepsInMemory<'a>(pub &'a Session);

impl Kept for StepsInMemory<'_> {
    fn resume(&mut self) -> Option<History> {
        None
    }

    fn keep(&mut self, _: &History) -> Result<()> {
        self.0.stop.obey();
        Ok(())
    }
}

fn kept(history: &History) -> State {
    let mut state = State::default();
    state.put("u", history.u.as_flattened());
    state.put("before", history.before.as_flattened());
    state.put("halved", [f64::from(history.halved)]);
    let steps = history.steps.iter().flat_map(|s| {
        [
            s.load,
            s.conjugate_nmm,
            s.work_nmm,
            s.dissipated_nmm,
            s.elastic_nmm,
            s.newton_iterations as f64,
            s.iterations as f64,
            s.evaluations as f64,
            f64::from(s.cuts),
            s.yielded_points as f64,
        ]
    });
    state.put("steps", steps.collect::<Vec<f64>>());
    let mut elements = Vec::with_capacity(OF_ELEMENT * history.states.len());
    for element in &history.states {
        elements.push(f64::from(element.node));
        for point in &element.points {
            elements.extend(point.plastic_strain);
            elements.push(point.hardening);
        }
    }
    state.put("elements", elements);
    state
}

/// None where the numbers are no history.
fn history(state: &State) -> Option<History> {
    let vectors = |name: &str| -> Option<Vec<[f64; 3]>> {
        let (all, rest) = state.find(name)?.as_chunks::<3>();
        rest.is_empty().then(|| all.to_vec())
    };
    let (steps, _) = state.find("steps")?.as_chunks::<OF_STEP>();
    let step = |s: &[f64; OF_STEP]| Step {
        load: s[0],
        conjugate_nmm: s[1],
        work_nmm: s[2],
        dissipated_nmm: s[3],
        elastic_nmm: s[4],
        newton_iterations: s[5] as usize,
        iterations: s[6] as usize,
        evaluations: s[7] as usize,
        cuts: s[8] as u32,
        yielded_points: s[9] as usize,
    };
    let (elements, _) = state.find("elements")?.as_chunks::<OF_ELEMENT>();
    let element = |e: &[f64; OF_ELEMENT]| ElementState {
        node: e[0] as u32,
        points: std::array::from_fn(|p| {
            let own = &e[1 + OF_POINT * p..][..OF_POINT];
            Point {
                plastic_strain: std::array::from_fn(|i| own[i]),
                hardening: own[6],
            }
        }),
    };
    Some(History {
        steps: steps.iter().map(step).collect(),
        states: elements.iter().map(element).collect(),
        u: vectors("u")?,
        before: vectors("before")?,
        halved: *state.find("halved")?.first()? as u32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_comes_back_to_the_bit() {
        let point = |k: usize| Point {
            plastic_strain: std::array::from_fn(|i| 0.1 * (i + k) as f64),
            hardening: 1.0 / (k + 3) as f64,
        };
        let history = History {
            steps: vec![Step {
                load: 0.1 + 0.2,
                iterations: 7,
                cuts: 2,
                yielded_points: 5,
                ..Step::default()
            }],
            states: vec![ElementState {
                node: 4_000_000_000,
                points: std::array::from_fn(point),
            }],
            u: vec![[0.1, -0.3, 1e-300]; 2],
            before: vec![[1.0 / 3.0, 0.0, -0.0]; 2],
            halved: 3,
        };
        assert_eq!(super::history(&kept(&history)), Some(history));
        assert_eq!(super::history(&State::default()), None);
    }
}
