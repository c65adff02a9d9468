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
use crate::operator::assembled::Assembled;
use crate::operator::{MixedPrecision, Operator};
use crate::par::{CHUNK as BLOCK, each_chunk};
use crate::simd::vec3::Precision;
use element::Shape;
use linear::Corners;
use rayon::prelude::*;

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
        let corners = Corners::of(&mesh);
        let mut model = Tet10 {
            lambda: young_mpa * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
            mu: young_mpa / (2.0 * (1.0 + poisson)),
            factor,
            shapes,
            blocks,
            starts,
            around,
            linear: Assembled::of_rows(Vec::new(), 0.0, |_, _, _| ()),
            corners: Corners::of(&TetMesh::default()),
            mesh,
        };
        model.linear = linear::assemble(&model, &corners);
        model.corners = corners;
        model
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

    /// Volume of an element in mm³.
    pub fn volume_mm3(&self, e: usize) -> f64 {
        shape(&self.mesh, None, e).volume
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
            self.forces_f64(b * BLOCK, x, y);
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

impl MixedPrecision for Tet10 {
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64 {
        let moduli = [self.lambda as f32, self.mu as f32];
        let shape = |e: usize| self.shapes[e];
        let [sum] = each_chunk(y, BLOCK, |first, y| {
            self.forces(moduli, shape, first, x, y);
            [finish(first, y)]
        });
        sum
    }

    fn for_each_chunk(
        &self,
        x: &[[f64; 3]],
        out: &mut [[f32; 3]],
        consume: impl Fn(usize, &[[f64; 3]], &mut [[f32; 3]]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        each_chunk(out, BLOCK, |first, out| {
            let mut image = vec![[0.0; 3]; out.len()];
            self.forces_f64(first, x, &mut image);
            consume(first, &image, out)
        })
    }
}

impl Tet10 {
    fn forces_f64(&self, first: usize, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let shape = |e: usize| self.shape(e).unpacked();
        self.forces([self.lambda, self.mu], shape, first, x, y);
    }

    /// Forces on the block of nodes that begins with `first`.
    fn forces<T: Precision>(
        &self,
        moduli: [T; 2],
        shape: impl Fn(usize) -> [T; 10],
        first: usize,
        x: &[[T; 3]],
        y: &mut [[T; 3]],
    ) {
        y.fill([T::default(); 3]);
        let elements = &self.blocks[first / BLOCK];
        kernel::add(&self.mesh.elements, elements, moduli, shape, x, first, y);
    }
}
