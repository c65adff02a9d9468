//! Owns the tensors of a scene in its own axes.

use super::{Conduction, Elasticity, Material, TetrachiralParams, Vibration};
use crate::error::{Error, Result};
use crate::physics::continuum_molecular::conductivity::Conductivity;
use crate::physics::continuum_molecular::tensor::{Plane, PlaneTensor};
use crate::physics::continuum_molecular::tetrachiral::Tetrachiral;
use crate::scene::setting::Inputs;

impl Elasticity {
    /// The stiffness in the scene's axes.
    pub fn tensor(&self, inputs: &Inputs) -> Result<PlaneTensor> {
        let zeta = self.angle_deg.to_radians();
        let tensor = match &self.material {
            Material::Moduli(moduli) => PlaneTensor::from_moduli(*moduli)?,
            &Material::Isotropic {
                young,
                poisson,
                plane,
            } => {
                let (below, why) = match plane {
                    Plane::Strain => (0.5, "an incompressible body has no plane strain"),
                    Plane::Stress => (1.0, "beyond that the plane is unstable"),
                };
                between("elasticity.young", young, 0.0, f64::INFINITY, "")?;
                between("elasticity.poisson", poisson, -1.0, below, why)?;
                PlaneTensor::isotropic(young, poisson, plane)?
            }
            Material::Tetrachiral(t) => t.checked()?.tensor()?,
            Material::FromScan { scan, plane } => {
                let six = inputs.stiffness.as_ref().ok_or_else(|| {
                    Error::setting(
                        "elasticity.from_scan.file",
                        "the stiffness was not read",
                        "check its path",
                    )
                })?;
                PlaneTensor::cut(six, scan.axes.map(|a| a.index()), *plane)?
            }
        };
        Ok(tensor.turned(zeta))
    }
}

impl Vibration {
    /// The same with the density of the equivalent continuum. Blocks of a tetrachiral lattice have a side of cos β times the period and
    /// leave square holes, so the continuum has cos² β of their density (Diana 2023 leaves this out).
    pub fn of_continuum(&self, material: &Material) -> Vibration {
        let filled = match material {
            Material::Tetrachiral(lattice) => lattice.chirality_deg.to_radians().cos().powi(2),
            _ => 1.0,
        };
        Vibration {
            density: filled * self.density,
            ..*self
        }
    }
}

impl TetrachiralParams {
    /// # Errors
    /// A lattice that cannot be.
    fn checked(&self) -> Result<Tetrachiral> {
        for (key, value, low, high) in [
            ("block", self.block, 0.0, f64::INFINITY),
            ("interface", self.interface, 0.0, f64::INFINITY),
            ("young", self.young, 0.0, f64::INFINITY),
            ("poisson", self.poisson, -1.0, 1.0),
        ] {
            between(
                &format!("elasticity.tetrachiral.{key}"),
                value,
                low,
                high,
                "",
            )?;
        }
        if !(0.0..45.0).contains(&self.chirality_deg) {
            return Err(Error::setting(
                "elasticity.tetrachiral.chirality_deg",
                format!("found {}", self.chirality_deg),
                "give an angle from 0 to below 45: there the blocks' interfaces vanish",
            ));
        }
        Ok(Tetrachiral {
            block_mm: self.block,
            chirality: self.chirality_deg.to_radians(),
            interface_mm: self.interface,
            young_mpa: self.young,
            poisson: self.poisson,
        })
    }
}

/// # Errors
/// A value not strictly between `low` and `high`.
fn between(key: &str, value: f64, low: f64, high: f64, why: &str) -> Result<()> {
    if low < value && value < high {
        return Ok(());
    }
    let range = match high.is_finite() {
        true => format!("give a number above {low} and below {high}"),
        false => format!("give a finite number above {low}"),
    };
    let why = if why.is_empty() {
        String::new()
    } else {
        format!(": {why}")
    };
    Err(Error::setting(
        key,
        format!("found {value}"),
        format!("{range}{why}"),
    ))
}

impl Conduction {
    /// The conductivity in the scene's axes.
    pub fn tensor(&self) -> Result<Conductivity> {
        let [k11, k22, k12] = self.conductivity;
        let (major, minor, axis) = Conductivity::new(k11, k22, k12)?.axes();
        Conductivity::principal(major, minor, axis + self.angle_deg.to_radians())
    }
}
