//! Owns voxel finite elements whose moduli differ: each brick's stiffness times a factor of its own.

use super::element::Integration;
use super::{Hex8, kernel};
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen};
use crate::par;
use crate::topology::voxels::VoxelMesh;
use rayon::prelude::*;
use std::ops::Range;

/// [`Hex8`] with one factor per element.
pub struct Graded {
    uniform: Hex8,
    /// By the node that is the element's corner of smallest x, y, z; not read where there is no element.
    factor: Vec<f32>,
}

impl Graded {
    /// `factor` yields an element's factor, above 0, from its index in the mesh's grid.
    pub fn new(
        mesh: VoxelMesh,
        young_mpa: f64,
        poisson: f64,
        rule: Integration,
        factor: impl Fn(usize) -> f32,
    ) -> Self {
        let factor = mesh
            .low_corner_elements()
            .map(|element| element.map_or(0.0, &factor))
            .collect();
        Graded {
            uniform: Hex8::new(mesh, young_mpa, poisson, rule),
            factor,
        }
    }

    pub fn mesh(&self) -> &VoxelMesh {
        &self.uniform.mesh
    }

    /// The existing elements around a site, each with its factor.
    fn factors(&self, site: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let around = self.uniform.mesh.around[site];
        let rows = self
            .uniform
            .mesh
            .segments_in(site..site + 1)
            .next()
            .map_or([0; 9], |s| s.rows);
        (0..8usize)
            .filter(move |e| around >> e & 1 == 1)
            .map(move |e| (e, self.factor[kernel::low_corner(&rows, 0, e)]))
    }
}

impl Operator<3> for Graded {
    fn sites(&self) -> usize {
        self.factor.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let Hex8 { mesh, double, .. } = &self.uniform;
        y.par_chunks_mut(par::CHUNK).enumerate().for_each(|(c, y)| {
            let nodes = c * par::CHUNK..c * par::CHUNK + y.len();
            kernel::graded_f64(mesh, double, &self.factor, nodes, x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(site, d)| {
            *d = [0.0; 3];
            for (e, factor) in self.factors(site) {
                let one = self.uniform.double.diagonal(1 << e);
                (0..3).for_each(|a| d[a] += f64::from(factor) * one[a]);
            }
        });
    }
}

impl Coarsen for Graded {
    fn position(&self, site: usize) -> [f64; 3] {
        self.uniform.position(site)
    }

    fn row(&self, site: usize, blocks: &mut Vec<(u32, Block)>) {
        let first = blocks.len();
        self.uniform.row(site, blocks);
        let mut sums = [[[0f32; 3]; 3]; 27];
        for (e, factor) in self.factors(site) {
            for c in self.uniform.couplings.of(1 << e) {
                let sum = &mut sums[3 * c.row as usize + c.dx as usize];
                for a in 0..3 {
                    (0..3).for_each(|b| sum[a][b] += factor * c.block[a][b]);
                }
            }
        }
        let neighbours = self.uniform.couplings.of(self.uniform.mesh.around[site]);
        for (c, entry) in neighbours.iter().zip(&mut blocks[first..]) {
            entry.1 = sums[3 * c.row as usize + c.dx as usize];
        }
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        let Hex8 { mesh, single, .. } = &self.uniform;
        kernel::graded_f32(mesh, single, &self.factor, sites, x, y);
    }
}
