//! Owns the assembled levels: six unknowns per site, the rigid motions of what it stands for.

use super::aggregate::Aggregates;
use super::blocks::{Block6, BlockMatrix};
use super::fine::Body;
use super::level::{Level, Modes, Six};
use super::rigid::{self, Mat6};
use rayon::prelude::*;
use std::ops::Range;

pub struct Coarse {
    pub matrix: BlockMatrix,
    /// Inverse diagonal blocks.
    inverse: Vec<Block6>,
    pub aggregates: Aggregates,
    /// Orthonormal motions of a site's aggregate.
    modes: Vec<Block6>,
}

impl Coarse {
    /// A level over `bodies`, aggregated by its own graph; the bodies of the next.
    pub fn new(matrix: BlockMatrix, bodies: &[Body]) -> (Self, Vec<Body>) {
        let inverse: Vec<Block6> = (0..matrix.rows())
            .into_par_iter()
            .map(|i| inverse_block(&matrix, i))
            .collect();
        let aggregates = Aggregates::greedy(matrix.rows(), |i, list| strengths(&matrix, i, list));
        let next: Vec<Body> = (0..aggregates.count)
            .into_par_iter()
            .map(|a| joined(aggregates.members(a), bodies))
            .collect();
        let modes = (0..matrix.rows())
            .into_par_iter()
            .map(|i| {
                let whole = &next[aggregates.of[i] as usize];
                let q = rigid::multiply(&carried(&bodies[i], whole), &whole.basis.basis);
                std::array::from_fn(|k| q[k % 6][k / 6] as f32)
            })
            .collect();
        let level = Coarse {
            matrix,
            inverse,
            aggregates,
            modes,
        };
        (level, next)
    }

    pub fn bytes(&self) -> usize {
        self.matrix.bytes() + self.inverse.len() * 2 * 144 + self.aggregates.of.len() * 8
    }
}

/// Motions of `part` as its aggregate `whole` moves, in the orthonormal unknowns of `part`.
fn carried(part: &Body, whole: &Body) -> Mat6 {
    let d = std::array::from_fn(|c| part.center[c] - whole.center[c]);
    rigid::multiply(
        &part.basis.motions,
        &rigid::carry(d, whole.radius, part.radius),
    )
}

fn joined(members: &[u32], bodies: &[Body]) -> Body {
    let n = members.len() as f64;
    let mut whole = Body {
        center: [0.0; 3],
        radius: 0.0,
        basis: rigid::orthonormalise(&[[0.0; 6]; 6], 1.0),
    };
    for &i in members {
        for c in 0..3 {
            whole.center[c] += bodies[i as usize].center[c] / n;
        }
    }
    let mut squared = 0.0;
    for &i in members {
        let b = &bodies[i as usize];
        squared += b.radius * b.radius / n;
        for c in 0..3 {
            squared += (b.center[c] - whole.center[c]).powi(2) / n;
        }
    }
    whole.radius = squared.sqrt();
    let mut gram = [[0.0; 6]; 6];
    for &i in members {
        rigid::add_gram(&mut gram, &carried(&bodies[i as usize], &whole));
    }
    let most = (0..3).map(|k| gram[k][k]).fold(0.0, f64::max);
    whole.basis = rigid::orthonormalise(&gram, most);
    whole
}

/// Couplings of a site, each with the Frobenius norm of its block scaled by the diagonals.
fn strengths(matrix: &BlockMatrix, i: usize, list: &mut Vec<(u32, f32)>) {
    list.clear();
    for (j, block) in matrix.row(i) {
        if j as usize != i {
            let norm = block.iter().map(|v| v * v).sum::<f32>().sqrt();
            list.push((j, norm));
        }
    }
}

/// Inverse of a diagonal block; unknowns without stiffness (dropped motions) get zero rows and columns.
fn inverse_block(matrix: &BlockMatrix, i: usize) -> Block6 {
    let mut a = [[0.0; 6]; 6];
    for (_, block) in matrix.row(i).filter(|(j, _)| *j as usize == i) {
        a = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(block[6 * c + r])));
    }
    let b = rigid::orthonormalise_to(&a, 0.0, 1e-5).basis;
    std::array::from_fn(|k| (0..6).map(|m| b[k % 6][m] * b[k / 6][m]).sum::<f64>() as f32)
}

fn times(block: &Block6, r: &Six) -> Six {
    let mut out = [0.0; 6];
    for c in 0..6 {
        for a in 0..6 {
            out[a] += block[6 * c + a] * r[c];
        }
    }
    out
}

impl Level<6> for Coarse {
    fn sites(&self) -> usize {
        self.inverse.len()
    }

    fn rows(&self, sites: Range<usize>, x: &[Six], y: &mut [Six]) {
        self.matrix.multiply(sites, x, y);
    }

    fn row(&self, site: usize, blocks: &mut Vec<(u32, [Six; 6])>) {
        for (j, block) in self.matrix.row(site) {
            let square = std::array::from_fn(|r| std::array::from_fn(|c| block[6 * c + r]));
            blocks.push((j, square));
        }
    }

    #[inline]
    fn scale(&self, site: usize, r: &Six) -> Six {
        times(&self.inverse[site], r)
    }

    #[inline]
    fn aggregate(&self, site: usize) -> u32 {
        self.aggregates.of[site]
    }

    #[inline]
    fn modes(&self, site: usize) -> Modes<6> {
        let q = &self.modes[site];
        std::array::from_fn(|r| std::array::from_fn(|c| if c < 6 { q[6 * c + r] } else { 0.0 }))
    }
}
