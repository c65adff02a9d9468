//! Owns what a specimen's voxels are made of, from the settings and the scan's values: one solid, or a modulus per voxel.

use crate::error::{Error, Result};
use crate::physics::material::{Law, Material, Solid};
use crate::pipeline::apparent::params::SolveParams;
use crate::result::settings::Settings;
use crate::volume::Specimen;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A specimen's tissue.
#[derive(Debug, Clone, PartialEq)]
pub enum Tissue {
    /// The same everywhere; nothing is kept per voxel.
    Uniform(Solid),
    /// A modulus for each voxel.
    Mixed(Mixed),
}

/// Tissue that differs from voxel to voxel.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixed {
    /// Mean over bone voxels: the modulus that the voxels' factors multiply.
    pub mean_mpa: f64,
    /// Young's modulus of each voxel over the mean; not read in pores.
    pub factor: Vec<f32>,
    /// The Poisson's ratios that occur.
    pub poissons: Vec<f64>,
    /// Which of them, per voxel; empty where there is one.
    pub kind: Vec<u8>,
}

impl Tissue {
    /// The tissue of a specimen under the settings.
    ///
    /// # Errors
    /// A material that varies for a specimen without grey values, voxels without a modulus.
    pub fn of(specimen: &Specimen, params: &SolveParams) -> Result<Self> {
        let all_alike = Solid {
            young_mpa: params.young_mpa,
            poisson: params.poisson,
        };
        let Some(material) = &params.material else {
            return Ok(Tissue::Uniform(all_alike));
        };
        let Some(grey) = &specimen.grey else {
            return Err(Error::setting(
                "solve.material",
                "a modulus per voxel needs the scan's values, and only the mask was kept",
                "segment the scan again without --no-grey (or with --labels for a labelled scan)",
            ));
        };
        if grey.grid.n != specimen.bone.grid.n {
            return Err(Error::setting(
                "solve.material",
                "the scan's values are on another grid than the mask: a coarser or cropped copy has lost them",
                "solve at the scan's own resolution",
            ));
        }
        let (bone, grey) = (specimen.bone.as_slice(), grey.as_slice());
        let young: Vec<f32> = bone
            .par_iter()
            .zip(grey)
            .map(|(&bone, &value)| match bone {
                0 => 0.0,
                _ => material
                    .young_mpa(value, params.young_mpa)
                    .map_or(f32::NAN, |e| e as f32),
            })
            .collect();
        refuse_without_modulus(material, bone, grey, &young)?;
        let (kind, poissons) = poissons(material, params.poisson, bone, grey);
        Ok(tissue_of(bone, young, kind, poissons))
    }

    /// Largest modulus over the smallest, of the voxels of `bone`.
    pub fn contrast(&self, bone: &[u8]) -> f64 {
        let Tissue::Mixed(mixed) = self else {
            return 1.0;
        };
        let factors = bone.iter().zip(&mixed.factor).filter(|(b, _)| **b != 0);
        let (least, most) = factors.fold((f32::INFINITY, 0.0f32), |(least, most), (_, &f)| {
            (least.min(f), most.max(f))
        });
        f64::from(most / least)
    }

    /// Mean modulus over the bone.
    pub fn mean_mpa(&self) -> f64 {
        match self {
            Tissue::Uniform(solid) => solid.young_mpa,
            Tissue::Mixed(mixed) => mixed.mean_mpa,
        }
    }

    /// The row's columns of tissue: the mean modulus, the one Poisson's ratio (where there are several, the settings'),
    /// the law in words.
    pub fn label(&self, key: Settings, params: &SolveParams) -> Settings {
        let poisson = match self {
            Tissue::Uniform(solid) => solid.poisson,
            Tissue::Mixed(mixed) if mixed.poissons.len() == 1 => mixed.poissons[0],
            Tissue::Mixed(_) => params.poisson,
        };
        Settings {
            young_mpa: self.mean_mpa(),
            poisson,
            material: params.material.as_ref().map(Material::words),
            ..key
        }
    }
}

/// Bone voxels without a modulus above 0 are an error that names their values.
fn refuse_without_modulus(
    material: &Material,
    bone: &[u8],
    grey: &[f32],
    young: &[f32],
) -> Result<()> {
    let without = |i: &usize| bone[*i] != 0 && !(young[*i] > 0.0 && young[*i].is_finite());
    let count = (0..bone.len()).into_par_iter().filter(without).count();
    if count == 0 {
        return Ok(());
    }
    let mut values = BTreeMap::new();
    for i in (0..bone.len()).filter(without).take(1_000_000) {
        *values.entry(grey[i].to_string()).or_insert(0u64) += 1;
    }
    let some: Vec<&str> = values.keys().take(5).map(String::as_str).collect();
    let labelled = matches!(material.law, Law::Labels(_));
    Err(Error::setting(
        "solve.material",
        format!(
            "{count} bone voxels have no modulus above 0 by {} (values {}{})",
            material.words(),
            some.join(", "),
            if values.len() > 5 { ", …" } else { "" }
        ),
        if labelled {
            "add these labels to the table, or segment again without them"
        } else {
            "raise the lower threshold of bone, or give a least modulus (--least-mpa)"
        },
    ))
}

/// Which Poisson's ratio each voxel has, and the ratios that occur.
fn poissons(material: &Material, poisson: f64, bone: &[u8], grey: &[f32]) -> (Vec<u8>, Vec<f64>) {
    let Law::Labels(labels) = &material.law else {
        return (Vec::new(), vec![poisson]);
    };
    let mut found: Vec<f64> = Vec::new();
    let of_label: Vec<u8> = labels
        .iter()
        .map(|label| {
            let nu = label.poisson.unwrap_or(poisson);
            let at = found.iter().position(|&other| other == nu);
            at.unwrap_or_else(|| {
                found.push(nu);
                found.len() - 1
            }) as u8
        })
        .collect();
    if found.len() == 1 {
        return (Vec::new(), found);
    }
    let kind = |(&bone, &value): (&u8, &f32)| match material.label(value) {
        Some(label) if bone != 0 => of_label[label],
        _ => 0,
    };
    (bone.par_iter().zip(grey).map(kind).collect(), found)
}

/// One solid where all voxels turn out alike.
fn tissue_of(bone: &[u8], mut young: Vec<f32>, kind: Vec<u8>, poissons: Vec<f64>) -> Tissue {
    let first = (0..bone.len()).find(|&i| bone[i] != 0);
    let alike = first.filter(|&f| {
        let same = |i: usize| bone[i] == 0 || young[i] == young[f];
        (0..bone.len()).into_par_iter().all(same) && kind.iter().all(|&k| k == kind[0])
    });
    if let Some(f) = alike {
        return Tissue::Uniform(Solid {
            young_mpa: f64::from(young[f]),
            poisson: poissons[kind.first().map_or(0, |_| kind[f]) as usize],
        });
    }
    let sum: f64 = young.iter().map(|&e| f64::from(e)).sum();
    let count = bone.iter().filter(|&&b| b != 0).count();
    let mean_mpa = sum / count as f64;
    young
        .par_iter_mut()
        .for_each(|e| *e = (f64::from(*e) / mean_mpa) as f32);
    Tissue::Mixed(Mixed {
        mean_mpa,
        factor: young,
        poissons,
        kind,
    })
}
