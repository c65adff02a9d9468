//! Owns the pieces of a mesh that no node joins, and what rigid motions their supports leave free.

use crate::discretisation::voxels::VoxelMesh;
use crate::operator::held::Held;
use crate::parts;
use crate::pipeline::apparent::ends::rigid::{Frame, Gram, Motion};

/// Which piece each node is of. Padding is of pieces of its own.
pub struct Pieces {
    of: Vec<u32>,
    /// Where they are, by number.
    frames: Vec<Frame>,
    nodes: Vec<usize>,
}

impl Pieces {
    /// The pieces of a mesh: elements that share a node, be it one, are of one piece.
    pub fn of(mesh: &VoxelMesh) -> Pieces {
        let mut up = parts::apart(mesh.len());
        for segment in &mesh.segments {
            for (i, node) in segment.nodes().enumerate() {
                if mesh.has_element(node) {
                    // Rows of neighbours at dy, dz of 0 and 1.
                    for row in [4, 5, 7, 8] {
                        let first = segment.rows[row] + i as u32;
                        parts::join(&mut up, node as u32, first);
                        parts::join(&mut up, node as u32, first + 1);
                    }
                }
            }
        }
        let (of, count) = parts::numbered(up);
        let (mut sums, mut nodes) = (vec![[0.0; 3]; count], vec![0; count]);
        each(mesh, |node, at| {
            let piece = of[node] as usize;
            nodes[piece] += 1;
            (0..3).for_each(|a| sums[piece][a] += at[a]);
        });
        let mean = |(sum, n): (&[f64; 3], &usize)| sum.map(|v| v / (*n).max(1) as f64);
        let centres: Vec<[f64; 3]> = sums.iter().zip(&nodes).map(mean).collect();
        let mut squares = vec![0.0; count];
        each(mesh, |node, at| {
            let piece = of[node] as usize;
            squares[piece] += (0..3)
                .map(|a| (at[a] - centres[piece][a]).powi(2))
                .sum::<f64>();
        });
        let frames = (0..count)
            .map(|p| Frame {
                centre_mm: centres[p],
                size_mm: (squares[p] / nodes[p].max(1) as f64)
                    .sqrt()
                    .max(f64::MIN_POSITIVE),
            })
            .collect();
        Pieces { of, frames, nodes }
    }

    /// The piece of a node.
    pub fn at(&self, node: usize) -> usize {
        self.of[node] as usize
    }

    /// Where a piece is.
    pub fn frame(&self, piece: usize) -> &Frame {
        &self.frames[piece]
    }

    /// Those that have elements, by number.
    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.nodes.len()).filter(|&p| self.nodes[p] > 0)
    }

    /// The rigid motions that `held` leaves free, by piece.
    pub fn free(&self, mesh: &VoxelMesh, held: &Held) -> Vec<Vec<Motion>> {
        let mut grams = vec![Gram::ZERO; self.frames.len()];
        each(mesh, |node, at| {
            let piece = self.at(node);
            for c in (0..3).filter(|&c| held.is_held(node, c)) {
                grams[piece].add(&self.frames[piece].row(at, c));
            }
        });
        let count = |p: usize| self.nodes[p] > 0;
        (0..grams.len())
            .map(|p| {
                if count(p) {
                    grams[p].free()
                } else {
                    Vec::new()
                }
            })
            .collect()
    }

    /// Holds as many components of nodes of each piece as stop the motions that are `free`, and bear nothing where forces balance.
    pub fn stop(&self, mesh: &VoxelMesh, free: &[Vec<Motion>], held: &mut Held) {
        let mut left: Vec<Vec<Motion>> = free.to_vec();
        while left.iter().any(|motions| !motions.is_empty()) {
            let mut best = vec![(0.0, 0, 0); left.len()];
            each(mesh, |node, at| {
                let piece = self.at(node);
                for c in 0..3 {
                    let row = self.frames[piece].row(at, c);
                    let moved: f64 = left[piece].iter().map(|m| dot(m, &row).powi(2)).sum();
                    if moved > best[piece].0 * (1.0 + 1e-9) {
                        best[piece] = (moved, node, c);
                    }
                }
            });
            for (piece, motions) in left.iter_mut().enumerate().filter(|(_, m)| !m.is_empty()) {
                let (moved, node, c) = best[piece];
                if moved > 0.0 {
                    held.hold(node, c);
                    *motions = without(motions, &self.frames[piece].row(mesh.position(node), c));
                } else {
                    motions.clear();
                }
            }
        }
    }

    /// Takes the mean rigid motion of each piece out of displacements.
    pub fn settle(&self, mesh: &VoxelMesh, u: &mut [[f64; 3]]) {
        let count = self.frames.len();
        let (mut grams, mut products) = (vec![Gram::ZERO; count], vec![[0.0; 6]; count]);
        each(mesh, |node, at| {
            let piece = self.at(node);
            for (c, moved) in u[node].iter().enumerate() {
                let row = self.frames[piece].row(at, c);
                grams[piece].add(&row);
                (0..6).for_each(|m| products[piece][m] += row[m] * moved);
            }
        });
        let motions: Vec<Motion> = grams
            .iter()
            .zip(&products)
            .map(|(g, b)| g.solve(b))
            .collect();
        each(mesh, |node, at| {
            let piece = self.at(node);
            for (c, moved) in u[node].iter_mut().enumerate() {
                *moved -= dot(&motions[piece], &self.frames[piece].row(at, c));
            }
        });
    }
}

/// The part of a space of motions that moves no component of this row.
fn without(motions: &[Motion], row: &Motion) -> Vec<Motion> {
    let worst = (0..motions.len()).max_by(|&a, &b| {
        dot(&motions[a], row)
            .abs()
            .total_cmp(&dot(&motions[b], row).abs())
    });
    let Some(worst) = worst else {
        return Vec::new();
    };
    let pivot = motions[worst];
    let others = motions.iter().enumerate().filter(|(i, _)| *i != worst);
    others
        .map(|(_, m)| {
            let share = dot(m, row) / dot(&pivot, row);
            let left: Motion = std::array::from_fn(|k| m[k] - share * pivot[k]);
            let norm = dot(&left, &left).sqrt();
            left.map(|v| v / norm)
        })
        .collect()
}

fn dot(a: &Motion, b: &Motion) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Calls `visit` with each node that has elements, and its place in mm.
pub fn each(mesh: &VoxelMesh, mut visit: impl FnMut(usize, [f64; 3])) {
    for segment in &mesh.segments {
        let [x, y, z] = segment.at.map(|v| v as usize);
        for (i, node) in segment.nodes().enumerate() {
            if mesh.around[node] != 0 {
                let at = [x + i, y, z];
                visit(
                    node,
                    std::array::from_fn(|a| at[a] as f64 * mesh.grid.spacing_mm[a]),
                );
            }
        }
    }
}
