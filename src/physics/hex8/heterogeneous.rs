//! Owns voxel finite elements whose moduli differ: each brick's stiffness times a factor of its own and, where Poisson's
//! ratios differ, too, one table of stencils per ratio.

use super::element::{self, Integration};
use super::kernel::{self, Elements};
use super::stencils::{Couplings, Stencils};
use crate::discretisation::voxels::VoxelMesh;
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::par;
use rayon::prelude::*;
use std::ops::Range;

/// Part of the stiffest element's factor at a node below which another does not keep parts from turning about it.
const STIFF: f32 = 0.05;

/// [`super::Hex8`] with one factor per element.
pub struct Heterogeneous {
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

impl Heterogeneous {
    /// `factor` yields an element's factor, above 0, from its index in the mesh's grid.
    pub fn new(
        mesh: VoxelMesh,
        young_mpa: f64,
        poisson: f64,
        rule: Integration,
        factor: impl Fn(usize) -> f32,
    ) -> Self {
        Heterogeneous::of_kinds(mesh, young_mpa, &[(poisson, rule)], factor, |_| 0)
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
        Heterogeneous {
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
}

impl Heterogeneous {
    /// The elements around node `i` of a segment: the bit of each, its factor and kind.
    fn around<'a>(
        &'a self,
        around: u8,
        rows: &'a [u32; 9],
        i: usize,
    ) -> impl Iterator<Item = (u8, f32, usize)> + 'a {
        let there = (0..8).filter(move |e| around >> e & 1 == 1);
        there.map(move |e| {
            let (factor, kind) = self.elements().of(kernel::low_corner(rows, i, e));
            (1 << e, factor, kind)
        })
    }

    /// The bits of the elements around node `i` of a segment that are at least [`STIFF`] of the stiffest there.
    fn stiff_around(&self, around: u8, rows: &[u32; 9], i: usize) -> u8 {
        let factors = || self.around(around, rows, i).map(|(bit, f, _)| (bit, f));
        let most = factors().fold(0.0, |most: f32, (_, f)| most.max(f));
        let stiff = factors().filter(|(_, f)| *f >= STIFF * most);
        stiff.fold(0, |bits, (bit, _)| bits | bit)
    }

    /// Couplings of a node with its 27 neighbours.
    fn sum(&self, elements: impl Iterator<Item = (u8, f32, usize)>) -> [Block; 27] {
        let mut sums = [[[0.0; 3]; 3]; 27];
        for (bit, factor, kind) in elements {
            let (places, blocks) = self.couplings[kind].of(bit);
            for (place, block) in places.iter().zip(blocks) {
                let sum = &mut sums[place.index()];
                for a in 0..3 {
                    (0..3).for_each(|b| sum[a][b] += factor * block[a][b]);
                }
            }
        }
        sums
    }
}

impl Operator<3> for Heterogeneous {
    fn sites(&self) -> usize {
        self.factor.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(par::CHUNK).enumerate().for_each(|(c, y)| {
            self.rows_f64(c * par::CHUNK..c * par::CHUNK + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_chunks_mut(par::CHUNK).enumerate().for_each(|(c, d)| {
            let sites = c * par::CHUNK..c * par::CHUNK + d.len();
            for segment in self.mesh.segments_in(sites.clone()) {
                for (i, node) in segment.nodes().enumerate() {
                    let d = &mut d[node - sites.start];
                    *d = [0.0; 3];
                    let around = self.mesh.around[node];
                    for (bit, factor, kind) in self.around(around, &segment.rows, i) {
                        let one = self.double[kind].diagonal(bit);
                        (0..3).for_each(|a| d[a] += f64::from(factor) * one[a]);
                    }
                }
            }
        });
    }
}

impl Coarsen for Heterogeneous {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        super::positions(&self.mesh, sites, x);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let (mut columns, mut blocks) = (Vec::with_capacity(27), Vec::with_capacity(27));
        for segment in self.mesh.segments_in(sites) {
            for (i, node) in (0u32..).zip(segment.nodes()) {
                let around = self.mesh.around[node];
                if around == 0 {
                    visit(node, &[], &[]);
                    continue;
                }
                let alike = self.elements().alike(around, &segment.rows, i as usize);
                let (places, whole) = self.couplings[0].of(around);
                columns.clear();
                columns.extend(
                    places
                        .iter()
                        .map(|p| segment.rows[p.row as usize] + i + u32::from(p.dx) - 1),
                );
                blocks.clear();
                match alike {
                    Some((factor, 0)) => {
                        blocks.extend(whole.iter().map(|b| b.map(|r| r.map(|v| factor * v))));
                    }
                    _ => {
                        let sums = self.sum(self.around(around, &segment.rows, i as usize));
                        blocks.extend(places.iter().map(|p| sums[p.index()]));
                    }
                }
                visit(node, &columns, &blocks);
            }
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        self.mesh.reach(sites)
    }

    /// Of the stiff elements around each node.
    fn hinges(&self, sites: Range<usize>, hinges: &mut [bool]) {
        hinges.fill(false);
        for segment in self.mesh.segments_in(sites.clone()) {
            for (i, node) in segment.nodes().enumerate() {
                if sites.contains(&node) {
                    let stiff = self.stiff_around(self.mesh.around[node], &segment.rows, i);
                    hinges[node - sites.start] = !super::share_faces(stiff);
                }
            }
        }
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        kernel::heterogeneous_f64(&self.double, self.elements(), sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        kernel::heterogeneous_f32(&self.single, self.elements(), sites, x, y);
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.eigenvalue_bound
    }
}
