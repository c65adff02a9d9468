//! Owns the lattice's moduli: which springs make it the isotropic solid.

use crate::discretisation::lattice::stencil::Structure;
use crate::error::{Error, Result};

/// Moduli of a lattice: springs of both shells and the volumetric one, all in N/mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    pub k: [f64; 2],
    pub t: f64,
}

impl Moduli {
    /// Eq 7: the lattice whose fully bonded site stores the energy of the isotropic solid (E in MPa, ν) exactly.
    ///
    /// # Errors
    /// E or ν outside the solid's range, or ν below the lattice's: a site's energy stays non-negative only while
    /// `k_s + N_s T >= 0` on both shells (SC ν ≥ −½, BCC ν ≥ −⅝, FCC ν ≥ 0).
    pub fn new(structure: Structure, lp_mm: f64, young_mpa: f64, poisson: f64) -> Result<Self> {
        check_solid(young_mpa, poisson)?;
        let least = match structure {
            Structure::Sc => -0.5,
            Structure::Bcc => -0.625,
            Structure::Fcc => 0.0,
        };
        if poisson < least {
            return Err(Error::setting(
                "poisson",
                format!(
                    "a {} lattice is stable for ν >= {least}, found {poisson}: below it a site's energy can be negative",
                    structure.name().to_uppercase()
                ),
                "use sc or bcc for ν < 0, or the voxel-fe method",
            ));
        }
        let (nu, le) = (poisson, lp_mm * young_mpa);
        let shear = le / (1.0 + nu);
        let volumetric = if nu == 0.25 {
            0.0
        } else {
            le * (4.0 * nu - 1.0) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        };
        Ok(match structure {
            Structure::Sc => Moduli {
                k: [shear, shear],
                t: volumetric / 18.0,
            },
            Structure::Bcc => Moduli {
                k: [1.5 * shear, shear],
                t: 3.0 * volumetric / 28.0,
            },
            Structure::Fcc => Moduli {
                k: [shear, 0.25 * shear],
                t: volumetric / 24.0,
            },
        })
    }
}

/// Refuses moduli no isotropic solid has.
pub fn check_solid(young_mpa: f64, poisson: f64) -> Result<()> {
    if !(young_mpa > 0.0 && young_mpa.is_finite()) {
        return Err(Error::setting(
            "young_mpa",
            format!("expected a positive modulus in MPa, found {young_mpa}"),
            "give the tissue's Young's modulus, such as 1000",
        ));
    }
    if !(poisson > -1.0 && poisson < 0.5) {
        return Err(Error::setting(
            "poisson",
            format!(
                "expected -1 < ν < 0.5, found {poisson}: at 0.5 the solid is incompressible and the moduli are infinite"
            ),
            "use a value such as 0.3, or 0.49 for nearly incompressible tissue",
        ));
    }
    Ok(())
}
