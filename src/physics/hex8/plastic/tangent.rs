//! Owns the tangent of yielded voxel elements as an operator: the linear kernel, and of every element that flows the change of its
//! stiffness. Every node gathers from the elements around it.

use super::points::{Couplings, Points, Scalar, pair};
use super::{NONE, Yielded, each_yielded};
use crate::discretisation::voxels::VoxelMesh;
use crate::operator::coarsen::Coarsen;
use crate::operator::{MixedPrecision, Operator};
use crate::par::{CHUNK, each_chunk};
use rayon::prelude::*;
use std::ops::{AddAssign, Range, Sub};

/// `A u` is the change of nodal forces (N) by small displacements `u` (mm). `K` is the precision that couplings are kept in.
pub struct Tangent<'a, E, K> {
    elastic: &'a E,
    mesh: &'a VoxelMesh,
    couplings: Vec<Couplings<K>>,
    /// Place of an element in `couplings`, by its node.
    slots: Vec<u32>,
}

impl<'a, E: Coarsen, K: Scalar> Tangent<'a, E, K> {
    pub(super) fn new(
        elastic: &'a E,
        mesh: &'a VoxelMesh,
        points: &Points,
        yielded: &[Yielded],
    ) -> Self {
        let flowing: Vec<&Yielded> = yielded.iter().filter(|y| y.flows).collect();
        let mut slots = vec![NONE; mesh.len()];
        for (slot, y) in (0u32..).zip(&flowing) {
            slots[y.state.node as usize] = slot;
        }
        Tangent {
            elastic,
            mesh,
            couplings: flowing
                .par_iter()
                .map(|y| points.couplings(&y.softening))
                .collect(),
            slots,
        }
    }

    fn rows(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        self.elastic.rows_f64(sites.clone(), x, y);
        self.add_rows(sites, x, y);
    }

    /// Adds what flowing elements change to rows of `A x`. Differences from a node's own displacement are gathered: a translation
    /// pulls at nothing in any precision.
    fn add_rows<S>(&self, nodes: Range<usize>, x: &[[S; 3]], y: &mut [[S; 3]])
    where
        S: Scalar + Sub<Output = S> + AddAssign,
    {
        if self.couplings.is_empty() {
            return;
        }
        each_yielded(
            self.mesh,
            &self.slots,
            nodes.clone(),
            |node, own, slot, rows, i| {
                let (k, here) = (&self.couplings[slot], x[node]);
                let mut sum = [0.0; 3];
                for other in 0..8 {
                    if other == own {
                        continue;
                    }
                    let there = x[neighbour(rows, i, own, other)];
                    let d: [f64; 3] = std::array::from_fn(|a| (there[a] - here[a]).into());
                    let (low, high) = (own.min(other), own.max(other));
                    let block = &k[9 * pair(low, high)..][..9];
                    for a in 0..3 {
                        for b in 0..3 {
                            let entry = if own < other {
                                block[3 * a + b]
                            } else {
                                block[3 * b + a]
                            };
                            sum[a] += entry.into() * d[b];
                        }
                    }
                }
                let y = &mut y[node - nodes.start];
                (0..3).for_each(|a| y[a] += S::of(sum[a]));
            },
        );
    }
}

/// The node that is corner `other` of the element of which node `i` of a segment is corner `own`.
fn neighbour(rows: &[u32; 9], i: usize, own: usize, other: usize) -> usize {
    let step = |a: usize| (other >> a & 1) + 1 - (own >> a & 1);
    rows[step(1) + 3 * step(2)] as usize + i + step(0) - 1
}

impl<E: Coarsen, K: Scalar> Operator<3> for Tangent<'_, E, K> {
    fn sites(&self) -> usize {
        self.mesh.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(CHUNK).enumerate().for_each(|(c, y)| {
            self.rows(c * CHUNK..c * CHUNK + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        self.elastic.diagonal(d);
        each_yielded(
            self.mesh,
            &self.slots,
            0..d.len(),
            |node, own, slot, _, _| {
                let block = own_block(&self.couplings[slot], own);
                (0..3).for_each(|a| d[node][a] += block[a][a]);
            },
        );
    }
}

/// A corner's coupling with itself.
fn own_block<K: Scalar>(k: &Couplings<K>, own: usize) -> [[f64; 3]; 3] {
    let mut sum = [[0.0; 3]; 3];
    for other in (0..8).filter(|other| *other != own) {
        let block = &k[9 * pair(own.min(other), own.max(other))..][..9];
        for a in 0..3 {
            for b in 0..3 {
                let entry = if own < other {
                    block[3 * a + b]
                } else {
                    block[3 * b + a]
                };
                sum[a][b] -= entry.into();
            }
        }
    }
    sum
}

impl<E: Coarsen, K: Scalar> MixedPrecision for Tangent<'_, E, K> {
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64 {
        let [sum] = each_chunk(y, CHUNK, |first, y| {
            let sites = first..first + y.len();
            self.elastic.rows_f32(sites.clone(), x, y);
            self.add_rows(sites, x, y);
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
        each_chunk(out, CHUNK, |first, out| {
            let mut image = vec![[0.0; 3]; out.len()];
            self.rows(first..first + out.len(), x, &mut image);
            consume(first, &image, out)
        })
    }
}
