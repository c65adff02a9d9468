//! Owns the finest level: the caller's operator, never assembled.

use super::aggregate::Aggregates;
use super::diagonal::{self, Diagonal};
use super::level::{Level, Modes, NONE, Six};
use super::rigid::{self, Basis, Mat6};
use crate::operator::coarsen::{Block, Coarsen};
use crate::operator::held::Held;
use rayon::prelude::*;
use std::cell::RefCell;
use std::ops::Range;

pub struct Fine<'a, O> {
    operator: &'a O,
    /// Inverse diagonal blocks, zero in held components and at padding.
    inverse: Diagonal,
    pub aggregates: Aggregates,
    /// Site relative to its aggregate's centre, in units of the aggregate's radius.
    local: Vec<[f32; 3]>,
    /// Orthonormal motions of each aggregate from plain ones.
    bases: Vec<[Six; 6]>,
}

/// What the next level needs to know of an aggregate.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    pub center: [f64; 3],
    pub radius: f64,
    pub basis: Basis,
}

impl<'a, O: Coarsen> Fine<'a, O> {
    /// `box_mm`: edges of the boxes whose connected pieces are aggregates.
    pub fn new(operator: &'a O, held: &Held, box_mm: [f64; 3]) -> (Self, Vec<Body>) {
        let inverse = inverse_diagonal(operator, held);
        let positions: Vec<[f64; 3]> = (0..operator.sites())
            .into_par_iter()
            .map(|i| operator.position(i))
            .collect();
        let boxes = boxes(&positions, &inverse, box_mm);
        let aggregates = Aggregates::in_boxes(&boxes, |i, list| {
            ROW.with_borrow_mut(|row| {
                row.clear();
                operator.row(i, row);
                list.clear();
                list.extend(row.iter().map(|&(j, _)| j));
            });
        });
        drop(boxes);
        let bodies: Vec<Body> = (0..aggregates.count)
            .into_par_iter()
            .map(|a| body(aggregates.members(a), &positions, &inverse))
            .collect();
        let local = positions
            .par_iter()
            .zip(&aggregates.of)
            .map(|(x, &a)| match bodies.get(a as usize) {
                Some(b) => std::array::from_fn(|c| ((x[c] - b.center[c]) / b.radius) as f32),
                None => [0.0; 3],
            })
            .collect();
        let bases = bodies
            .iter()
            .map(|b| b.basis.basis.map(|row| row.map(|v| v as f32)))
            .collect();
        let fine = Fine {
            operator,
            inverse,
            aggregates,
            local,
            bases,
        };
        (fine, bodies)
    }

    /// Forces on plain motions to forces on orthonormal ones.
    pub fn to_basis(&self, raw: &[Six], g: &mut [Six]) {
        for ((g, raw), basis) in g.iter_mut().zip(raw).zip(&self.bases) {
            *g = std::array::from_fn(|k| (0..6).map(|m| basis[m][k] * raw[m]).sum());
        }
    }

    /// Amplitudes of orthonormal motions to those of plain ones.
    pub fn to_plain(&self, e: &[Six], raw: &mut [Six]) {
        for ((e, raw), basis) in e.iter().zip(raw).zip(&self.bases) {
            *raw = std::array::from_fn(|m| (0..6).map(|k| basis[m][k] * e[k]).sum());
        }
    }
}

thread_local! {
    /// Room for one row.
    static ROW: RefCell<Vec<(u32, Block)>> = const { RefCell::new(Vec::new()) };
}

/// Sites per task of the set-up.
const CHUNK: usize = 1 << 14;

fn inverse_diagonal(operator: &impl Coarsen, held: &Held) -> Diagonal {
    let chunks = held
        .0
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(c, held)| diagonal::chunk(operator, c * CHUNK, held))
        .collect();
    Diagonal::from_chunks(chunks)
}

/// A number for every box that holds a free site.
fn boxes(positions: &[[f64; 3]], inverse: &Diagonal, box_mm: [f64; 3]) -> Vec<u32> {
    // Half a site's spacing at least off the boxes' walls on regular grids that begin at zero.
    let index = |x: &[f64; 3]| x.map(|v| v.max(0.0));
    let cells = |x: &[f64; 3]| -> [u64; 3] {
        let x = index(x);
        std::array::from_fn(|a| (x[a] / box_mm[a] + 1e-6).floor() as u64)
    };
    let most = positions.iter().map(cells).fold([0; 3], |m, c| {
        [m[0].max(c[0]), m[1].max(c[1]), m[2].max(c[2])]
    });
    positions
        .par_iter()
        .enumerate()
        .map(|(i, x)| {
            let c = cells(x);
            let number = (c[2] * (most[1] + 1) + c[1]) * (most[0] + 1) + c[0];
            if inverse.free(i) == [0.0; 3] {
                NONE
            } else {
                number as u32
            }
        })
        .collect()
}

fn body(members: &[u32], positions: &[[f64; 3]], inverse: &Diagonal) -> Body {
    let n = members.len() as f64;
    let mut center = [0.0; 3];
    for &i in members {
        for c in 0..3 {
            center[c] += positions[i as usize][c] / n;
        }
    }
    let squared: f64 = members
        .iter()
        .map(|&i| {
            (0..3)
                .map(|c| (positions[i as usize][c] - center[c]).powi(2))
                .sum::<f64>()
        })
        .sum();
    let radius = if squared > 0.0 {
        (squared / n).sqrt()
    } else {
        1.0
    };
    let mut gram: Mat6 = [[0.0; 6]; 6];
    for &i in members {
        let i = i as usize;
        let d = std::array::from_fn(|c| positions[i][c] - center[c]);
        let carried = rigid::carry(d, radius, radius);
        let free = inverse.free(i);
        for c in (0..3).filter(|&c| free[c] > 0.0) {
            rigid::add_gram(&mut gram, &carried[c..c + 1]);
        }
    }
    Body {
        center,
        radius,
        basis: rigid::orthonormalise(&gram, n),
    }
}

impl<O: Coarsen> Level<3> for Fine<'_, O> {
    fn sites(&self) -> usize {
        self.inverse.sites()
    }

    fn rows(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        self.operator.rows_f32(sites, x, y);
    }

    fn row(&self, site: usize, blocks: &mut Vec<(u32, Block)>) {
        self.operator.row(site, blocks);
    }

    #[inline]
    fn scale(&self, site: usize, r: &[f32; 3]) -> [f32; 3] {
        self.inverse.times(site, r)
    }

    #[inline]
    fn aggregate(&self, site: usize) -> u32 {
        self.aggregates.of[site]
    }

    #[inline]
    fn modes(&self, site: usize) -> Modes<3> {
        let [x, y, z] = self.local[site];
        let free = self.inverse.free(site);
        [
            [free[0], 0.0, 0.0, 0.0, free[0] * z, -free[0] * y, 0.0, 0.0],
            [0.0, free[1], 0.0, -free[1] * z, 0.0, free[1] * x, 0.0, 0.0],
            [0.0, 0.0, free[2], free[2] * y, -free[2] * x, 0.0, 0.0, 0.0],
        ]
    }
}
