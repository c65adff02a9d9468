//! Owns what a lattice takes of tissue that differs from voxel to voxel: springs go with `E / (1 + ν)`, the volumetric term
//! with `E (4 ν − 1) / ((1 + ν) (1 − 2 ν))` (Zojaji et al. 2024, eq 7), each relative to one solid's.

use crate::error::Result;
use crate::physics::lattice::Moduli;
use crate::physics::material::Solid;
use crate::pipeline::apparent::tissue::{Mixed, Tissue};
use crate::pipeline::lattice::Case;
use std::borrow::Cow;

/// A lattice's tissue.
pub struct Blend<'a> {
    /// Moduli of the solid that the voxels are relative to.
    pub moduli: Moduli,
    /// Springs of each voxel; None where all are alike.
    pub springs: Option<Cow<'a, [f32]>>,
    /// Volumetric term of each voxel, where labels differ in ν: elsewhere it goes as the springs do.
    pub volumetric: Option<Vec<f32>>,
}

impl<'a> Blend<'a> {
    /// # Errors
    /// A Poisson's ratio below what the structure is stable for.
    pub fn of(tissue: &'a Tissue, case: &Case) -> Result<Self> {
        let moduli =
            |solid: &Solid| Moduli::new(case.structure, case.lp_mm, solid.young_mpa, solid.poisson);
        let mixed = match tissue {
            Tissue::Uniform(solid) => {
                return Ok(Blend {
                    moduli: moduli(solid)?,
                    springs: None,
                    volumetric: None,
                });
            }
            Tissue::Mixed(mixed) => mixed,
        };
        let young_mpa = mixed.mean_mpa;
        for &poisson in &mixed.poissons {
            moduli(&Solid { young_mpa, poisson })?;
        }
        // The one whose volumetric term is largest: at ν = ¼ there is none to be relative to.
        let largest = |a: &&f64, b: &&f64| dilation(**a).abs().total_cmp(&dilation(**b).abs());
        let poisson = *mixed
            .poissons
            .iter()
            .max_by(largest)
            .expect("tissue has a ratio");
        let moduli = moduli(&Solid { young_mpa, poisson })?;
        if mixed.kind.is_empty() {
            return Ok(Blend {
                moduli,
                springs: Some(Cow::Borrowed(&mixed.factor)),
                volumetric: None,
            });
        }
        let springs = relative(mixed, |nu| (1.0 + poisson) / (1.0 + nu));
        Ok(Blend {
            moduli,
            springs: Some(Cow::Owned(springs)),
            volumetric: Some(relative(mixed, |nu| dilation(nu) / dilation(poisson))),
        })
    }
}

fn dilation(nu: f64) -> f64 {
    (4.0 * nu - 1.0) / ((1.0 + nu) * (1.0 - 2.0 * nu))
}

/// Each voxel's modulus times what its ratio makes of it.
fn relative(mixed: &Mixed, of_ratio: impl Fn(f64) -> f64) -> Vec<f32> {
    let by_kind: Vec<f64> = mixed.poissons.iter().map(|&nu| of_ratio(nu)).collect();
    let voxels = mixed.factor.iter().zip(&mixed.kind);
    voxels
        .map(|(&e, &kind)| (f64::from(e) * by_kind[usize::from(kind)]) as f32)
        .collect()
}
