//! Owns the tensors of a scene in its own axes.

use super::{Conduction, Elasticity, TetrachiralParams};
use crate::error::{Error, Result};
use crate::physics::anisotropic::conductivity::Conductivity;
use crate::physics::anisotropic::tensor::PlaneTensor;
use crate::physics::anisotropic::tetrachiral::Tetrachiral;
use crate::stage::scene::Inputs;

impl Elasticity {
    /// The stiffness in the scene's axes.
    pub fn tensor(&self, inputs: &Inputs) -> Result<PlaneTensor> {
        let zeta = self.angle_deg.to_radians();
        let tensor = match (&self.moduli, self.young, &self.tetrachiral, &self.from_scan) {
            (Some(moduli), None, None, None) => PlaneTensor::from_moduli(*moduli)?,
            (None, Some(young), None, None) => {
                PlaneTensor::isotropic(young, self.poisson.unwrap_or(0.0), self.plane)?
            }
            (None, None, Some(t), None) => t.lattice().tensor()?,
            (None, None, None, Some(scan)) => {
                let six = inputs.stiffness.as_ref().ok_or_else(|| {
                    Error::setting(
                        "elasticity.from_scan.file",
                        "the stiffness was not read",
                        "check its path",
                    )
                })?;
                PlaneTensor::cut(six, scan.axes.map(|a| a.index()), self.plane)?
            }
            _ => {
                return Err(Error::setting(
                    "elasticity",
                    "expected exactly one of moduli, young (with poisson), tetrachiral, from_scan",
                    "keep one",
                ));
            }
        };
        Ok(tensor.turned(zeta))
    }
}

impl TetrachiralParams {
    fn lattice(&self) -> Tetrachiral {
        Tetrachiral {
            block_mm: self.block,
            chirality: self.chirality_deg.to_radians(),
            interface_mm: self.interface,
            young_mpa: self.young,
            poisson: self.poisson,
        }
    }
}

impl Conduction {
    /// The conductivity in the scene's axes.
    pub fn tensor(&self) -> Result<Conductivity> {
        let [k11, k22, k12] = self.conductivity;
        let (major, minor, axis) = Conductivity::new(k11, k22, k12)?.axes();
        Conductivity::principal(major, minor, axis + self.angle_deg.to_radians())
    }
}
