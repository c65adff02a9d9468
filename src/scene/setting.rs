//! Owns what every scene has, whatever its physics: geometry, grid, what is held and loaded, when, and what is kept.

use crate::discretisation::plane::Points;
use crate::discretisation::plane::family::Stencil;
use crate::discretisation::plane::geometry::{Bitmap, Geometry};
use crate::error::{Error, Result};
use crate::scene::conditions::{Hold, Layers, Load, Region, Time};
use crate::scene::frame::Output;
use serde::{Deserialize, Serialize};

/// A scene without its physics. Lengths, forces and times are in the scene's own consistent units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Setting {
    /// One line on what the scene shows.
    pub title: String,
    pub geometry: Geometry,
    pub grid: GridParams,
    /// Fictitious points beyond edges of the geometry.
    pub layers: Option<Layers>,
    /// Prescribed values.
    pub hold: Vec<Hold>,
    /// Prescribed forces or sources.
    pub load: Vec<Load>,
    pub time: Option<Time>,
    /// Named regions whose numbers are followed.
    pub probe: Vec<Probe>,
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

/// A named region whose densities are followed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    pub name: String,
    pub region: Region,
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

impl Setting {
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
    pub(super) fn marching_time(&self) -> Result<&Time> {
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
