//! Owns the refusal of what a scene names in addition to its problem, but its solution would not use.

use crate::discretisation::plane::geometry::Geometry;
use crate::error::{Error, Result};
use crate::scene::conditions::Time;
use crate::scene::continuum_molecular::sweep::Parameter;
use crate::scene::continuum_molecular::{Known, KnownField, Molecular, Problem};
use crate::scene::setting::Setting;

const OUT: &str = "leave it out";

fn refuse(key: impl Into<String>, found: &str, advice: &str) -> Result<()> {
    Err(Error::setting(key, format!("found {found}"), advice))
}

/// # Errors
/// Tables and keys that nothing would act on.
pub fn check(scene: &Setting, model: &Molecular) -> Result<()> {
    of_other_scenes(scene)?;
    time(scene.time.as_ref(), &model.problem)?;
    if matches!(model.problem, Problem::Vibration { .. }) && !scene.load.is_empty() {
        let found = "loads, which do not change natural vibration";
        return refuse("load", found, OUT);
    }
    let mut fields = model.known.iter().enumerate();
    fields.try_for_each(|(k, known)| known_field(k, known, &model.problem))?;
    let tip = |k: &Known| matches!(k.field, KnownField::CrackTip(_));
    let swept = model.sweep.as_ref().map(|s| s.parameter);
    if swept == Some(Parameter::Mixity) && !model.known.iter().any(tip) {
        return refuse(
            "sweep.parameter",
            "mixity, but no crack-tip field",
            "add known = [{ region = .., field = { crack-tip = [1, 0] } }], or sweep the angle",
        );
    }
    Ok(())
}

fn of_other_scenes(scene: &Setting) -> Result<()> {
    if scene.layers.is_some() {
        return refuse("layers", "layers of fictitious points", OUT);
    }
    if let Some(k) = scene.load.iter().position(|l| l.case.is_some()) {
        let found = "a load case, of which this physics has one";
        return refuse(format!("load[{k}].case"), found, OUT);
    }
    if !scene.probe.is_empty() {
        return refuse("probe", "probes of densities", OUT);
    }
    match &scene.geometry {
        Geometry::Rectangle(r) if r.nodal => refuse(
            "geometry.rectangle.nodal",
            "points on the edges, where every point stands for a whole cell",
            OUT,
        ),
        _ => Ok(()),
    }
}

fn time(time: Option<&Time>, problem: &Problem) -> Result<()> {
    if time.is_some_and(Time::adapts) {
        return refuse(
            "time.tolerance",
            "a setting of scenes of remodelling: here all steps are `step`",
            "leave out tolerance and smallest_share",
        );
    }
    match (problem, time) {
        (Problem::Transient(_), None) => refuse(
            "conduction.capacity",
            "a heat capacity, but no time",
            "add [time] with end and step, or leave it out",
        ),
        (Problem::Static { .. } | Problem::Vibration { .. } | Problem::Steady(_), Some(_)) => {
            refuse(
                "time",
                "time, but nothing that changes with it",
                "leave it out (schedules are read at time 1), or give fracture or conduction.capacity",
            )
        }
        _ => Ok(()),
    }
}

fn known_field(k: usize, known: &Known, problem: &Problem) -> Result<()> {
    let there = match known.field {
        KnownField::Polynomial(_) => problem.conduction().is_some(),
        KnownField::CrackTip(_) | KnownField::Strain(_) => problem.elasticity().is_some(),
    };
    if !there {
        return refuse(
            format!("known[{k}].field"),
            "a field of a physics that the scene has not",
            "strain and crack-tip go with elasticity, polynomial with conduction",
        );
    }
    let tip = matches!(known.field, KnownField::CrackTip(_));
    if !tip && known.angle_deg != 0.0 {
        return refuse(
            format!("known[{k}].angle_deg"),
            "an angle of a field other than crack-tip",
            OUT,
        );
    }
    Ok(())
}
