//! Owns which components of `hold` and `load` a scene has.

use crate::error::{Error, Result};
use crate::scene::continuum_molecular::Molecular;
use crate::scene::setting::Setting;

const ELASTIC: [&str; 3] = ["x", "y", "rotation"];
const CONDUCTED: [&str; 2] = ["temperature", "potential"];

/// `turns` says whether the body's points do.
///
/// # Errors
/// Components that are none, or of a physics that the scene has not.
pub fn check(scene: &Setting, model: &Molecular, turns: bool) -> Result<()> {
    let holds = scene.hold.iter().map(|h| h.component.as_str()).enumerate();
    let loads = scene.load.iter().map(|l| l.component.as_str()).enumerate();
    let holds = holds.map(|(k, c)| (format!("hold[{k}].component"), c));
    for (key, component) in holds.chain(loads.map(|(k, c)| (format!("load[{k}].component"), c))) {
        if let Some(why) = wrong(component, model, turns) {
            let there = there(model, turns).join(", ");
            return Err(Error::setting(
                key,
                format!("found `{component}`, {why}"),
                format!("this scene has {there}"),
            ));
        }
    }
    Ok(())
}

fn there(model: &Molecular, turns: bool) -> Vec<&'static str> {
    let elastic = match (model.problem.elasticity(), turns) {
        (None, _) => &[],
        (Some(_), false) => &ELASTIC[..2],
        (Some(_), true) => &ELASTIC[..],
    };
    let conducted = model
        .problem
        .conduction()
        .into_iter()
        .flat_map(|_| CONDUCTED);
    elastic.iter().copied().chain(conducted).collect()
}

fn wrong(component: &str, model: &Molecular, turns: bool) -> Option<&'static str> {
    if there(model, turns).contains(&component) {
        None
    } else if CONDUCTED.contains(&component) {
        Some("but the scene has no conduction")
    } else if !ELASTIC.contains(&component) {
        Some("which is no component")
    } else if model.problem.elasticity().is_none() {
        Some("but the scene has no elasticity")
    } else {
        Some("but its points do not turn: bonds of this material neither shear nor bend")
    }
}
