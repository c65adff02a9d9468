//! Owns the four-node elements inside the ten-node ones: corners move, edges stay straight.

use super::{Tet10, element};
use crate::discretisation::tetrahedra::nodes::{EDGES, TetMesh};
use crate::operator::assembled::Assembled;
use crate::operator::held::Held;
use crate::operator::nested::Nested;
use rayon::prelude::*;

/// The two corners that each node lies between, and the nodes between each corner and another.
pub struct Corners {
    /// Numbers of corners; twice the same for a corner.
    of_node: Vec<[u32; 2]>,
    nodes: Vec<u32>,
    starts: Vec<u32>,
    middles: Vec<u32>,
}

impl Corners {
    pub fn of(mesh: &TetMesh) -> Corners {
        let mut name = vec![u32::MAX; mesh.nodes_mm.len()];
        let mut nodes = Vec::new();
        for (node, _) in mesh.is_corner.iter().enumerate().filter(|n| *n.1) {
            name[node] = nodes.len() as u32;
            nodes.push(node as u32);
        }
        let mut of_node: Vec<[u32; 2]> = name.iter().map(|n| [*n; 2]).collect();
        for ten in &mesh.elements {
            for (edge, ends) in EDGES.iter().enumerate() {
                of_node[ten[4 + edge] as usize] = ends.map(|c| name[ten[c] as usize]);
            }
        }
        let mut starts = vec![0u32; nodes.len() + 1];
        let middles = || of_node.iter().enumerate().filter(|(_, [a, b])| a != b);
        middles().for_each(|(_, ends)| ends.iter().for_each(|c| starts[*c as usize + 1] += 1));
        for c in 0..nodes.len() {
            starts[c + 1] += starts[c];
        }
        let mut next = starts.clone();
        let mut lists = vec![0u32; starts[nodes.len()] as usize];
        for (node, ends) in middles() {
            for c in ends {
                let next = &mut next[*c as usize];
                lists[*next as usize] = node as u32;
                *next += 1;
            }
        }
        Corners {
            of_node,
            nodes,
            starts,
            middles: lists,
        }
    }
}

/// A bound of the largest eigenvalue of `D⁻¹K` of a four-node element: each part of four is at most the whole.
const EIGENVALUE_BOUND: f64 = 4.0;

/// The operator of the corners alone.
pub fn assemble(model: &Tet10, corners: &Corners) -> Assembled {
    let moduli = [model.lambda as f32, model.mu as f32];
    let positions = corners
        .nodes
        .iter()
        .map(|n| model.mesh.nodes_mm[*n as usize]);
    Assembled::of_rows(
        positions.collect(),
        EIGENVALUE_BOUND,
        |corner, columns, blocks| {
            let first = columns.len();
            let node = corners.nodes[corner] as usize;
            for a in model.around(node) {
                let (e, local) = (*a as usize / 16, *a as usize % 16);
                let row = element::linear_row(&model.shapes[e], moduli, local);
                for (n, block) in model.mesh.elements[e].iter().zip(&row) {
                    let [column, _] = corners.of_node[*n as usize];
                    match columns[first..].iter().position(|c| *c == column) {
                        Some(at) => {
                            let sum = blocks[first + at].as_flattened_mut();
                            sum.iter_mut()
                                .zip(block.as_flattened())
                                .for_each(|(s, b)| *s += b);
                        }
                        None => {
                            columns.push(column);
                            blocks.push(*block);
                        }
                    }
                }
            }
        },
    )
}

/// Nodes per parallel task.
const PART: usize = 4096;

impl Nested for Tet10 {
    type Coarse = Assembled;

    fn eigenvalue_bound(&self) -> f64 {
        element::EIGENVALUE_BOUND
    }

    fn coarse(&self) -> &Assembled {
        &self.linear
    }

    fn held_of_coarse(&self, held: &Held) -> Held {
        Held(
            self.corners
                .nodes
                .iter()
                .map(|n| held.0[*n as usize])
                .collect(),
        )
    }

    fn restrict(&self, fine: &[[f32; 3]], coarse: &mut [[f32; 3]]) {
        let Corners {
            nodes,
            starts,
            middles,
            ..
        } = &self.corners;
        coarse
            .par_iter_mut()
            .with_min_len(PART)
            .enumerate()
            .for_each(|(c, sum)| {
                *sum = fine[nodes[c] as usize];
                for m in &middles[starts[c] as usize..starts[c + 1] as usize] {
                    let middle = &fine[*m as usize];
                    (0..3).for_each(|a| sum[a] += 0.5 * middle[a]);
                }
            });
    }

    fn add_prolonged(&self, coarse: &[[f32; 3]], fine: &mut [[f32; 3]]) {
        let ends = self.corners.of_node.par_iter();
        fine.par_iter_mut()
            .with_min_len(PART)
            .zip(ends)
            .for_each(|(u, [a, b])| {
                let (a, b) = (&coarse[*a as usize], &coarse[*b as usize]);
                (0..3).for_each(|c| u[c] += 0.5 * (a[c] + b[c]));
            });
    }

    fn inverse_diagonal(&self, held: &Held) -> Vec<[f32; 6]> {
        let nodes = (0..self.nodes()).into_par_iter();
        nodes
            .map(|n| inverse(self.own_block(n), held.0[n]))
            .collect()
    }
}

impl Tet10 {
    /// A node's 3 × 3 diagonal block.
    fn own_block(&self, node: usize) -> [[f64; 3]; 3] {
        let mut sum = [[0.0; 3]; 3];
        for a in self.around(node) {
            let (e, local) = (*a as usize / 16, *a as usize % 16);
            let own = self.shape(e).block([self.lambda, self.mu], local, local);
            let pairs = sum.as_flattened_mut().iter_mut().zip(own.as_flattened());
            pairs.for_each(|(s, b)| *s += b);
        }
        sum
    }
}

/// The inverse on the components that are not held, zero in the others.
fn inverse(block: [[f64; 3]; 3], held: u8) -> [f32; 6] {
    let free = [0, 1, 2].map(|c| held & (1 << c) == 0);
    let a = |r: usize, c: usize| match (free[r] && free[c], r == c) {
        (true, _) => block[r][c],
        (false, true) => 1.0,
        (false, false) => 0.0,
    };
    let minor = |r: usize, c: usize| {
        let (p, q, s, t) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
        a(p, s) * a(q, t) - a(p, t) * a(q, s)
    };
    let determinant: f64 = (0..3).map(|c| a(0, c) * minor(0, c)).sum();
    [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)].map(|(r, c)| {
        let both = free[r] && free[c] && determinant > 0.0;
        if both {
            (minor(c, r) / determinant) as f32
        } else {
            0.0
        }
    })
}
