//! Ten-node tetrahedra of linear elastic bone with straight edges.
//!
//! Strains are linear in such an element, so its stiffness is exact in closed form: strains at the four corners, and the
//! integrals of products of two linear functions. The operator is never assembled. Nodes go in blocks; the elements around a
//! block are worked out eight at a time and added up in the block alone, so that results do not depend on threads.

pub mod element;
mod kernel;
mod linear;
pub mod strain;

use crate::discretisation::tetrahedra::nodes::TetMesh;
use crate::operator::Operator;
use crate::operator::assembled::Assembled;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use element::Shape;
use linear::Corners;
use rayon::prelude::*;
use std::ops::Range;

/// Nodes per block: those of one call of the solver.
const BLOCK: usize = 4096;

/// Nodes whose columns' range is known.
const SPAN: usize = 256;

/// Isotropic bone, whose modulus may differ from element to element.
pub struct Tet10 {
    pub mesh: TetMesh,
    /// Lamé's moduli for a factor of 1, in MPa.
    lambda: f64,
    mu: f64,
    /// Young's modulus of each element over the mean; None: 1 everywhere.
    factor: Option<Vec<f32>>,
    shapes: Vec<[f32; 10]>,
    /// Elements around each block of nodes, ascending.
    blocks: Vec<Vec<u32>>,
    /// Elements around each node: `16 element + local node`, and where each node's begin.
    starts: Vec<u32>,
    around: Vec<u32>,
    reaches: Vec<[u32; 2]>,
    corners: Corners,
    /// What the corners alone make, for multigrid.
    linear: Assembled,
}

impl Tet10 {
    /// `factor`: Young's modulus of each element over `young_mpa`.
    ///
    /// # Panics
    /// At 2²⁸ elements or more.
    pub fn new(mesh: TetMesh, young_mpa: f64, poisson: f64, factor: Option<Vec<f32>>) -> Tet10 {
        assert!(mesh.elements.len() < 1 << 28, "too many elements");
        let nodes = mesh.nodes_mm.len();
        let shapes = (0..mesh.elements.len())
            .into_par_iter()
            .map(|e| shape(&mesh, factor.as_deref(), e).packed())
            .collect();
        let mut starts = vec![0u32; nodes + 1];
        mesh.elements
            .iter()
            .flatten()
            .for_each(|n| starts[*n as usize + 1] += 1);
        for n in 0..nodes {
            starts[n + 1] += starts[n];
        }
        let mut next = starts.clone();
        let mut around = vec![0u32; 10 * mesh.elements.len()];
        let mut blocks = vec![Vec::new(); nodes.div_ceil(BLOCK)];
        for (e, ten) in mesh.elements.iter().enumerate() {
            for (local, n) in ten.iter().enumerate() {
                let next = &mut next[*n as usize];
                around[*next as usize] = (16 * e + local) as u32;
                *next += 1;
                let block: &mut Vec<u32> = &mut blocks[*n as usize / BLOCK];
                if block.last() != Some(&(e as u32)) {
                    block.push(e as u32);
                }
            }
        }
        let span = |s: usize| {
            let nodes = s * SPAN..((s + 1) * SPAN).min(nodes);
            let of = starts[nodes.start] as usize..starts[nodes.end] as usize;
            let columns = around[of]
                .iter()
                .flat_map(|a| mesh.elements[*a as usize / 16]);
            columns.fold([u32::MAX, 0], |[low, high], n| [low.min(n), high.max(n)])
        };
        let reaches = (0..nodes.div_ceil(SPAN))
            .into_par_iter()
            .map(span)
            .collect();
        let corners = Corners::of(&mesh);
        let mut model = Tet10 {
            lambda: young_mpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young_mpa / (2.0 * (1.0 + poisson)),
            factor,
            shapes,
            blocks,
            starts,
            around,
            reaches,
            linear: Assembled::of_rows(Vec::new(), 0.0, |_, _, _| ()),
            corners: Corners::of(&TetMesh::default()),
            mesh,
        };
        model.linear = linear::assemble(&model, &corners);
        model.corners = corners;
        model
    }

    /// Mean number of blocks of nodes that an element stands about.
    pub fn repeats(&self) -> f64 {
        let all: usize = self.blocks.iter().map(Vec::len).sum();
        all as f64 / self.mesh.elements.len() as f64
    }

    pub fn nodes(&self) -> usize {
        self.mesh.nodes_mm.len()
    }

    /// Young's modulus of an element over the mean.
    pub fn factor(&self, e: usize) -> f64 {
        self.factor.as_ref().map_or(1.0, |f| f64::from(f[e]))
    }

    /// Lamé's moduli of an element.
    pub fn lame_mpa(&self, e: usize) -> [f64; 2] {
        [self.lambda, self.mu].map(|m| m * self.factor(e))
    }

    /// Of an element, with its factor in the volume.
    pub fn shape(&self, e: usize) -> Shape {
        shape(&self.mesh, self.factor.as_deref(), e)
    }

    /// `around` of the nodes of a range, node by node.
    fn around(&self, node: usize) -> &[u32] {
        &self.around[self.starts[node] as usize..self.starts[node + 1] as usize]
    }
}

fn shape(mesh: &TetMesh, factor: Option<&[f32]>, e: usize) -> Shape {
    let ten = &mesh.elements[e];
    let mut shape = Shape::of(std::array::from_fn(|c| mesh.nodes_mm[ten[c] as usize]));
    shape.volume *= factor.map_or(1.0, |f| f64::from(f[e]));
    shape
}

impl Operator<3> for Tet10 {
    fn sites(&self) -> usize {
        self.nodes()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(BLOCK).enumerate().for_each(|(b, y)| {
            self.rows_f64(b * BLOCK..b * BLOCK + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(node, d)| {
            *d = [0.0; 3];
            for a in self.around(node) {
                let (e, local) = (*a as usize / 16, *a as usize % 16);
                let own = self.shape(e).block([self.lambda, self.mu], local, local);
                (0..3).for_each(|c| d[c] += own[c][c]);
            }
        });
    }
}

impl Coarsen for Tet10 {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        x.copy_from_slice(&self.mesh.nodes_mm[sites]);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let reach = self.reach(sites.clone());
        let mut places = vec![0u64; reach.len()];
        let (mut columns, mut blocks) = (Vec::<u32>::new(), Vec::<Block>::new());
        let moduli = [self.lambda as f32, self.mu as f32];
        for (k, node) in sites.enumerate() {
            let stamp = (k as u64 + 1) << 32;
            columns.clear();
            blocks.clear();
            for a in self.around(node) {
                let (e, local) = (*a as usize / 16, *a as usize % 16);
                let row = element::row(&self.shapes[e], moduli, local);
                for (n, block) in self.mesh.elements[e].iter().zip(&row) {
                    let place = &mut places[*n as usize - reach.start];
                    if *place >> 32 == stamp >> 32 {
                        let sum = &mut blocks[(*place & 0xffff_ffff) as usize];
                        let pairs = sum.as_flattened_mut().iter_mut().zip(block.as_flattened());
                        pairs.for_each(|(s, b)| *s += b);
                    } else {
                        *place = stamp | blocks.len() as u64;
                        columns.push(*n);
                        blocks.push(*block);
                    }
                }
            }
            visit(node, &columns, &blocks);
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let spans = sites.start / SPAN..sites.end.div_ceil(SPAN);
        let range = self.reaches[spans]
            .iter()
            .fold([u32::MAX, 0], |[a, b], [low, high]| {
                [a.min(*low), b.max(*high)]
            });
        range[0] as usize..range[1] as usize + 1
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let moduli = [self.lambda, self.mu];
        self.each_part(sites, y, |elements, part, y| {
            kernel::add(
                &self.mesh.elements,
                elements,
                moduli,
                |e| self.shape(e).unpacked(),
                x,
                part,
                y,
            );
        });
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        let moduli = [self.lambda as f32, self.mu as f32];
        self.each_part(sites, y, |elements, part, y| {
            kernel::add(
                &self.mesh.elements,
                elements,
                moduli,
                |e| self.shapes[e],
                x,
                part,
                y,
            );
        });
    }

    /// Measured: see [`element::EIGENVALUE_BOUND`].
    fn eigenvalue_bound(&self) -> f64 {
        element::EIGENVALUE_BOUND
    }
}

impl Tet10 {
    /// Splits `sites` at blocks: `add` has a block's elements, the nodes and their part of `y`, which is zero.
    fn each_part<T: Copy + Default>(
        &self,
        sites: Range<usize>,
        y: &mut [[T; 3]],
        add: impl Fn(&[u32], Range<usize>, &mut [[T; 3]]),
    ) {
        y.fill([T::default(); 3]);
        let mut start = sites.start;
        while start < sites.end {
            let block = start / BLOCK;
            let end = ((block + 1) * BLOCK).min(sites.end);
            let part = &mut y[start - sites.start..end - sites.start];
            add(&self.blocks[block], start..end, part);
            start = end;
        }
    }
}
