//! Owns the refusal of what a scene names but its solution would not use.

use super::sweep::Parameter;
use super::{KnownField, Molecular};
use crate::discretisation::plane::geometry::Geometry;
use crate::error::{Error, Result};
use crate::scene::setting::Setting;

/// A key, where it is without effect, what was found and what to do.
struct Rule(&'static str, bool, &'static str, &'static str);

const MODEL: &str = "physics.continuum-molecular";
const OUT: &str = "leave it out";

/// # Errors
/// Tables and keys that nothing would act on.
pub fn refuse(scene: &Setting, model: &Molecular) -> Result<()> {
    let parts = [tables(model), of_scene(scene, model), of_model(model)];
    let rules = parts.into_iter().flatten();
    match rules.into_iter().find(|Rule(_, unused, ..)| *unused) {
        None => Ok(()),
        Some(Rule(key, _, found, advice)) => {
            Err(Error::setting(key, format!("found {found}"), advice))
        }
    }
}

/// Physics that do not act on each other.
fn tables(model: &Molecular) -> Vec<Rule> {
    let [elastic, conducting] = [model.elasticity.is_some(), model.conduction.is_some()];
    let [breaking, vibrating] = [model.fracture.is_some(), model.vibration.is_some()];
    vec![
        Rule(
            MODEL,
            !elastic && (breaking || vibrating),
            "fracture or vibration without elasticity",
            "add the table of elasticity",
        ),
        Rule(
            MODEL,
            !elastic && !conducting,
            "neither elasticity nor conduction",
            "add the table of at least one",
        ),
        Rule(
            MODEL,
            breaking && vibrating,
            "both fracture and vibration",
            "keep one, or make two scenes",
        ),
        Rule(
            MODEL,
            elastic && conducting && !breaking,
            "elasticity and conduction without fracture, which do not act on each other",
            "make two scenes, or add the table of fracture: broken bonds stop conducting",
        ),
    ]
}

/// What other kinds of scenes have, and time.
fn of_scene(scene: &Setting, model: &Molecular) -> Vec<Rule> {
    let marching = "a setting of scenes of remodelling: here all steps are `step`";
    let nodal = matches!(&scene.geometry, Geometry::Rectangle(r) if r.nodal);
    let time = scene.time.as_ref();
    let capacity = model
        .conduction
        .as_ref()
        .is_some_and(|c| c.capacity.is_some());
    let breaking = model.fracture.is_some();
    vec![
        Rule(
            "layers",
            scene.layers.is_some(),
            "layers of fictitious points",
            OUT,
        ),
        Rule("probe", !scene.probe.is_empty(), "probes of densities", OUT),
        Rule(
            "geometry.rectangle.nodal",
            nodal,
            "points on the edges, where every point stands for a whole cell",
            OUT,
        ),
        Rule(
            "time.tolerance",
            time.is_some_and(|t| t.adapts()),
            marching,
            "leave out tolerance and smallest_share",
        ),
        Rule(
            "time",
            time.is_some() && !breaking && !capacity,
            "time, but nothing that changes with it",
            "leave it out (schedules are read at time 1), or give fracture or conduction.capacity",
        ),
        Rule(
            "conduction.capacity",
            time.is_none() && capacity,
            "a heat capacity, but no time",
            "add [time] with end and step, or leave it out",
        ),
        Rule(
            "load",
            model.vibration.is_some() && !scene.load.is_empty(),
            "loads, which do not change natural vibration",
            OUT,
        ),
    ]
}

fn of_model(model: &Molecular) -> Vec<Rule> {
    let mut rules = Vec::new();
    if let Some(e) = &model.elasticity {
        let young = e.young.is_some();
        let of_young = "a Poisson's ratio, which belongs to `young`";
        let plane = "a plane, but moduli of one";
        rules.extend([
            Rule(
                "elasticity.poisson",
                !young && e.poisson.is_some(),
                of_young,
                OUT,
            ),
            Rule(
                "elasticity.plane",
                !young && e.from_scan.is_none() && e.plane.is_some(),
                plane,
                "leave it out: it belongs to young and from_scan",
            ),
            Rule(
                "elasticity.thermal",
                model.vibration.is_some() && e.thermal.is_some(),
                "thermal strain, which does not change natural vibration",
                OUT,
            ),
            Rule(
                "elasticity.thermal",
                model.fracture.is_some() && e.thermal.is_some(),
                "thermal strain with fracture, whose load must grow in proportion",
                "keep one of them",
            ),
        ]);
    }
    if let Some(c) = &model.conduction {
        let coupled = model.fracture.is_some();
        rules.extend([
            Rule(
                "conduction.capacity",
                c.capacity.is_some() && coupled,
                "a heat capacity with fracture, where the potential is steady",
                OUT,
            ),
            Rule(
                "conduction.initial",
                c.initial != 0.0 && c.capacity.is_none(),
                "an initial temperature of a steady scene",
                "leave it out, or give conduction.capacity and [time]",
            ),
            Rule(
                "conduction.probes",
                c.probes.is_some() && c.capacity.is_some(),
                "probes in a transient scene, where they are not read",
                OUT,
            ),
        ]);
    }
    let elastic = model.elasticity.is_some();
    let kind = |k: &super::Known| match k.field {
        KnownField::Polynomial(_) => model.conduction.is_some(),
        _ => elastic,
    };
    let tip = |k: &super::Known| matches!(k.field, KnownField::CrackTip(_));
    let swept = model.sweep.as_ref().map(|s| s.parameter);
    rules.extend([
        Rule(
            "known.field",
            !model.known.iter().all(kind),
            "a field of a physics that the scene has not",
            "strain and crack-tip go with elasticity, polynomial with conduction",
        ),
        Rule(
            "known.angle_deg",
            model.known.iter().any(|k| !tip(k) && k.angle_deg != 0.0),
            "an angle of a field other than crack-tip",
            OUT,
        ),
        Rule(
            "sweep.parameter",
            swept == Some(Parameter::Mixity) && !model.known.iter().any(tip),
            "mixity, but no crack-tip field",
            "add known = [{ region = .., field = { crack-tip = [1, 0] } }], or sweep the angle",
        ),
    ]);
    rules
}
