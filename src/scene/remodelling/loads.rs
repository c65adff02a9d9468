//! Owns forces on the placements of a scene's points over time.

use crate::error::Result;
use crate::scene::conditions::{Load, Schedule};
use crate::scene::remodelling::body::{Body, axis_of};
use crate::scene::setting::Setting;

/// Forces by time.
pub struct Loads(Vec<(Schedule, Vec<usize>)>);

impl Loads {
    pub fn new(scene: &Setting, body: &Body) -> Result<Self> {
        let one = |(k, load): (usize, &Load)| {
            load.value.check(&format!("load[{k}].value"))?;
            let axis = axis_of(&load.component, &format!("load[{k}].component"))?;
            let chosen =
                load.region
                    .select(&body.points, body.material, &format!("load[{k}].region"))?;
            Ok((
                load.value.clone(),
                chosen.iter().map(|&p| body.placement(p, axis)).collect(),
            ))
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
        for (schedule, places) in &self.0 {
            let share = schedule.at(t) / places.len() as f64;
            places.iter().for_each(|&v| force[v] += share);
        }
        force
    }
    /// Times at which a force jumps or bends.
    pub fn corners(&self) -> impl Iterator<Item = f64> {
        self.0.iter().flat_map(|(s, _)| s.corners()).copied()
    }
}
