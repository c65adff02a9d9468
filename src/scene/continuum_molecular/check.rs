//! Owns what a continuum-molecular scene must be before anything is solved: `--dry-run` and a run refuse the same. What is set up to
//! find that out is what the solution starts from.

mod components;
mod idle;
mod numbers;
mod unused;

use super::path::CONDUCTED;
use super::setup::{Conductor, Setup};
use super::solid::{DISPLACEMENT, Solid};
use super::steady::difference::DIFFERENCE;
use super::steady::loads;
use super::sweep::Sweep;
use super::{Conduction, Elasticity, Molecular, Problem, Steady, Transient, fracture};
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::tensor::PlaneTensor;
use crate::scene::setting::{Inputs, Setting};

/// A scene that has been checked, with what was set up for that: a run goes on with it.
pub struct Checked<'a> {
    pub(super) scene: &'a Setting,
    pub(super) model: &'a Molecular,
    pub(super) inputs: &'a Inputs,
    pub(super) setup: Setup,
    pub(super) solution: Solution<'a>,
}

/// What is solved on a set-up.
pub(super) enum Solution<'a> {
    One(Box<Bodies<'a>>),
    /// Bodies are built again, value by value: those of all values at a time would fill the memory.
    Sweep(&'a Sweep),
}

/// The bodies of one value of what is swept. Elastic ones may conduct too.
pub enum Bodies<'a> {
    /// Points of two unknowns.
    Straight(Solid<2>, Option<Conductor>),
    /// Points that turn.
    Turning(Solid<3>, Option<Conductor>),
    Steady(&'a Steady, Conductor),
    Transient(&'a Transient, Conductor),
}

impl Bodies<'_> {
    pub fn tensor(&self) -> Option<&PlaneTensor> {
        match self {
            Bodies::Straight(solid, _) => Some(&solid.tensor),
            Bodies::Turning(solid, _) => Some(&solid.tensor),
            Bodies::Steady(..) | Bodies::Transient(..) => None,
        }
    }

    pub fn conductor(&self) -> Option<&Conductor> {
        match self {
            Bodies::Straight(_, conductor) | Bodies::Turning(_, conductor) => conductor.as_ref(),
            Bodies::Steady(_, conductor) | Bodies::Transient(_, conductor) => Some(conductor),
        }
    }
}

/// # Errors
/// Whatever a run would refuse before its first solution.
pub fn check<'a>(
    scene: &'a Setting,
    model: &'a Molecular,
    inputs: &'a Inputs,
) -> Result<Checked<'a>> {
    numbers::check(scene, model)?;
    unused::check(scene, model)?;
    if let Some(time) = &scene.time {
        time.steps()?;
    }
    let setup = Setup::new(scene, model, inputs)?;
    let solution = match &model.sweep {
        None => Solution::One(Box::new(bodies(scene, model, &setup, inputs)?)),
        Some(sweep) => {
            for one in sweep.models(model)? {
                bodies(scene, &one, &setup, inputs)?;
            }
            Solution::Sweep(sweep)
        }
    };
    Ok(Checked {
        scene,
        model,
        inputs,
        setup,
        solution,
    })
}

/// Checks one value of what is swept. Its bodies.
pub fn bodies<'a>(
    scene: &Setting,
    model: &'a Molecular,
    setup: &Setup,
    inputs: &Inputs,
) -> Result<Bodies<'a>> {
    let turns = match model.problem.elasticity() {
        None => false,
        Some(e) => e.turns(&setup.micromoduli(e, &e.tensor(inputs)?)?),
    };
    components::check(scene, model, turns)?;
    maps(scene, model, turns)?;
    let conductor = |conduction| conducting(scene, model, conduction, setup);
    match &model.problem {
        Problem::Steady(steady) => Ok(Bodies::Steady(steady, conductor(&steady.conduction)?)),
        Problem::Transient(transient) => {
            let conductor = conductor(&transient.conduction)?;
            Ok(Bodies::Transient(transient, conductor))
        }
        Problem::Static { elasticity, .. }
        | Problem::Fracture { elasticity, .. }
        | Problem::Vibration { elasticity, .. } => {
            let conductor = model.problem.conduction().map(conductor).transpose()?;
            Ok(match turns {
                true => {
                    Bodies::Turning(elastic(scene, model, elasticity, setup, inputs)?, conductor)
                }
                false => {
                    Bodies::Straight(elastic(scene, model, elasticity, setup, inputs)?, conductor)
                }
            })
        }
    }
}

fn elastic<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    elasticity: &Elasticity,
    setup: &Setup,
    inputs: &Inputs,
) -> Result<Solid<D>> {
    let tensor = elasticity.tensor(inputs)?;
    let solid = Solid::<D>::new(scene, model, elasticity, &tensor, setup)?;
    match &model.problem {
        Problem::Fracture {
            fracture: params, ..
        } => fracture::start::check(scene, model, params, &solid, setup)?,
        _ => {
            let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
            loads(scene, model, setup, names, 1.0)?;
            idle::loads(scene, setup, names, &solid.held)?;
        }
    }
    Ok(solid)
}

fn conducting(
    scene: &Setting,
    model: &Molecular,
    conduction: &Conduction,
    setup: &Setup,
) -> Result<Conductor> {
    let conductor = setup.conductor(model, conduction)?;
    let held = setup.held(scene, model, CONDUCTED, 0.0, None)?;
    loads(scene, model, setup, CONDUCTED, 0.0)?;
    idle::loads(scene, setup, CONDUCTED, &held)?;
    if let Some(probes) = model.problem.probes() {
        idle::probes(setup, probes)?;
    }
    let steady = !matches!(model.problem, Problem::Transient(_));
    if steady && held.iter().all(Option::is_none) {
        return Err(Error::setting(
            "hold",
            "nothing holds the temperature or potential of a steady scene",
            "add [[hold]] with component = \"temperature\" (or \"potential\"), or a known polynomial",
        ));
    }
    Ok(conductor)
}

/// Of static scenes, rotations apart.
const STATIC: [&str; 7] = [
    "energy",
    "stress_xx",
    "stress_yy",
    "stress_xy",
    "section_xx",
    "section_yy",
    "section_xy",
];

/// Names of the scalar fields that a scene writes, the first of them drawn by default.
fn scalars(model: &Molecular, turns: bool) -> Vec<&'static str> {
    let mut names = always(model, turns);
    let compares = matches!(model.problem, Problem::Static { .. } | Problem::Steady(_));
    if compares && model.one_known().is_some() {
        names.push(DIFFERENCE);
    }
    names
}

/// The same without what only a known field brings.
fn always(model: &Molecular, turns: bool) -> Vec<&'static str> {
    match &model.problem {
        Problem::Steady(_) | Problem::Transient(_) => vec!["temperature", "flux_size"],
        Problem::Fracture {
            conduction: None, ..
        } => vec!["damage"],
        Problem::Fracture { .. } => vec!["damage", "potential"],
        Problem::Vibration { .. } => vec!["magnitude"],
        Problem::Static { conduction, .. } => {
            let turned = turns.then_some("rotation");
            let coupled = conduction.as_ref().map(|c| match c.piezoresistance {
                Some(_) => "potential",
                None => "temperature",
            });
            turned.into_iter().chain(STATIC).chain(coupled).collect()
        }
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

#[cfg(test)]
mod tests {
    use crate::discretisation::plane::Points;
    use crate::error::Result;
    use crate::scene::continuum_molecular::setup::SETUPS;
    use crate::scene::frame::{Frame, Observer};
    use crate::scene::setting::Inputs;
    use crate::scene::{Scene, check, run};
    use std::path::Path;

    struct Silent;

    impl Observer for Silent {
        fn start(&mut self, _: &Points, _: usize) -> Result<()> {
            Ok(())
        }
        fn frame(&mut self, _: &Frame) -> Result<()> {
            Ok(())
        }
        fn say(&mut self, _: &str) {}
    }

    fn scene(model: &str) -> Scene {
        let text = format!(
            "title = 'plate'
             geometry.rectangle.size = [8, 6]
             [grid]
             spacing = 1
             horizon_ratio = 3
             [physics.continuum-molecular]
             known = [{{ region = 'all', field = {{ strain = [1, 0, 0] }} }}]
             elasticity = {{ young = 1000, poisson = 0.2 }}
             {model}"
        );
        Scene::parse(&text, Path::new("scene.toml")).unwrap()
    }

    /// A run goes on with what its check has set up, and so does each value of a sweep.
    #[test]
    fn a_scene_is_set_up_once() {
        let swept = "sweep = { parameter = 'angle', values = [0, 30, 60] }";
        for model in ["", swept] {
            let (scene, inputs) = (scene(model), Inputs::default());
            let before = SETUPS.get();
            run(&scene, &inputs, &mut Silent).unwrap();
            assert_eq!(SETUPS.get() - before, 1, "{model}");
            let checked = check(&scene, &inputs).unwrap();
            assert_eq!(checked.points().unwrap().len(), 48);
            assert_eq!(SETUPS.get() - before, 2, "{model}");
        }
    }
}
