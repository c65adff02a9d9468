//! Owns voxel finite elements whose moduli differ: each brick's stiffness times a factor of its own.

use super::element::Integration;
use super::{Hex8, kernel};
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
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
        y.par_chunks_mut(par::CHUNK).enumerate().for_each(|(c, y)| {
            self.rows_f64(c * par::CHUNK..c * par::CHUNK + y.len(), x, y);
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
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        self.uniform.positions(sites, x);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let mut graded = Vec::with_capacity(27);
        self.uniform.each_row(sites, &mut |site, columns, _| {
            let mut sums = [[[0f32; 3]; 3]; 27];
            for (e, factor) in self.factors(site) {
                let (places, blocks) = self.uniform.couplings.of(1 << e);
                for (place, block) in places.iter().zip(blocks) {
                    let sum = &mut sums[place.index()];
                    for a in 0..3 {
                        (0..3).for_each(|b| sum[a][b] += factor * block[a][b]);
                    }
                }
            }
            let (places, _) = self.uniform.couplings.of(self.uniform.mesh.around[site]);
            graded.clear();
            graded.extend(places.iter().map(|p| sums[p.index()]));
            visit(site, columns, &graded);
        });
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.uniform.reach(sites)
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let Hex8 { mesh, double, .. } = &self.uniform;
        kernel::graded_f64(mesh, double, &self.factor, sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        let Hex8 { mesh, single, .. } = &self.uniform;
        kernel::graded_f32(mesh, single, &self.factor, sites, x, y);
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.uniform.eigenvalue_bound()
    }
}
