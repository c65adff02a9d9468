//! Owns voxel finite elements whose moduli differ: each brick's stiffness times a factor of its own and, where Poisson's
//! ratios differ, too, one table of stencils per ratio.

use super::element::{self, Integration};
use super::kernel::{self, Elements};
use super::stencils::{Couplings, Stencils};
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::par;
use crate::topology::voxels::VoxelMesh;
use rayon::prelude::*;
use std::ops::Range;

/// [`super::Hex8`] with one factor per element.
pub struct Graded {
    mesh: VoxelMesh,
    /// By kind of element.
    double: Vec<Stencils<f64>>,
    single: Vec<Stencils<f32>>,
    couplings: Vec<Couplings>,
    /// Of the elements one by one, so of all together.
    eigenvalue_bound: f64,
    /// By the node that is the element's corner of smallest x, y, z; not read where there is no element.
    factor: Vec<f32>,
    /// The same for the kind; empty where there is one.
    kind: Vec<u8>,
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
        Graded::of_kinds(mesh, young_mpa, &[(poisson, rule)], factor, |_| 0)
    }

    /// `kind` yields which of the Poisson's ratios (at most 256) an element has.
    pub fn of_kinds(
        mesh: VoxelMesh,
        young_mpa: f64,
        kinds: &[(f64, Integration)],
        factor: impl Fn(usize) -> f32,
        kind: impl Fn(usize) -> u8,
    ) -> Self {
        let factor = mesh
            .low_corner_elements()
            .map(|element| element.map_or(0.0, &factor))
            .collect();
        let kind = match kinds.len() {
            1 => Vec::new(),
            _ => mesh
                .low_corner_elements()
                .map(|element| element.map_or(0, &kind))
                .collect(),
        };
        let h = mesh.grid.spacing_mm;
        let matrices: Vec<_> = kinds
            .iter()
            .map(|&(nu, rule)| element::stiffness(h, young_mpa, nu, rule))
            .collect();
        let double: Vec<_> = matrices.iter().map(Stencils::new).collect();
        Graded {
            single: double.iter().map(Stencils::to_f32).collect(),
            couplings: double.iter().map(Couplings::new).collect(),
            eigenvalue_bound: matrices
                .iter()
                .map(element::eigenvalue_bound)
                .fold(0.0, f64::max),
            mesh,
            double,
            factor,
            kind,
        }
    }

    pub fn mesh(&self) -> &VoxelMesh {
        &self.mesh
    }

    /// Factor and kind of the element whose corner of smallest x, y, z is a node.
    pub fn stiffness_of(&self, node: usize) -> (f32, u8) {
        let kind = self.kind.get(node).copied().unwrap_or(0);
        (self.factor[node], kind)
    }

    fn elements(&self) -> Elements<'_> {
        Elements {
            mesh: &self.mesh,
            factor: &self.factor,
            kind: &self.kind,
        }
    }

    /// The existing elements around a site, each with its factor and kind.
    fn around(&self, site: usize) -> impl Iterator<Item = (usize, f32, usize)> + '_ {
        let around = self.mesh.around[site];
        let rows = self
            .mesh
            .segments_in(site..site + 1)
            .next()
            .map_or([0; 9], |s| s.rows);
        (0..8usize)
            .filter(move |e| around >> e & 1 == 1)
            .map(move |e| {
                let low = kernel::low_corner(&rows, 0, e);
                let kind = self.kind.get(low).map_or(0, |&k| k as usize);
                (e, self.factor[low], kind)
            })
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
            for (e, factor, kind) in self.around(site) {
                let one = self.double[kind].diagonal(1 << e);
                (0..3).for_each(|a| d[a] += f64::from(factor) * one[a]);
            }
        });
    }
}

impl Coarsen for Graded {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        super::positions(&self.mesh, sites, x);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let (mut columns, mut blocks) = (Vec::with_capacity(27), Vec::with_capacity(27));
        for segment in self.mesh.segments_in(sites) {
            for (i, node) in (0u32..).zip(segment.nodes()) {
                let mut sums = [[[0f32; 3]; 3]; 27];
                for (e, factor, kind) in self.around(node) {
                    let (places, blocks) = self.couplings[kind].of(1 << e);
                    for (place, block) in places.iter().zip(blocks) {
                        let sum = &mut sums[place.index()];
                        for a in 0..3 {
                            (0..3).for_each(|b| sum[a][b] += factor * block[a][b]);
                        }
                    }
                }
                let (places, _) = self.couplings[0].of(self.mesh.around[node]);
                columns.clear();
                blocks.clear();
                for p in places {
                    columns.push(segment.rows[p.row as usize] + i + u32::from(p.dx) - 1);
                    blocks.push(sums[p.index()]);
                }
                visit(node, &columns, &blocks);
            }
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.mesh.reach(sites)
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        kernel::graded_f64(&self.double, self.elements(), sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        kernel::graded_f32(&self.single, self.elements(), sites, x, y);
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.eigenvalue_bound
    }
}
