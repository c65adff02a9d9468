//! Owns what a continuum-molecular scene must be before anything is solved: `--dry-run` and a run refuse the same.

mod components;
mod numbers;
mod unused;

use super::conduction::CONDUCTED;
use super::setup::Setup;
use super::solid::{DISPLACEMENT, Solid};
use super::steady::loads;
use super::{Conduction, Elasticity, Molecular, Problem, fracture};
use crate::error::{Error, Result};
use crate::scene::setting::{Inputs, Setting};

/// # Errors
/// Whatever a run would refuse before its first solution.
pub fn check(scene: &Setting, model: &Molecular, inputs: &Inputs) -> Result<()> {
    numbers::check(scene, model)?;
    unused::check(scene, model)?;
    if let Some(time) = &scene.time {
        time.steps()?;
    }
    let setup = Setup::new(scene, model, inputs)?;
    match &model.sweep {
        None => one(scene, model, &setup, inputs),
        Some(sweep) => {
            let models = sweep.models(model)?;
            models
                .iter()
                .try_for_each(|m| one(scene, m, &setup, inputs))
        }
    }
}

/// Checks one value of what is swept.
fn one(scene: &Setting, model: &Molecular, setup: &Setup, inputs: &Inputs) -> Result<()> {
    let turns = match model.problem.elasticity() {
        None => false,
        Some(e) => e.turns(&setup.micromoduli(e, &e.tensor(inputs)?)?),
    };
    components::check(scene, model, turns)?;
    maps(scene, model, turns)?;
    if let Some(conduction) = model.problem.conduction() {
        conducting(scene, model, conduction, setup)?;
    }
    match model.problem.elasticity() {
        None => Ok(()),
        Some(e) if turns => elastic::<3>(scene, model, e, setup, inputs),
        Some(e) => elastic::<2>(scene, model, e, setup, inputs),
    }
}

fn elastic<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    elasticity: &Elasticity,
    setup: &Setup,
    inputs: &Inputs,
) -> Result<()> {
    let tensor = elasticity.tensor(inputs)?;
    let solid = Solid::<D>::new(scene, model, elasticity, &tensor, setup)?;
    match &model.problem {
        Problem::Fracture {
            fracture: params, ..
        } => fracture::start::check(scene, model, params, &solid, setup),
        _ => {
            let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
            loads(scene, model, setup, names, 1.0).map(|_| ())
        }
    }
}

fn conducting(
    scene: &Setting,
    model: &Molecular,
    conduction: &Conduction,
    setup: &Setup,
) -> Result<()> {
    setup.conductor(model, conduction)?;
    let held = setup.held(scene, model, CONDUCTED, 0.0, None)?;
    loads(scene, model, setup, CONDUCTED, 0.0)?;
    let steady = !matches!(model.problem, Problem::Transient(_));
    if steady && held.iter().all(Option::is_none) {
        return Err(Error::setting(
            "hold",
            "nothing holds the temperature or potential of a steady scene",
            "add [[hold]] with component = \"temperature\" (or \"potential\"), or a known polynomial",
        ));
    }
    Ok(())
}

/// Names of the scalar fields that a scene writes, the first of them drawn by default.
fn scalars(model: &Molecular, turns: bool) -> Vec<&'static str> {
    match &model.problem {
        Problem::Steady(_) | Problem::Transient(_) => vec!["temperature"],
        Problem::Fracture {
            conduction: None, ..
        } => vec!["damage"],
        Problem::Fracture { .. } => vec!["damage", "potential"],
        Problem::Vibration { .. } => vec!["magnitude"],
        Problem::Static { .. } if turns => {
            vec!["rotation", "energy", "stress_xx", "stress_yy", "stress_xy"]
        }
        Problem::Static { .. } => vec!["energy", "stress_xx", "stress_yy", "stress_xy"],
    }
}

/// # Errors
/// A map of a field that the scene does not write.
fn maps(scene: &Setting, model: &Molecular, turns: bool) -> Result<()> {
    let there = scalars(model, turns);
    let missing = |m: &&String| !there.contains(&m.as_str());
    match scene.output.maps.iter().find(missing) {
        None => Ok(()),
        Some(wrong) => Err(Error::setting(
            "output.maps",
            format!("found \"{wrong}\""),
            format!("this scene has {}", there.join(", ")),
        )),
    }
}
