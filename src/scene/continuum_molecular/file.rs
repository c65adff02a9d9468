//! Owns the table `[physics.continuum-molecular]` as it stands in a scene file: which tables and keys go together.

mod coupled;

use super::{
    Bending, Conduction, Elasticity, Fracture, FromScan, Known, Material, Molecular, Problem,
    Steady, TetrachiralParams, Thermal, Transient, Vibration, sweep,
};
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::attenuation::Attenuation;
use crate::physics::continuum_molecular::tensor::Plane;
use serde::{Deserialize, Serialize};

/// A physics that is left out costs nothing.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MolecularFile {
    #[serde(default)]
    elasticity: Option<ElasticityFile>,
    #[serde(default)]
    conduction: Option<ConductionFile>,
    #[serde(default)]
    fracture: Option<Fracture>,
    #[serde(default)]
    vibration: Option<Vibration>,
    #[serde(default)]
    cracks: Vec<[f64; 4]>,
    #[serde(default)]
    known: Vec<Known>,
    #[serde(default = "one")]
    thickness: f64,
    #[serde(default = "super::yes")]
    correct_surfaces: bool,
    #[serde(default)]
    attenuation: Attenuation,
    #[serde(default)]
    sweep: Option<sweep::Sweep>,
}

/// Exactly one of `moduli`, `young` with `poisson`, `tetrachiral`, `from_scan`.
#[derive(Serialize, Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct ElasticityFile {
    moduli: Option<[f64; 6]>,
    young: Option<f64>,
    poisson: Option<f64>,
    tetrachiral: Option<TetrachiralParams>,
    from_scan: Option<FromScan>,
    /// Of `young` and `from_scan`; plane stress where it is left out.
    plane: Option<Plane>,
    angle_deg: f64,
    calibrated: bool,
    exponent: Option<u32>,
    bending: Option<Bending>,
    thermal: Option<Thermal>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ConductionFile {
    conductivity: [f64; 3],
    #[serde(default)]
    angle_deg: f64,
    #[serde(default = "super::two")]
    exponent: u32,
    #[serde(default)]
    calibrated: bool,
    /// With `time`, the scene is transient.
    #[serde(default)]
    capacity: Option<f64>,
    /// 0 where it is left out.
    #[serde(default)]
    initial: Option<f64>,
    #[serde(default)]
    probes: Option<[[f64; 2]; 2]>,
    /// With elasticity.
    #[serde(default)]
    piezoresistance: Option<f64>,
}

fn one() -> f64 {
    1.0
}

const MODEL: &str = "physics.continuum-molecular";
const OUT: &str = "leave it out";

fn refuse<T>(key: &str, found: &str, advice: &str) -> Result<T> {
    Err(Error::setting(key, format!("found {found}"), advice))
}

impl TryFrom<MolecularFile> for Molecular {
    type Error = Error;

    /// # Errors
    /// Tables that do not go together, and keys that nothing would act on.
    fn try_from(file: MolecularFile) -> Result<Self> {
        let conduction = file.conduction;
        let problem = match (file.elasticity, file.fracture, file.vibration) {
            (Some(e), fracture, None) => elastic(e, fracture, conduction)?,
            (Some(_), Some(_), Some(_)) => {
                let found = "both fracture and vibration";
                return refuse(MODEL, found, "keep one, or make two scenes");
            }
            (Some(e), None, Some(vibration)) => vibrating(e, vibration, conduction.is_some())?,
            (None, None, None) => conducting(conduction)?,
            (None, ..) => {
                let found = "fracture or vibration without elasticity";
                return refuse(MODEL, found, "add the table of elasticity");
            }
        };
        Ok(Molecular {
            problem,
            cracks: file.cracks,
            known: file.known,
            thickness: file.thickness,
            correct_surfaces: file.correct_surfaces,
            attenuation: file.attenuation,
            sweep: file.sweep,
        })
    }
}

/// Equilibrium, or fracture.
fn elastic(
    mut file: ElasticityFile,
    fracture: Option<Fracture>,
    conduction: Option<ConductionFile>,
) -> Result<Problem> {
    let thermal = file.thermal.take();
    let elasticity = file.elasticity()?;
    let Some(fracture) = fracture else {
        coupled::check(thermal.as_ref(), conduction.as_ref())?;
        return Ok(Problem::Static {
            elasticity,
            thermal,
            conduction: conduction.map(ConductionFile::steady).transpose()?,
        });
    };
    if thermal.is_some() {
        return refuse(
            "elasticity.thermal",
            "thermal strain with fracture, whose load must grow in proportion",
            "keep one of them",
        );
    }
    if conduction.as_ref().is_some_and(|c| c.capacity.is_some()) {
        return refuse(
            "conduction.capacity",
            "a heat capacity with fracture, where the potential is steady",
            OUT,
        );
    }
    Ok(Problem::Fracture {
        elasticity,
        fracture,
        conduction: conduction.map(ConductionFile::steady).transpose()?,
    })
}

fn vibrating(file: ElasticityFile, vibration: Vibration, conducts: bool) -> Result<Problem> {
    refuse_conduction(conducts)?;
    if file.thermal.is_some() {
        return refuse(
            "elasticity.thermal",
            "thermal strain, which does not change natural vibration",
            OUT,
        );
    }
    Ok(Problem::Vibration {
        elasticity: file.elasticity()?,
        vibration,
    })
}

fn refuse_conduction(conducts: bool) -> Result<()> {
    match conducts {
        false => Ok(()),
        true => refuse(
            MODEL,
            "elasticity and conduction that do not act on each other",
            "make two scenes, or couple them: fracture (broken bonds stop conducting), elasticity.thermal without rise (the \
             temperature strains the body), or conduction.piezoresistance (strain changes what bonds conduct)",
        ),
    }
}

fn conducting(file: Option<ConductionFile>) -> Result<Problem> {
    let Some(file) = file else {
        return refuse(
            MODEL,
            "neither elasticity nor conduction",
            "add the table of at least one",
        );
    };
    if file.piezoresistance.is_some() {
        return refuse(
            "conduction.piezoresistance",
            "a change of conductivity with strain, but no elasticity",
            "leave it out, or add the table of elasticity",
        );
    }
    let Some(capacity) = file.capacity else {
        return Ok(Problem::Steady(file.steady()?));
    };
    if file.probes.is_some() {
        return refuse(
            "conduction.probes",
            "probes in a transient scene, where they are not read",
            OUT,
        );
    }
    Ok(Problem::Transient(Transient {
        capacity,
        initial: file.initial.unwrap_or(0.0),
        conduction: file.conduction(),
    }))
}

impl ElasticityFile {
    fn elasticity(self) -> Result<Elasticity> {
        Ok(Elasticity {
            angle_deg: self.angle_deg,
            calibrated: self.calibrated,
            exponent: self.exponent,
            bending: self.bending,
            material: self.material()?,
        })
    }

    fn material(self) -> Result<Material> {
        if self.young.is_none() && self.poisson.is_some() {
            let found = "a Poisson's ratio, which belongs to `young`";
            return refuse("elasticity.poisson", found, OUT);
        }
        if self.young.is_none() && self.from_scan.is_none() && self.plane.is_some() {
            return refuse(
                "elasticity.plane",
                "a plane, but moduli of one",
                "leave it out: it belongs to young and from_scan",
            );
        }
        let plane = self.plane.unwrap_or_default();
        match (self.moduli, self.young, self.tetrachiral, self.from_scan) {
            (Some(moduli), None, None, None) => Ok(Material::Moduli(moduli)),
            (None, Some(young), None, None) => Ok(Material::Isotropic {
                young,
                poisson: self.poisson.unwrap_or(0.0),
                plane,
            }),
            (None, None, Some(lattice), None) => Ok(Material::Tetrachiral(lattice)),
            (None, None, None, Some(scan)) => Ok(Material::FromScan { scan, plane }),
            _ => Err(Error::setting(
                "elasticity",
                "expected exactly one of moduli, young (with poisson), tetrachiral, from_scan",
                "keep one",
            )),
        }
    }
}

impl ConductionFile {
    fn steady(self) -> Result<Steady> {
        if self.initial.is_some_and(|initial| initial != 0.0) {
            return refuse(
                "conduction.initial",
                "an initial temperature of a steady scene",
                "leave it out, or give conduction.capacity and [time]",
            );
        }
        Ok(Steady {
            probes: self.probes,
            piezoresistance: self.piezoresistance,
            conduction: self.conduction(),
        })
    }

    fn conduction(self) -> Conduction {
        Conduction {
            conductivity: self.conductivity,
            angle_deg: self.angle_deg,
            exponent: self.exponent,
            calibrated: self.calibrated,
        }
    }
}

impl From<Molecular> for MolecularFile {
    fn from(model: Molecular) -> Self {
        let mut file = MolecularFile {
            elasticity: None,
            conduction: None,
            fracture: None,
            vibration: None,
            cracks: model.cracks,
            known: model.known,
            thickness: model.thickness,
            correct_surfaces: model.correct_surfaces,
            attenuation: model.attenuation,
            sweep: model.sweep,
        };
        match model.problem {
            Problem::Static {
                elasticity,
                thermal,
                conduction,
            } => {
                file.conduction = conduction.map(ConductionFile::from);
                file.elasticity = Some(ElasticityFile {
                    thermal,
                    ..elasticity.into()
                });
            }
            Problem::Fracture {
                elasticity,
                fracture,
                conduction,
            } => {
                file.elasticity = Some(elasticity.into());
                file.fracture = Some(fracture);
                file.conduction = conduction.map(ConductionFile::from);
            }
            Problem::Vibration {
                elasticity,
                vibration,
            } => {
                file.elasticity = Some(elasticity.into());
                file.vibration = Some(vibration);
            }
            Problem::Steady(steady) => file.conduction = Some(steady.into()),
            Problem::Transient(transient) => {
                file.conduction = Some(ConductionFile {
                    capacity: Some(transient.capacity),
                    initial: Some(transient.initial),
                    ..transient.conduction.into()
                });
            }
        }
        file
    }
}

impl From<Elasticity> for ElasticityFile {
    fn from(elasticity: Elasticity) -> Self {
        let mut file = ElasticityFile {
            angle_deg: elasticity.angle_deg,
            calibrated: elasticity.calibrated,
            exponent: elasticity.exponent,
            bending: elasticity.bending,
            ..ElasticityFile::default()
        };
        match elasticity.material {
            Material::Moduli(moduli) => file.moduli = Some(moduli),
            Material::Isotropic {
                young,
                poisson,
                plane,
            } => (file.young, file.poisson, file.plane) = (Some(young), Some(poisson), Some(plane)),
            Material::Tetrachiral(lattice) => file.tetrachiral = Some(lattice),
            Material::FromScan { scan, plane } => {
                (file.from_scan, file.plane) = (Some(scan), Some(plane));
            }
        }
        file
    }
}

impl From<Conduction> for ConductionFile {
    fn from(conduction: Conduction) -> Self {
        ConductionFile {
            conductivity: conduction.conductivity,
            angle_deg: conduction.angle_deg,
            exponent: conduction.exponent,
            calibrated: conduction.calibrated,
            capacity: None,
            initial: None,
            probes: None,
            piezoresistance: None,
        }
    }
}

impl From<Steady> for ConductionFile {
    fn from(steady: Steady) -> Self {
        ConductionFile {
            probes: steady.probes,
            piezoresistance: steady.piezoresistance,
            ..steady.conduction.into()
        }
    }
}
