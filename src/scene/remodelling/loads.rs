//! Owns forces on the placements of a scene's points over time.

use crate::error::{Error, Result};
use crate::scene::conditions::{Load, Schedule};
use crate::scene::remodelling::body::{Body, axis_of};
use crate::scene::setting::Setting;

/// Forces by time: each force, the share of its total that a point bears, and the values it acts on.
pub struct Loads(Vec<(Schedule, f64, Vec<usize>)>);

impl Loads {
    /// `cases` are the names of the load cases; empty: there is one without a name.
    ///
    /// # Errors
    /// A load of a case, component or region that is not there.
    pub fn new(scene: &Setting, body: &Body, cases: &[&str]) -> Result<Self> {
        let one = |(k, load): (usize, &Load)| {
            load.value.check(&format!("load[{k}].value"))?;
            let axis = axis_of(&load.component, &format!("load[{k}].component"))?;
            let chosen =
                load.region
                    .select(&body.points, body.material, &format!("load[{k}].region"))?;
            let acts = cases_of(load, k, cases)?;
            let acts = acts.map_or(body.cases(), |case| case..case + 1);
            let values = acts.flat_map(|case| {
                let points = chosen.iter();
                points.map(move |&p| body.placement_in(case, p, axis))
            });
            let values: Vec<usize> = values.collect();
            if values.iter().all(|&v| body.map.unknown(v).is_none()) {
                return Err(Error::setting(
                    format!("load[{k}].region"),
                    format!(
                        "all its points are held along {}: the support takes the force, and the body never sees it",
                        load.component
                    ),
                    "load other points, or leave the load or the hold out",
                ));
            }
            Ok((load.value.clone(), 1.0 / chosen.len() as f64, values))
        };
        Ok(Loads(
            scene
                .load
                .iter()
                .enumerate()
                .map(one)
                .collect::<Result<_>>()?,
        ))
    }

    /// Force on each value at time `t`.
    pub fn at(&self, t: f64, values: usize) -> Vec<f64> {
        if self.0.is_empty() {
            return Vec::new();
        }
        let mut force = vec![0.0; values];
        for (schedule, share, places) in &self.0 {
            let share = schedule.at(t) * share;
            places.iter().for_each(|&v| force[v] += share);
        }
        force
    }
    /// Times at which a force jumps or bends.
    pub fn corners(&self) -> impl Iterator<Item = f64> {
        self.0.iter().flat_map(|(s, ..)| s.corners()).copied()
    }
}

/// The case that load `k` belongs to; None: all.
fn cases_of(load: &Load, k: usize, cases: &[&str]) -> Result<Option<usize>> {
    let Some(name) = &load.case else {
        return Ok(None);
    };
    let found = cases.iter().position(|c| c == name);
    found.map(Some).ok_or_else(|| {
        let there = match cases {
            [] => "leave it out: only [physics.bond-based] with `cases` has load cases".to_owned(),
            _ => format!("the scene has {}", cases.join(", ")),
        };
        Error::setting(
            format!("load[{k}].case"),
            format!("found \"{name}\""),
            there,
        )
    })
}
