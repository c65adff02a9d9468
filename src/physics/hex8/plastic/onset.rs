//! Owns when an elastic body begins to flow: how its energy under the whole load is spread over the loads at which points would yield,
//! were nothing redistributed.

use super::{PlasticBricks, Tissue, corners};
use crate::discretisation::voxels::VoxelMesh;
use crate::operator::coarsen::Coarsen;
use crate::par::CHUNK;
use rayon::prelude::*;
use std::ops::Range;

/// The whole load is divided into so many equal parts.
const PARTS: usize = 1000;

/// The elastic response to a load that grows in proportion from 0 to 1.
pub struct Onset {
    /// Work per unit of the load under the whole load, N mm.
    pub stiffness_nmm: f64,
    /// Part of it by points that would yield in each part of the load.
    yielding: Vec<f64>,
}

impl Onset {
    /// How much of a load flowing points would shed, in units of the load. A lower bound: what they shed others must bear.
    pub fn shed(&self, load: f64) -> f64 {
        let shed = |(part, energy): (usize, &f64)| {
            energy * (load - (part as f64 + 0.5) / PARTS as f64).max(0.0)
        };
        let all: f64 = self.yielding.iter().enumerate().map(shed).sum();
        all / self.stiffness_nmm
    }

    /// The load, at most 1, that sheds as much as this.
    pub fn load_that_sheds(&self, shed: f64) -> f64 {
        let of = |part: usize| part as f64 / PARTS as f64;
        let parts: Vec<usize> = (1..=PARTS).collect();
        let below = parts.partition_point(|part| self.shed(of(*part)) <= shed);
        of(below.max(1))
    }
}

impl<E: Coarsen, T: Fn(usize) -> Tissue + Sync> PlasticBricks<'_, E, T> {
    /// Of the displacements `elastic` (mm) under the whole load.
    pub fn onset(&self, elastic: &[[f64; 3]]) -> Onset {
        let mesh: &VoxelMesh = self.mesh;
        let chunks = mesh.len().div_ceil(CHUNK);
        let parts: Vec<Vec<f64>> = (0..chunks)
            .into_par_iter()
            .map(|c| self.energies_by_yield(c * CHUNK..((c + 1) * CHUNK).min(mesh.len()), elastic))
            .collect();
        let mut yielding = vec![0.0; PARTS + 1];
        for part in &parts {
            for (sum, own) in yielding.iter_mut().zip(part) {
                *sum += own;
            }
        }
        let stiffness_nmm = yielding.iter().sum();
        yielding.truncate(PARTS);
        Onset {
            stiffness_nmm,
            yielding,
        }
    }

    /// Twice the energy of the elements of these nodes, by the part of the load that their points yield in; what does not yield last.
    fn energies_by_yield(&self, nodes: Range<usize>, u: &[[f64; 3]]) -> Vec<f64> {
        let mut sums = vec![0.0; PARTS + 1];
        for segment in self.mesh.segments_in(nodes) {
            for (i, node) in segment.nodes().enumerate() {
                if !self.mesh.has_element(node) {
                    continue;
                }
                let Tissue { elastic, law } = (self.tissue)(node);
                for strain in self.points.strains(&corners(&segment.rows, i, u)) {
                    let stress = elastic.stress(&strain);
                    let twice: f64 = stress.iter().zip(&strain).map(|(s, e)| s * e).sum();
                    let load = law.share_that_yields(&elastic, &strain);
                    let part = (load * PARTS as f64).min(PARTS as f64) as usize;
                    sums[part] += twice * self.points.weight();
                }
            }
        }
        sums
    }
}
