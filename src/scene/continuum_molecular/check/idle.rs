//! Owns the refusal of loads that supports take in full, and of probes that show nothing.

use crate::error::{Error, Result};
use crate::scene::conditions::Region;
use crate::scene::continuum_molecular::setup::Setup;
use crate::scene::setting::Setting;

/// `held` are the values of points one after the other, `D` of each.
///
/// # Errors
/// A load on points that are all held in its component, unless the whole body is.
pub fn loads<const D: usize>(
    scene: &Setting,
    setup: &Setup,
    names: [&[&str]; D],
    held: &[Option<f64>],
) -> Result<()> {
    for (k, load) in scene.load.iter().enumerate() {
        let component = load.component.as_str();
        let Some(d) = names.iter().position(|n| n.contains(&component)) else {
            continue;
        };
        let (key, n) = (format!("load[{k}].region"), setup.points.len());
        let chosen = load.region.select(&setup.points, n, &key)?;
        let moves = (0..n).any(|p| held[p * D + d].is_none());
        if moves && chosen.iter().all(|p| held[p * D + d].is_some()) {
            return Err(Error::setting(
                key,
                format!(
                    "{component} is held at all its points: the support takes the load, and the body never sees it"
                ),
                "load other points, or leave the load or the hold out",
            ));
        }
    }
    Ok(())
}

/// # Errors
/// Probes off the body, or both at one point, whose difference is always 0.
pub fn probes(setup: &Setup, probes: [[f64; 2]; 2]) -> Result<()> {
    let at = |k: usize| {
        let key = format!("conduction.probes[{k}]");
        let region = Region::Point(probes[k]);
        region.select(&setup.points, setup.points.len(), &key)
    };
    if at(0)? != at(1)? {
        return Ok(());
    }
    Err(Error::setting(
        "conduction.probes",
        "both are nearest to the same point",
        "set them at least a spacing apart",
    ))
}
