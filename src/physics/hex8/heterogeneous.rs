//! Owns voxel finite elements whose moduli differ: each brick's stiffness times a factor of its own and, where Poisson's
//! ratios differ, too, one set of coefficients per ratio.

use super::element::{self, Integration};
use super::kernel::{self, Elements};
use super::modes::Modal;
use super::stencils::{Couplings, Stencils};
use crate::discretisation::voxels::VoxelMesh;
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use rayon::prelude::*;
use std::ops::Range;

/// Part of the stiffest element's factor at a node below which another does not keep parts from turning about it.
const STIFF: f32 = 0.05;

/// [`super::Hex8`] with one factor per element.
pub struct Heterogeneous {
    mesh: VoxelMesh,
    /// By kind of element.
    modal: Vec<Modal<f64>>,
    stencils: Vec<Stencils>,
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
        let stencils: Vec<_> = matrices.iter().map(Stencils::new).collect();
        Heterogeneous {
            modal: matrices.iter().map(Modal::new).collect(),
            couplings: stencils.iter().map(Couplings::new).collect(),
            eigenvalue_bound: matrices
                .iter()
                .map(element::eigenvalue_bound)
                .fold(0.0, f64::max),
            mesh,
            stencils,
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

    fn elements<'a, S>(&'a self, modal: &'a [Modal<[S; 8]>]) -> Elements<'a, S> {
        Elements {
            mesh: &self.mesh,
            modal,
            factor: &self.factor,
            kind: &self.kind,
        }
    }
}

/// The node that is the corner of smallest x, y, z of element `e` around node `i` of a segment.
#[inline(always)]
pub(super) fn low_corner(rows: &[u32; 9], i: usize, e: usize) -> usize {
    let (x, y, z) = (e & 1, e >> 1 & 1, e >> 2);
    rows[y + 3 * z] as usize + i + x - 1
}

impl Heterogeneous {
    /// Factor and kind of all elements `around` node `i` of a segment, if they are alike. There is one at least.
    #[inline(always)]
    fn alike(&self, around: u8, rows: &[u32; 9], i: usize) -> Option<(f32, usize)> {
        let lowest = around.trailing_zeros() as usize & 7;
        let first = self.of(low_corner(rows, i, lowest));
        let mut alike = true;
        for e in 0..8 {
            // Where there is no element, the first one again: no branch.
            let there = around >> e & 1 == 1;
            let e = if there { e } else { lowest };
            alike &= self.of(low_corner(rows, i, e)) == first;
        }
        alike.then_some(first)
    }

    #[inline(always)]
    fn of(&self, low: usize) -> (f32, usize) {
        let kind = match self.kind.is_empty() {
            true => 0,
            false => usize::from(self.kind[low]),
        };
        (self.factor[low], kind)
    }

    /// The elements around node `i` of a segment: the bit of each, its factor and kind.
    fn around<'a>(
        &'a self,
        around: u8,
        rows: &'a [u32; 9],
        i: usize,
    ) -> impl Iterator<Item = (u8, f32, usize)> + 'a {
        let there = (0..8).filter(move |e| around >> e & 1 == 1);
        there.map(move |e| {
            let (factor, kind) = self.of(low_corner(rows, i, e));
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
        let chunk = self.chunk();
        y.par_chunks_mut(chunk).enumerate().for_each(|(c, y)| {
            self.rows_f64(c * chunk..c * chunk + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        let chunk = self.chunk();
        d.par_chunks_mut(chunk).enumerate().for_each(|(c, d)| {
            let sites = c * chunk..c * chunk + d.len();
            for segment in self.mesh.segments_in(sites.clone()) {
                for (i, node) in segment.nodes().enumerate() {
                    let d = &mut d[node - sites.start];
                    *d = [0.0; 3];
                    let around = self.mesh.around[node];
                    for (bit, factor, kind) in self.around(around, &segment.rows, i) {
                        let one = self.stencils[kind].diagonal(bit);
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
                let alike = self.alike(around, &segment.rows, i as usize);
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

    fn each_diagonal(&self, sites: Range<usize>, visit: &mut dyn FnMut(usize, &Block)) {
        for segment in self.mesh.segments_in(sites) {
            for (i, node) in segment.nodes().enumerate() {
                let mut sum = [[0.0; 3]; 3];
                for (bit, factor, kind) in self.around(self.mesh.around[node], &segment.rows, i) {
                    let own = self.stencils[kind].own(bit);
                    for a in 0..3 {
                        (0..3).for_each(|b| sum[a][b] += factor * own[a][b]);
                    }
                }
                visit(node, &sum);
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

    fn chunk(&self) -> usize {
        kernel::chunk(&self.mesh)
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let modal: Vec<_> = self.modal.iter().map(kernel::wide).collect();
        kernel::rows(self.elements(&modal), sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        let single = |m: &Modal<f64>| kernel::wide(&m.map(|v| v as f32));
        let modal: Vec<_> = self.modal.iter().map(single).collect();
        kernel::rows(self.elements(&modal), sites, x, y);
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.eigenvalue_bound
    }
}
