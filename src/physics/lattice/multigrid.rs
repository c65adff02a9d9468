//! Owns what multigrid sees of a lattice: its springs.
//!
//! The volumetric term reaches two bonds far and is small beside the springs unless tissue is nearly incompressible, so
//! the preconditioner is built on the springs alone; conjugate gradients sees the whole lattice.

use super::kernel::{self, Bonds};
use super::{Lattice, PORTION, quad, range, springs};
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::simd::{Isa, isa};
use crate::topology::sites::Sites;
use rayon::prelude::*;
use std::ops::Range;

/// The springs of a lattice as an operator of their own.
pub struct Springs<'a> {
    lattice: &'a Lattice<'a>,
    pairs: Vec<kernel::Pair<f32>>,
    weights: Option<Vec<f32>>,
}

impl<'a> Springs<'a> {
    pub fn new(lattice: &'a Lattice<'a>) -> Self {
        let single = |v: [f64; 4]| v.map(|x| x as f32);
        let pair = |p: &kernel::Pair<f64>| kernel::Pair {
            shell: p.shell,
            diagonals: p.diagonals.map(single),
            axial: p.axial,
            lever: single(p.lever),
        };
        let pairs = lattice.scaled.iter().map(pair).collect();
        let weights = lattice.sites.weights.as_ref();
        let weights = weights.map(|w| w.iter().map(|&w| w as f32).collect());
        Springs {
            lattice,
            pairs,
            weights,
        }
    }

    /// Stiffness of a bond of pair `p` in `spring · d dᵀ`.
    fn share(&self, site: usize, end: usize) -> f64 {
        0.5 * (self.lattice.weight(site) + self.lattice.weight(end))
    }
}

impl Operator<3> for Springs<'_> {
    fn sites(&self) -> usize {
        self.lattice.sites.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(PORTION).enumerate().for_each(|(c, y)| {
            self.rows_f64(range(c, y.len()), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(site, d)| {
            *d = [0.0; 3];
            self.each_bond(site, |_, block| (0..3).for_each(|c| d[c] += block[c][c]));
        });
    }
}

impl Springs<'_> {
    /// Calls `visit` with every bonded neighbour and the bond's stiffness `½ k n nᵀ`.
    fn each_bond(&self, site: usize, mut visit: impl FnMut(usize, [[f64; 3]; 3])) {
        for (pair, plus, minus) in self.lattice.bonded(site) {
            for end in [plus, minus] {
                if end != site {
                    let c = self.share(site, end) * pair.spring;
                    let d = pair.d;
                    visit(end, d.map(|a| d.map(|b| c * a * b)));
                }
            }
        }
    }
}

impl Coarsen for Springs<'_> {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        let Sites { frame, indices, .. } = self.lattice.sites;
        for (x, at) in x.iter_mut().zip(&indices[sites]) {
            *x = frame.position_mm(*at);
        }
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let (mut columns, mut blocks) = (Vec::with_capacity(19), Vec::with_capacity(19));
        for site in sites {
            let mut own = [[0.0; 3]; 3];
            columns.clear();
            blocks.clear();
            self.each_bond(site, |end, block| {
                for a in 0..3 {
                    (0..3).for_each(|b| own[a][b] += block[a][b]);
                }
                columns.push(end as u32);
                blocks.push(block.map(|r| r.map(|v| -v as f32)));
            });
            columns.push(site as u32);
            blocks.push(own.map(|r| r.map(|v| v as f32)));
            visit(site, &columns, &blocks);
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let mut reach = sites.clone();
        for (_, plus, minus) in sites.flat_map(|site| self.lattice.bonded(site)) {
            reach.start = reach.start.min(plus).min(minus);
            reach.end = reach.end.max(plus + 1).max(minus + 1);
        }
        reach
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        self.lattice.springs(sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        assert_eq!(x.len(), self.sites());
        let bonds = Bonds {
            pairs: &self.pairs,
            neighbours: &self.lattice.sites.neighbours,
        };
        let weights = self.weights.as_deref();
        // SAFETY: `isa` vouches for the instruction set, `Sites` for neighbours below its length.
        unsafe {
            match isa() {
                #[cfg(target_arch = "x86_64")]
                Isa::Avx2 | Isa::Avx512 => super::avx2::springs_f32(bonds, weights, sites, x, y),
                _ => springs::<quad::Plain32>(bonds, weights, sites, x, y),
            }
        }
    }

    /// Of one spring, `(u_i − u_j)² <= 2 u_i² + 2 u_j²`.
    fn eigenvalue_bound(&self) -> f64 {
        2.0
    }
}
