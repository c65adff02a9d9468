//! Owns what the bonds of a scene are by direction: micromoduli, critical energies and the fracture energy that comes of them,
//! micro-conductivities (Figures 2, 3 and 14 to 18).

use super::Setup;
use crate::error::Result;
use crate::physics::continuum_molecular::toughness::{critical_energy, fracture_energy};
use crate::scene::continuum_molecular::{Molecular, Problem};
use crate::scene::frame::Directions;
use crate::scene::setting::Inputs;

impl Setup {
    /// Values every degree of a turn, of the material as the scene file turns it, without Λ. Micromoduli k_n, k_t and critical
    /// energies w_c are by the direction of the bond, the fracture energy by that of the crack's normal.
    ///
    /// # Errors
    /// Materials that the scene cannot have.
    pub fn directions(&self, model: &Molecular, inputs: &Inputs) -> Result<Directions> {
        let mut all = Directions::default();
        if let Some(elasticity) = model.problem.elasticity() {
            let law = self.micromoduli(elasticity, &elasticity.tensor(inputs)?)?;
            all.add("k_n", |psi| law.axial(psi));
            all.add("k_t", |psi| law.shear(psi));
            if let Problem::Fracture { fracture, .. } = &model.problem {
                let [first, second] = fracture.energy;
                let zeta = elasticity.angle_deg.to_radians();
                let horizon = self.horizon();
                let law = critical_energy(
                    first,
                    second,
                    horizon,
                    fracture.exponent,
                    fracture.frequency,
                    zeta,
                )?;
                all.add("w_c", |psi| law.at(psi));
                all.add("fracture_energy", |normal| {
                    fracture_energy(&law, horizon, normal)
                });
            }
        }
        if let Some(conduction) = model.problem.conduction() {
            let share = self.attenuation.conducted_share();
            let tensor = conduction.tensor()?;
            let law = tensor.microconductivity(self.horizon(), conduction.exponent)?;
            all.add("k_conduction", |psi| law.at(psi) / share);
        }
        Ok(all)
    }
}
