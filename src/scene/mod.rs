//! Owns scenes: two-dimensional models of points joined by pair potentials (and their local twins), described in one
//! file. What a scene leaves out costs nothing. This file holds the one match from the physics' words to code.

pub mod conditions;
pub mod continuum_molecular;
pub mod frame;
pub mod remodelling;
pub mod setting;
pub mod state;
pub mod step_statistics;

use crate::discretisation::plane::Points;
use crate::discretisation::plane::geometry::Geometry;
use crate::error::{ADVICE, Error, Result};
use crate::physics::bond_based::BondBased;
use crate::physics::bond_based::shear::ShearBonds;
use conditions::{Hold, Layers, Load, Time};
use continuum_molecular::Molecular;
use frame::{Observer, Output, Summary};
use remodelling::bond_based::BondBasedParams;
use remodelling::continuum::{ContinuumParams, Local};
use remodelling::marcher::Marcher;
use remodelling::{bond_based, continuum, shear_bonds, time_loop};
use serde::{Deserialize, Serialize};
use setting::{GridParams, Inputs, Probe, Setting};
use std::path::Path;

/// What a scene file describes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(from = "SceneFile", into = "SceneFile")]
pub struct Scene {
    pub setting: Setting,
    pub physics: Physics,
}

/// The keys of a scene file, side by side as they stand there.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    title: String,
    geometry: Geometry,
    grid: GridParams,
    #[serde(default)]
    layers: Option<Layers>,
    #[serde(default)]
    hold: Vec<Hold>,
    #[serde(default)]
    load: Vec<Load>,
    #[serde(default)]
    time: Option<Time>,
    physics: Physics,
    #[serde(default)]
    probe: Vec<Probe>,
    #[serde(default)]
    output: Output,
}

impl From<SceneFile> for Scene {
    fn from(file: SceneFile) -> Scene {
        let setting = Setting {
            title: file.title,
            geometry: file.geometry,
            grid: file.grid,
            layers: file.layers,
            hold: file.hold,
            load: file.load,
            time: file.time,
            probe: file.probe,
            output: file.output,
        };
        Scene {
            setting,
            physics: file.physics,
        }
    }
}

impl From<Scene> for SceneFile {
    fn from(scene: Scene) -> SceneFile {
        let setting = scene.setting;
        SceneFile {
            title: setting.title,
            geometry: setting.geometry,
            grid: setting.grid,
            layers: setting.layers,
            hold: setting.hold,
            load: setting.load,
            time: setting.time,
            probe: setting.probe,
            output: setting.output,
            physics: scene.physics,
        }
    }
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
    ContinuumMolecular(Box<Molecular>),
}

impl Scene {
    /// `path` only words the errors.
    pub fn parse(text: &str, path: &Path) -> Result<Scene> {
        toml::from_str(text).map_err(|e| {
            let found = format!("not a valid scene\n{e}");
            // What a table may hold is refused in words that say what to do.
            let advised = e.message().split_once(ADVICE);
            if let Some((_, advice)) = advised {
                return Error::file(
                    path,
                    found.replace(&format!("{ADVICE}{advice}"), ""),
                    advice,
                );
            }
            let advice = match nearest_key(e.message()) {
                Some(key) => format!("did you mean `{key}`?"),
                None => "correct the line shown; `pipelines/` has example scenes".to_owned(),
            };
            Error::file(path, found, advice)
        })
    }
}

/// A scene that has been checked, with what was set up for that: a run goes on with it.
pub struct Checked<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
    model: Model<'a>,
}

/// What a scene's physics sets up.
enum Model<'a> {
    BondBased(Box<Marcher<BondBased>>),
    ShearBonds(Box<Marcher<ShearBonds>>),
    Continuum(Box<Marcher<Local>>),
    ContinuumMolecular(Box<continuum_molecular::check::Checked<'a>>),
}

/// # Errors
/// What a run would refuse before its first step.
pub fn check<'a>(scene: &'a Scene, inputs: &'a Inputs) -> Result<Checked<'a>> {
    let setting = &scene.setting;
    setting.output.check()?;
    let model = match &scene.physics {
        Physics::BondBased(params) if params.is_extended() => {
            let marcher = shear_bonds::marcher(setting, params, inputs)?;
            time_loop::check(setting)?;
            Model::ShearBonds(Box::new(marcher))
        }
        Physics::BondBased(params) => {
            let marcher = bond_based::marcher(setting, params, inputs)?;
            time_loop::check(setting)?;
            Model::BondBased(Box::new(marcher))
        }
        Physics::Continuum(params) => {
            let marcher = continuum::marcher(setting, params, inputs)?;
            time_loop::check(setting)?;
            Model::Continuum(Box::new(marcher))
        }
        Physics::ContinuumMolecular(model) => {
            let checked = continuum_molecular::check::check(setting, model, inputs)?;
            Model::ContinuumMolecular(Box::new(checked))
        }
    };
    Ok(Checked {
        scene,
        inputs,
        model,
    })
}

impl Checked<'_> {
    /// The material points.
    pub fn points(&self) -> Result<Points> {
        self.scene.setting.points(self.inputs)
    }

    /// Runs the scene, reporting states to `observer` as they are accepted.
    pub fn run(self, observer: &mut dyn Observer) -> Result<Summary> {
        let (setting, inputs) = (&self.scene.setting, self.inputs);
        match self.model {
            Model::BondBased(marcher) => time_loop::run(*marcher, setting, inputs, observer),
            Model::ShearBonds(marcher) => time_loop::run(*marcher, setting, inputs, observer),
            Model::Continuum(marcher) => time_loop::run(*marcher, setting, inputs, observer),
            Model::ContinuumMolecular(checked) => checked.run(observer),
        }
    }
}

/// Checks and runs a scene.
pub fn run(scene: &Scene, inputs: &Inputs, observer: &mut dyn Observer) -> Result<Summary> {
    check(scene, inputs)?.run(observer)
}

/// The expected key closest to the unknown one that serde names in its message.
fn nearest_key(message: &str) -> Option<&str> {
    let mut quoted = message.split('`').skip(1).step_by(2);
    let is_unknown = message.starts_with("unknown field") || message.starts_with("unknown variant");
    let unknown = quoted.next().filter(|_| is_unknown)?;
    let score = |key: &str| strsim::jaro_winkler(unknown, key);
    quoted.max_by(|a, b| score(a).total_cmp(&score(b)))
}
