//! Owns what fracture starts from: the load at one, and the body before anything is broken.

use super::{CrackGrowth, Ledger};
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::toughness::critical_energy;
use crate::scene::conditions::{Schedule, Time};
use crate::scene::continuum_molecular::crack::Crack;
use crate::scene::continuum_molecular::path::CONDUCTED;
use crate::scene::continuum_molecular::setup::{Conductor, Setup};
use crate::scene::continuum_molecular::solid::{DISPLACEMENT, Solid};
use crate::scene::continuum_molecular::window::Window;
use crate::scene::continuum_molecular::{Fracture, Molecular};
use crate::scene::setting::Setting;

/// # Errors
/// What a run would refuse before its first load.
pub fn check<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    params: &Fracture,
    solid: &Solid<D>,
    setup: &Setup,
) -> Result<()> {
    let time = growing(scene)?;
    let share = |key: &str, found: String, advice: &str| {
        Err(Error::setting(format!("fracture.{key}"), found, advice))
    };
    if !(0.0..1.0).contains(&params.batch) {
        let found = format!("found {}", params.batch);
        return share("batch", found, "give a share, from 0 to below 1");
    }
    if params.window_points == 0 {
        let advice = "give the points of the dense window, a few hundred (800 by default)";
        return share("window_points", "found 0".into(), advice);
    }
    unit_load(scene, setup, solid, time.end)?;
    critical(model, params, setup)?;
    stop(params, setup)?;
    unbreakable(params, setup, &solid.held).map(|_| ())
}

/// # Errors
/// A scene without a time for its load to grow in.
pub fn growing(scene: &Setting) -> Result<&Time> {
    scene.time.as_ref().ok_or_else(|| {
        Error::setting(
            "time",
            "fracture needs a load that grows, found no time",
            "add [time] with end and step; hold values must be proportional to time",
        )
    })
}

/// What is held at load one.
///
/// # Errors
/// Forces, and holds that do not grow in proportion to time.
pub fn unit_load<const D: usize>(
    scene: &Setting,
    setup: &Setup,
    solid: &Solid<D>,
    end: f64,
) -> Result<Vec<Option<f64>>> {
    let conducted = |component: &str| CONDUCTED[0].contains(&component);
    if let Some(k) = scene.load.iter().position(|l| !conducted(&l.component)) {
        return Err(Error::setting(
            format!("load[{k}].component"),
            format!(
                "found `{}`: fracture is driven by displacements, not by forces",
                scene.load[k].component
            ),
            "prescribe displacements with [[hold]]; the force on them is written as `load`",
        ));
    }
    for (k, hold) in scene.hold.iter().enumerate() {
        if let Some(found) = unlike_a_ramp(&hold.value, end).filter(|_| !conducted(&hold.component))
        {
            return Err(Error::setting(
                format!("hold[{k}].value"),
                format!(
                    "fracture follows displacements that grow in proportion to time, found {found}"
                ),
                "use value = { times = [0, end], values = [0, largest] }, or 0",
            ));
        }
    }
    let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
    let full = setup.holds(scene, names, end)?;
    let unit = |(full, held): (&Option<f64>, &Option<f64>)| full.map(|f| f / end).or(*held);
    Ok(full.iter().zip(&solid.held).map(unit).collect())
}

/// Where a schedule leaves the straight line from 0 to its value at `end`, in words.
fn unlike_a_ramp(schedule: &Schedule, end: f64) -> Option<String> {
    if let Schedule::Steps(_) = schedule {
        return Some("steps (`until`)".into());
    }
    let last = schedule.at(end);
    let within = schedule.corners().iter().filter(|t| 0.0 < **t && **t < end);
    let times: Vec<f64> = within.copied().chain([0.0]).collect();
    let size = times
        .iter()
        .fold(last.abs(), |m, t| m.max(schedule.at(*t).abs()));
    let off = |t: &&f64| (schedule.at(**t) - last * **t / end).abs() > 1e-9 * size;
    times.iter().find(off).map(|t| {
        format!(
            "{} at t = {t} and {last} at the end, t = {end}",
            schedule.at(*t)
        )
    })
}

/// Critical energy of each bond of the stencil.
fn critical(model: &Molecular, params: &Fracture, setup: &Setup) -> Result<Vec<f64>> {
    let angle_deg = model.problem.elasticity().map_or(0.0, |e| e.angle_deg);
    let law = critical_energy(
        params.energy[0],
        params.energy[1],
        setup.horizon(),
        params.exponent,
        params.frequency,
        angle_deg.to_radians(),
    )?;
    Ok(setup.bonds.iter().map(|b| law.at(b.psi())).collect())
}

/// Points at which bonds never break: those that `unbreakable` names, and those held in any component, which no window
/// takes in.
///
/// # Errors
/// If that is all of them.
fn unbreakable(params: &Fracture, setup: &Setup, held: &[Option<f64>]) -> Result<Vec<bool>> {
    let n = setup.points.len();
    let values = held.len() / n;
    let mut points: Vec<bool> = (0..n)
        .map(|p| (0..values).any(|d| held[p * values + d].is_some()))
        .collect();
    for (k, region) in params.unbreakable.iter().enumerate() {
        let key = format!("fracture.unbreakable[{k}]");
        let chosen = region.select(&setup.points, n, &key)?;
        chosen.into_iter().for_each(|p| points[p] = true);
    }
    if points.iter().all(|fixed| *fixed) {
        return Err(Error::setting(
            "fracture.unbreakable",
            "every point is unbreakable or held in some component: no bond could break",
            "leave some of the body free",
        ));
    }
    Ok(points)
}

/// Points at which the crack stops.
fn stop(params: &Fracture, setup: &Setup) -> Result<Vec<bool>> {
    let n = setup.points.len();
    let mut stop = vec![false; n];
    if let Some(region) = &params.stop {
        let chosen = region.select(&setup.points, n, "fracture.stop")?;
        chosen.into_iter().for_each(|p| stop[p] = true);
    }
    Ok(stop)
}

impl<'a, const D: usize> CrackGrowth<'a, D> {
    /// The body at rest, and a window about the bonds that will break first.
    pub fn new(
        scene: &'a Setting,
        model: &'a Molecular,
        params: &'a Fracture,
        solid: Solid<D>,
        conductor: Option<Conductor>,
        setup: &'a Setup,
    ) -> Result<Self> {
        let critical = critical(model, params, setup)?;
        let unbreakable = unbreakable(params, setup, &solid.held)?;
        let stop = stop(params, setup)?;
        let (window, x) = Window::new(&solid.body, setup, &solid.held, &[])?;
        let mut growth = CrackGrowth {
            critical,
            broken: vec![false; setup.family.len()],
            order: Vec::new(),
            before_window: 0,
            scene,
            model,
            params,
            setup,
            solid,
            unbreakable,
            crack: Crack::new(params.tip, stop),
            conductor: conductor.map(|(body, _)| body),
            window,
            bonds: Vec::new(),
            x,
            max_ratio_outside: 0.0,
            stale: false,
            step: 1,
            events: 0,
            lambda: 0.0,
            recorded: 0.0,
            ledger: Ledger::default(),
            peak: 0.0,
            worst_balance: 0.0,
            solves: 0,
            iterations: 0,
            windows: 0,
            unsettled: 0,
            potential_drop: 0.0,
            potential_unknowns: 0,
        };
        growth.move_window()?;
        Ok(growth)
    }
}
