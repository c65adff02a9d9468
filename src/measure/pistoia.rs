//! Owns Pistoia's criterion: the load at which a share of the bone exceeds a strain.
//!
//! Source: Pistoia et al. 2002, Bone 30:842: bone fails when 2 % of its tissue has an effective strain `√(2 SED / E)`
//! above 0.007. The model is linear, so its load is scaled to there. The two numbers belong to strain energy densities of the
//! strain at each element's centre.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The criterion's two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Pistoia {
    /// Share of the bone volume, 0 to 1.
    pub critical_volume: f64,
    /// Effective strain `√(2 SED / E)` that this share must exceed.
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
    pub criterion: Pistoia,
    /// Effective strain that the critical volume exceeds under the load applied.
    pub strain_at_volume: f64,
    /// Of the load applied.
    pub factor: f64,
}

/// Critical volumes of the table that the field prints, in addition to the one asked for.
pub const TABLE: [f64; 7] = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07];

impl Pistoia {
    /// Refuses numbers that are no criterion.
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

    /// The criterion at its own volume and, at the same strain, at those of [`TABLE`], by rising volume. `strains` are effective
    /// strains, each with the bone volume that has it. Empty where nothing is strained.
    pub fn failures(&self, mut strains: Vec<(f32, f32)>) -> Vec<Failure> {
        strains.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let sum: f64 = strains.iter().map(|s| f64::from(s.1)).sum();
        let mut volumes = TABLE.to_vec();
        if !volumes.contains(&self.critical_volume) {
            volumes.push(self.critical_volume);
            volumes.sort_by(f64::total_cmp);
        }
        let of = |volume: f64| {
            // A hair less, so that a volume that is met exactly counts as met.
            let strain = exceeded(&strains, volume * sum * (1.0 - 1e-9))?;
            let factor = self.critical_strain / strain;
            factor.is_finite().then_some(Failure {
                criterion: Pistoia {
                    critical_volume: volume,
                    ..*self
                },
                strain_at_volume: strain,
                factor,
            })
        };
        volumes.into_iter().filter_map(of).collect()
    }
}

/// The strain at which the volume of falling `strains` reaches `volume`.
fn exceeded(strains: &[(f32, f32)], volume: f64) -> Option<f64> {
    let mut above = 0.0;
    strains.iter().find_map(|&(strain, part)| {
        above += f64::from(part);
        (above >= volume).then_some(f64::from(strain))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn own(strains: Vec<(f32, f32)>) -> Option<Failure> {
        let failures = Pistoia::default().failures(strains);
        let own = |f: &Failure| f.criterion == Pistoia::default();
        failures.into_iter().find(own)
    }

    #[test]
    fn the_strain_that_the_critical_volume_exceeds_scales_the_load() {
        // A hundred voxels strained 0.0001 to 0.01: two of them reach 0.0099.
        let strains: Vec<(f32, f32)> = (1..=100).map(|i| (i as f32 * 1e-4, 1.0)).collect();
        let failure = own(strains.clone()).unwrap();
        assert!((failure.factor / (0.007 / 0.0099) - 1.0).abs() < 1e-6);
        // Half a voxel counts by half.
        let halves = strains
            .iter()
            .flat_map(|&(s, _)| [(s, 0.5), (s, 0.5)])
            .collect();
        assert_eq!(own(halves), Some(failure));
        assert!(own(vec![(0.0, 1.0)]).is_none());
    }

    #[test]
    fn the_table_has_the_usual_volumes_and_the_one_asked_for() {
        let strains: Vec<(f32, f32)> = (1..=1000).map(|i| (i as f32 * 1e-5, 1.0)).collect();
        let criterion = Pistoia {
            critical_volume: 0.035,
            critical_strain: 0.005,
        };
        let table = criterion.failures(strains);
        let volumes: Vec<f64> = table.iter().map(|f| f.criterion.critical_volume).collect();
        assert_eq!(volumes, [0.01, 0.02, 0.03, 0.035, 0.04, 0.05, 0.06, 0.07]);
        for f in &table {
            // The most strained thousandths, counted from the top.
            let wanted = 1e-5 * (1001.0 - 1000.0 * f.criterion.critical_volume);
            assert!((f.strain_at_volume / wanted - 1.0).abs() < 1e-6, "{f:?}");
            assert!((f.factor * f.strain_at_volume / 0.005 - 1.0).abs() < 1e-12);
        }
    }
}
