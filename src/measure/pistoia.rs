//! Owns Pistoia's criterion: the load at which a share of the bone exceeds a strain.
//!
//! Source: Pistoia et al. 2002, Bone 30:842: bone fails when 2 % of its tissue has an effective strain `√(2 SED / E)`
//! above 0.007. The model is linear, so its load is scaled to there.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pistoia {
    /// Share of the bone volume, 0 to 1.
    pub critical_volume: f64,
    pub critical_strain: f64,
}

impl Default for Pistoia {
    fn default() -> Self {
        Pistoia {
            critical_volume: 0.02,
            critical_strain: 0.007,
        }
    }
}

/// What the criterion says of a solved specimen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failure {
    /// Of the load applied.
    pub factor: f64,
    /// Reaction at failure, a magnitude in N.
    pub load_n: f64,
}

impl Pistoia {
    pub fn check(&self) -> Result<()> {
        let volume = self.critical_volume > 0.0 && self.critical_volume < 1.0;
        if volume && self.critical_strain > 0.0 && self.critical_strain.is_finite() {
            return Ok(());
        }
        Err(Error::setting(
            "solve.pistoia",
            format!(
                "a volume of {} at a strain of {}",
                self.critical_volume, self.critical_strain
            ),
            "give a share of the bone between 0 and 1 and a strain above 0 (usual: 0.02 at 0.007)",
        ))
    }

    /// `strains` are effective strains, each with the bone volume that has it; `reaction_n` is the force of the load that
    /// made them. None where nothing is strained.
    pub fn failure(&self, mut strains: Vec<(f32, f32)>, reaction_n: f64) -> Option<Failure> {
        strains.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let sum: f64 = strains.iter().map(|s| f64::from(s.1)).sum();
        // A hair less, so that a volume that is met exactly counts as met.
        let wanted = self.critical_volume * sum * (1.0 - 1e-9);
        let mut above = 0.0;
        let strain = strains.iter().find_map(|&(strain, volume)| {
            above += f64::from(volume);
            (above >= wanted).then_some(f64::from(strain))
        })?;
        let factor = self.critical_strain / strain;
        factor.is_finite().then_some(Failure {
            factor,
            load_n: factor * reaction_n.abs(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strain_that_the_critical_volume_exceeds_scales_the_load() {
        // A hundred voxels strained 0.0001 to 0.01: two of them reach 0.0099.
        let strains: Vec<(f32, f32)> = (1..=100).map(|i| (i as f32 * 1e-4, 1.0)).collect();
        let failure = Pistoia::default().failure(strains.clone(), -50.0).unwrap();
        assert!((failure.factor / (0.007 / 0.0099) - 1.0).abs() < 1e-6);
        assert!((failure.load_n - 50.0 * failure.factor).abs() < 1e-9);
        // Half a voxel counts by half.
        let halves = strains
            .iter()
            .flat_map(|&(s, _)| [(s, 0.5), (s, 0.5)])
            .collect();
        assert_eq!(Pistoia::default().failure(halves, -50.0).unwrap(), failure);
        assert!(Pistoia::default().failure(vec![(0.0, 1.0)], 1.0).is_none());
    }
}
