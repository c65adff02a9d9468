//! Owns what multigrid sees of a lattice: its springs.
//!
//! The volumetric term reaches two bonds far and is small compared with the springs unless tissue is nearly incompressible, so
//! the preconditioner is built on the springs alone; conjugate gradients sees the whole lattice.

use super::{Lattice, PORTION, range};
use crate::discretisation::lattice::neighbours::MOST;
use crate::discretisation::lattice::sites::Sites;
use crate::operator::Operator;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use rayon::prelude::*;
use std::ops::Range;

/// The springs of a lattice as an operator of their own.
pub struct Springs<'a> {
    lattice: &'a Lattice,
    /// By pair: `½ k n nᵀ` of a bond between sites of weight 1.
    stiffness: Vec<[[f64; 3]; 3]>,
    /// Its negative, what such a bond couples its ends by.
    coupling: Vec<Block>,
}

impl<'a> Springs<'a> {
    pub fn new(lattice: &'a Lattice) -> Self {
        let stiffness = |p: &super::Direction| p.d.map(|a| p.d.map(|b| p.spring * a * b));
        let stiffness: Vec<_> = lattice.pairs.iter().map(stiffness).collect();
        let negative = |k: &[[f64; 3]; 3]| k.map(|row| row.map(|v| -v as f32));
        Springs {
            coupling: stiffness.iter().map(negative).collect(),
            stiffness,
            lattice,
        }
    }

    /// Share of a bond in [`Springs::stiffness`].
    fn share(&self, site: usize, end: usize) -> f64 {
        0.5 * (self.lattice.weight(site) + self.lattice.weight(end))
    }

    /// Calls `visit` with every site of the range and its bonds' ends; a missing one is the site itself.
    fn each_ends(&self, sites: Range<usize>, mut visit: impl FnMut(usize, &[u32])) {
        let neighbours = &self.lattice.sites.neighbours;
        let z = neighbours.coordination();
        neighbours.each(sites, |site, row| visit(site, &row[..z]));
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
        d.par_chunks_mut(PORTION).enumerate().for_each(|(c, d)| {
            let sites = range(c, d.len());
            self.each_ends(sites.clone(), |site, ends| {
                let d = &mut d[site - sites.start];
                *d = [0.0; 3];
                for (b, &end) in ends.iter().enumerate().filter(|b| *b.1 as usize != site) {
                    let share = self.share(site, end as usize);
                    (0..3).for_each(|c| d[c] += share * self.stiffness[b / 2][c][c]);
                }
            });
        });
    }
}

impl Coarsen for Springs<'_> {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        let Sites { frame, indices, .. } = &self.lattice.sites;
        for (x, at) in x.iter_mut().zip(&indices[sites]) {
            *x = frame.position_mm(*at);
        }
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let uniform = self.lattice.sites.weights.is_none();
        let (mut columns, mut blocks) = ([0; MOST + 1], [[[0.0; 3]; 3]; MOST + 1]);
        self.each_ends(sites, |site, ends| {
            let (mut own, mut n) = ([[0.0; 3]; 3], 0);
            for (b, &end) in ends.iter().enumerate().filter(|b| *b.1 as usize != site) {
                let k = &self.stiffness[b / 2];
                let share = if uniform {
                    1.0
                } else {
                    self.share(site, end as usize)
                };
                for a in 0..3 {
                    (0..3).for_each(|c| own[a][c] += share * k[a][c]);
                }
                columns[n] = end;
                blocks[n] = match uniform {
                    true => self.coupling[b / 2],
                    false => self.coupling[b / 2].map(|row| row.map(|v| share as f32 * v)),
                };
                n += 1;
            }
            columns[n] = site as u32;
            blocks[n] = own.map(|row| row.map(|v| v as f32));
            visit(site, &columns[..=n], &blocks[..=n]);
        });
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let (mut first, mut last) = (sites.start as u32, sites.end as u32 - 1);
        self.each_ends(sites, |_, ends| {
            for &end in ends {
                (first, last) = (first.min(end), last.max(end));
            }
        });
        first as usize..last as usize + 1
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        self.lattice
            .double
            .springs(&self.lattice.sites, sites, x, y);
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        self.lattice
            .single
            .springs(&self.lattice.sites, sites, x, y);
    }

    /// Of one spring, `(u_i − u_j)² <= 2 u_i² + 2 u_j²`.
    fn eigenvalue_bound(&self) -> f64 {
        2.0
    }
}
