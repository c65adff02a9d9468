//! Owns continuum-molecular scenes: which physics a scene has, and which solution that asks for. Lengths in mm, forces
//! in N, moduli in MPa, or any consistent units.

pub mod check;
pub mod conduction;
pub mod crack;
pub mod equilibrium;
mod file;
pub mod fracture;
pub mod modes;
mod path;
pub mod setup;
pub mod solid;
pub mod steady;
pub mod sweep;
mod tensors;
mod warnings;
pub mod window;

use crate::error::Result;
use crate::physics::continuum_molecular::attenuation::Attenuation;
use crate::physics::continuum_molecular::tensor::Plane;
use crate::scene::conditions::Region;
use crate::scene::frame::{Observer, Summary};
use crate::scene::setting::Setting;
use check::{Bodies, Checked, Solution};
use file::MolecularFile;
use serde::{Deserialize, Serialize};
use setup::{Conductor, Setup};
use solid::Solid;

/// The table `[physics.continuum-molecular]`, which [`file`] reads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MolecularFile", into = "MolecularFile")]
pub struct Molecular {
    pub problem: Problem,
    /// Segments `[x0, y0, x1, y1]` that cut the bonds they cross: pre-cracks, slits.
    pub cracks: Vec<[f64; 4]>,
    /// Regions held at a known field, for boundary layers.
    pub known: Vec<Known>,
    /// Out-of-plane thickness; loads and energies are in proportion.
    pub thickness: f64,
    /// The volume method for surfaces: bonds of incomplete families are stiffened by 2 V0/(Vp + Vq).
    pub correct_surfaces: bool,
    /// How bonds weaken with their length.
    pub attenuation: Attenuation,
    /// Run once for each of several values of one parameter.
    pub sweep: Option<sweep::Sweep>,
}

/// What is solved, with the physics that it needs and no other.
#[derive(Debug, Clone, PartialEq)]
pub enum Problem {
    /// Elastic equilibrium. With conduction either its temperature strains the body, or strain changes what its bonds conduct.
    Static {
        elasticity: Elasticity,
        thermal: Option<Thermal>,
        conduction: Option<Steady>,
    },
    /// Fracture under a growing load; broken bonds stop conducting, where the body conducts.
    Fracture {
        elasticity: Elasticity,
        fracture: Fracture,
        conduction: Option<Steady>,
    },
    Vibration {
        elasticity: Elasticity,
        vibration: Vibration,
    },
    Steady(Steady),
    /// Transient conduction.
    Transient(Transient),
}

/// Steady conduction.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    pub conduction: Conduction,
    /// Two positions whose potential difference is recorded.
    pub probes: Option<[[f64; 2]; 2]>,
    /// Π of k_e(s) = k_e0 (1 + Π s), of bodies that are strained.
    pub piezoresistance: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Transient {
    pub conduction: Conduction,
    /// Heat capacity per volume.
    pub capacity: f64,
    /// Temperature at time 0.
    pub initial: f64,
}

impl Molecular {
    /// The one field that all of `known` prescribe.
    fn one_known(&self) -> Option<&Known> {
        let first = self.known.first()?;
        let same = |k: &Known| k.field == first.field && k.angle_deg == first.angle_deg;
        self.known.iter().all(same).then_some(first)
    }
}

impl Problem {
    pub fn elasticity(&self) -> Option<&Elasticity> {
        match self {
            Problem::Static { elasticity, .. }
            | Problem::Fracture { elasticity, .. }
            | Problem::Vibration { elasticity, .. } => Some(elasticity),
            Problem::Steady(_) | Problem::Transient(_) => None,
        }
    }

    /// Two positions whose potentials or temperatures are compared.
    pub fn probes(&self) -> Option<[[f64; 2]; 2]> {
        match self {
            Problem::Steady(steady) => steady.probes,
            Problem::Static { conduction, .. } | Problem::Fracture { conduction, .. } => {
                conduction.as_ref()?.probes
            }
            _ => None,
        }
    }

    pub fn conduction(&self) -> Option<&Conduction> {
        match self {
            Problem::Static { conduction, .. } | Problem::Fracture { conduction, .. } => {
                conduction.as_ref().map(|c| &c.conduction)
            }
            Problem::Steady(steady) => Some(&steady.conduction),
            Problem::Transient(transient) => Some(&transient.conduction),
            Problem::Vibration { .. } => None,
        }
    }

    /// Turns the material's first axis to `angle_deg`.
    fn turn(&mut self, angle_deg: f64) {
        match self {
            Problem::Vibration { elasticity, .. } => elasticity.angle_deg = angle_deg,
            Problem::Static {
                elasticity,
                conduction,
                ..
            }
            | Problem::Fracture {
                elasticity,
                conduction,
                ..
            } => {
                elasticity.angle_deg = angle_deg;
                if let Some(steady) = conduction {
                    steady.conduction.angle_deg = angle_deg;
                }
            }
            Problem::Steady(steady) => steady.conduction.angle_deg = angle_deg,
            Problem::Transient(transient) => transient.conduction.angle_deg = angle_deg,
        }
    }
}

/// Plane elasticity.
#[derive(Debug, Clone, PartialEq)]
pub struct Elasticity {
    pub material: Material,
    /// Angle of the material's first axis.
    pub angle_deg: f64,
    /// Make the stencil store the exact energy of a homogeneous strain.
    pub calibrated: bool,
    /// Even exponent of the cosⁿ law of an orthotropic body's bonds; the tensor's own angular form where there is none.
    pub exponent: Option<u32>,
    pub bending: Option<Bending>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Material {
    /// C1111, C2222, C1122, C1212, C1112, C2212 in the material's axes.
    Moduli([f64; 6]),
    Isotropic {
        young: f64,
        poisson: f64,
        plane: Plane,
    },
    Tetrachiral(TetrachiralParams),
    /// A 6 x 6 apparent stiffness cut to a plane.
    FromScan {
        scan: FromScan,
        plane: Plane,
    },
}

/// The tetrachiral block lattice of eqs. 86-90.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TetrachiralParams {
    pub block: f64,
    pub chirality_deg: f64,
    pub interface: f64,
    pub young: f64,
    pub poisson: f64,
}

/// Where a 6 x 6 stiffness (MPa, Voigt order 11, 22, 33, 23, 13, 12) is read from, and which of its axes span the plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FromScan {
    /// JSON file, relative to the scene file: the matrix itself, or an object with it under `stiffness_mpa`.
    pub file: std::path::PathBuf,
    /// For instance `[\"x\", \"z\"]`: the scan's axes that become the scene's first and second.
    pub axes: [crate::grid::Axis; 2],
}

/// Couple-stress moduli E3131 and E3232 (N), eqs. 177-181 for any even exponent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bending {
    pub first: f64,
    pub second: f64,
    #[serde(default = "two")]
    pub exponent: u32,
}

/// Thermal strain (eq. 176): expansion a11, a22, a12 per degree. The temperature rise is `[T0, dT/dx, dT/dy]`, or that of the scene's
/// conduction above `reference` (0 where it is left out).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    pub expansion: [f64; 3],
    #[serde(default)]
    pub rise: Option<[f64; 3]>,
    #[serde(default)]
    pub reference: Option<f64>,
}

/// Heat or electric conduction.
#[derive(Debug, Clone, PartialEq)]
pub struct Conduction {
    /// K11, K22, K12 in the material's axes.
    pub conductivity: [f64; 3],
    pub angle_deg: f64,
    /// Even exponent of the angular law (eq. 163).
    pub exponent: u32,
    /// Make the stencil conduct a linear field exactly.
    pub calibrated: bool,
}

/// Brittle fracture by the energy criterion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fracture {
    /// Fracture energy (N/mm) of cracks normal to the material's first axis and to its second; in general, to the
    /// direction at 90 degrees over the frequency.
    pub energy: [f64; 2],
    #[serde(default = "two")]
    pub exponent: u32,
    #[serde(default = "first")]
    pub frequency: u32,
    /// Bonds break in extension only.
    #[serde(default = "yes")]
    pub extension_only: bool,
    /// At one load the bonds whose energy ratio is within this share of the largest break together.
    #[serde(default = "tenth")]
    pub batch: f64,
    /// Stop when the crack gets here: when a bond between nearest neighbours, one of them in the region, breaks.
    #[serde(default)]
    pub stop: Option<Region>,
    /// Where a bond never breaks.
    #[serde(default)]
    pub unbreakable: Vec<Region>,
    /// The crack's length is measured from here.
    #[serde(default)]
    pub tip: [f64; 2],
    /// Points of the dense remainder about the crack front.
    #[serde(default = "window")]
    pub window_points: usize,
}

/// Natural vibration.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vibration {
    /// Mass per mm³; of a tetrachiral lattice that of its blocks.
    pub density: f64,
    pub modes: usize,
}

/// A region held at a known field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Known {
    pub region: Region,
    pub field: KnownField,
    /// Angle of the direction ahead of the crack, for `crack-tip`: the grid need not lie along the crack.
    #[serde(default)]
    pub angle_deg: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KnownField {
    /// Displacement and rotation about a crack tip at the origin, the crack behind it along `angle_deg`: K_I and K_II.
    CrackTip([f64; 2]),
    /// The affine field of ε11, ε22, 2 ε12, without rotation.
    Strain([f64; 3]),
    /// Temperature or potential Σ c xᵃ yᵇ, as rows `[a, b, c]`.
    Polynomial(Vec<[f64; 3]>),
}

fn tenth() -> f64 {
    0.1
}
fn yes() -> bool {
    true
}
fn two() -> u32 {
    2
}
fn first() -> u32 {
    1
}
fn window() -> usize {
    800
}

impl Checked<'_> {
    /// Runs the scene.
    ///
    /// # Errors
    /// A body that is not held or not stable.
    pub fn run(self, observer: &mut dyn Observer) -> Result<Summary> {
        let (scene, model, setup) = (self.scene, self.model, &self.setup);
        observer.directions(&setup.directions(model, self.inputs)?)?;
        match self.solution {
            Solution::One(bodies) => solve(scene, model, setup, *bodies, observer),
            Solution::Sweep(sweep) => sweep::run(model, sweep, setup, observer, |one, observer| {
                let bodies = check::bodies(scene, one, setup, self.inputs)?;
                solve(scene, one, setup, bodies, observer)
            }),
        }
    }
}

/// Solves one value of what is swept.
fn solve(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    bodies: Bodies,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let warnings = warnings::negative(model, setup, &bodies)?;
    warnings.iter().for_each(|words| observer.warn(words));
    let solved = match bodies {
        Bodies::Steady(steady, conductor) => {
            conduction::steady(scene, model, steady, conductor, setup, observer)
        }
        Bodies::Transient(transient, conductor) => {
            conduction::transient(scene, model, transient, conductor, setup, observer)
        }
        Bodies::Straight(solid, conductor) => {
            elastic(scene, model, solid, conductor, setup, observer)
        }
        Bodies::Turning(solid, conductor) => {
            elastic(scene, model, solid, conductor, setup, observer)
        }
    };
    solved.map_err(|error| warnings::with_warnings(error, &warnings))
}

fn elastic<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    solid: Solid<D>,
    conductor: Option<Conductor>,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    match &model.problem {
        Problem::Vibration {
            elasticity,
            vibration,
        } => {
            let vibration = vibration.of_continuum(&elasticity.material);
            modes::run(solid, &vibration, setup, observer)
        }
        Problem::Fracture { fracture, .. } => {
            fracture::run(scene, model, fracture, solid, conductor, setup, observer)
        }
        _ => steady::deform(scene, model, solid, conductor, setup, observer),
    }
}
