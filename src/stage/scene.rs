//! Owns scenes: two-dimensional models of points joined by pair potentials (and their local twins), described in one
//! file. Everything a scene leaves out costs nothing. This file holds the one match from the physics' words to code.

mod body;
pub mod bond_based;
pub mod conditions;
pub mod continuum;
pub mod density;
pub mod frame;
mod loads;
mod march;
pub mod pace;
pub mod solver;
pub mod state;
mod stride;

use crate::error::{Error, Result};
use crate::topology::family::Stencil;
use crate::topology::outline::{Bitmap, Outline};
use crate::topology::plane::Points;
use bond_based::BondBasedParams;
use conditions::{Hold, Layers, Load, Time};
use continuum::ContinuumParams;
use density::Probe;
use frame::{Observer, Output, Summary};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A scene file. Lengths, forces and times are in the scene's own consistent units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// One line on what the scene shows.
    pub title: String,
    pub geometry: Outline,
    pub grid: GridParams,
    /// Fictitious points beyond edges of the geometry.
    #[serde(default)]
    pub layers: Option<Layers>,
    /// Prescribed values.
    #[serde(default)]
    pub hold: Vec<Hold>,
    /// Prescribed forces or sources.
    #[serde(default)]
    pub load: Vec<Load>,
    #[serde(default)]
    pub time: Option<Time>,
    pub physics: Physics,
    /// Named regions whose numbers are followed.
    #[serde(default)]
    pub probe: Vec<Probe>,
    #[serde(default)]
    pub output: Output,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridParams {
    /// Distance Δ between neighbouring points.
    pub spacing: f64,
    /// Horizon δ, for models of bonds.
    #[serde(default)]
    pub horizon: Option<f64>,
    /// Horizon as a multiple of the spacing, instead of `horizon`.
    #[serde(default)]
    pub horizon_ratio: Option<f64>,
    /// Count the part of a neighbour's cell inside the horizon (Hu) instead of all or nothing.
    #[serde(default)]
    pub partial_volumes: bool,
    /// Drop all but the largest connected piece.
    #[serde(default)]
    pub keep_largest: bool,
    /// Drop points that belong to no square of four neighbouring points, which finite elements need.
    #[serde(default)]
    pub prune: bool,
}

/// The physics of a scene: one table under `[physics]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Physics {
    /// Peridynamics with harmonic bonds, optionally growing.
    BondBased(BondBasedParams),
    /// Its local twin by finite elements.
    Continuum(ContinuumParams),
    /// Anisotropic elasticity, fracture, conduction.
    ContinuumMolecular(Box<crate::stage::molecular::Molecular>),
}

/// What the scene's files hold, read by the caller.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// Pixels of an image or slice geometry.
    pub bitmap: Option<Bitmap>,
    /// A value per cell of the bitmap (grey values of a scan), rows from the bottom up.
    pub grey: Option<Vec<f64>>,
    /// An apparent stiffness in MPa, Voigt order 11, 22, 33, 23, 13, 12.
    pub stiffness: Option<[[f64; 6]; 6]>,
}

impl Scene {
    /// `path` only words the errors.
    pub fn parse(text: &str, path: &Path) -> Result<Scene> {
        toml::from_str(text).map_err(|e| {
            let advice = match nearest_key(e.message()) {
                Some(key) => format!("did you mean `{key}`?"),
                None => "correct the line shown; `pipelines/` has example scenes".to_owned(),
            };
            Error::file(path, format!("not a valid scene\n{e}"), advice)
        })
    }

    /// The material points, in one piece.
    pub fn points(&self, inputs: &Inputs) -> Result<Points> {
        let points = self
            .geometry
            .points(self.grid.spacing, inputs.bitmap.as_ref())?;
        let points = if self.grid.prune {
            points.pruned()
        } else {
            points
        };
        let points = if self.grid.keep_largest {
            points.largest_piece()
        } else {
            points
        };
        points.require_one_piece()?;
        Ok(points)
    }

    /// # Errors
    /// A scene that marches through time without `[time]`.
    fn marching_time(&self) -> Result<&Time> {
        self.time
            .as_ref()
            .ok_or_else(|| Error::setting("time", "missing", "give [time] end and step"))
    }

    /// The full neighbourhood. Refused where the scene gives no horizon, or two.
    pub fn stencil(&self) -> Result<Stencil> {
        let grid = &self.grid;
        let horizon = match (grid.horizon, grid.horizon_ratio) {
            (Some(horizon), None) => horizon,
            (None, Some(ratio)) => ratio * grid.spacing,
            (given, _) => {
                let found = if given.is_some() { "both" } else { "neither" };
                return Err(Error::setting(
                    "grid.horizon",
                    format!("expected grid.horizon or grid.horizon_ratio, found {found}"),
                    "give one of them",
                ));
            }
        };
        Stencil::new(grid.spacing, horizon, grid.partial_volumes)
    }
}

/// Refuses what a run would refuse before its first step. The material points.
pub fn check(scene: &Scene, inputs: &Inputs) -> Result<Points> {
    scene.output.check()?;
    match &scene.physics {
        Physics::BondBased(params) => bond_based::check(scene, params, inputs)?,
        Physics::Continuum(params) => continuum::check(scene, params, inputs)?,
        Physics::ContinuumMolecular(model) => {
            crate::stage::molecular::check::check(scene, model, inputs)?;
        }
    }
    scene.points(inputs)
}

/// Runs a scene, reporting states to `observer` as they are accepted.
pub fn run(scene: &Scene, inputs: &Inputs, observer: &mut dyn Observer) -> Result<Summary> {
    scene.output.check()?;
    match &scene.physics {
        Physics::BondBased(params) => bond_based::run(scene, params, inputs, observer),
        Physics::Continuum(params) => continuum::run(scene, params, inputs, observer),
        Physics::ContinuumMolecular(model) => {
            crate::stage::molecular::run(scene, model, inputs, observer)
        }
    }
}

/// The expected key closest to the unknown one that serde names in its message.
fn nearest_key(message: &str) -> Option<&str> {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let is_unknown = message.starts_with("unknown field") || message.starts_with("unknown variant");
    let unknown = quoted.next().filter(|_| is_unknown)?;
    let score = |key: &str| strsim::jaro_winkler(unknown, key);
    quoted.max_by(|a, b| score(a).total_cmp(&score(b)))
}
