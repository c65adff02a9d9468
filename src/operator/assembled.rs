//! Owns an operator on displacements that is kept row by row, in blocks of single precision: a coarser model for multigrid.

use super::Operator;
use super::coarsen::{Block, Coarsen, VisitRow};
use rayon::prelude::*;
use std::ops::Range;

/// Rows of blocks. `starts[i]..starts[i + 1]` are those of site `i`.
pub struct Assembled {
    pub positions_mm: Vec<[f64; 3]>,
    pub starts: Vec<u32>,
    pub columns: Vec<u32>,
    pub blocks: Vec<Block>,
    /// See [`Coarsen::eigenvalue_bound`].
    pub eigenvalue_bound: f64,
}

/// Rows per parallel task.
const ROWS: usize = 1024;

impl Assembled {
    /// Rows made by `row`, which has a site and pushes its columns and blocks.
    pub fn of_rows(
        positions_mm: Vec<[f64; 3]>,
        eigenvalue_bound: f64,
        row: impl Fn(usize, &mut Vec<u32>, &mut Vec<Block>) + Sync,
    ) -> Assembled {
        let sites = positions_mm.len();
        let part = |c: usize| {
            let (mut ends, mut columns, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
            for site in c * ROWS..((c + 1) * ROWS).min(sites) {
                row(site, &mut columns, &mut blocks);
                ends.push(columns.len() as u32);
            }
            (ends, columns, blocks)
        };
        let parts: Vec<_> = (0..sites.div_ceil(ROWS))
            .into_par_iter()
            .map(part)
            .collect();
        let mut all = Assembled {
            positions_mm,
            starts: vec![0],
            columns: Vec::new(),
            blocks: Vec::new(),
            eigenvalue_bound,
        };
        for (ends, columns, blocks) in parts {
            let first = all.columns.len() as u32;
            all.starts.extend(ends.iter().map(|e| first + e));
            all.columns.extend(columns);
            all.blocks.extend(blocks);
        }
        all
    }

    fn row(&self, site: usize) -> (&[u32], &[Block]) {
        let range = self.starts[site] as usize..self.starts[site + 1] as usize;
        (&self.columns[range.clone()], &self.blocks[range])
    }
}

impl Operator<3> for Assembled {
    fn sites(&self) -> usize {
        self.positions_mm.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(ROWS).enumerate().for_each(|(c, y)| {
            self.rows_f64(c * ROWS..c * ROWS + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(site, d)| {
            let (columns, blocks) = self.row(site);
            let own = columns.iter().position(|j| *j as usize == site);
            *d = own.map_or([0.0; 3], |k| [0, 1, 2].map(|c| f64::from(blocks[k][c][c])));
        });
    }
}

impl Coarsen for Assembled {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        x.copy_from_slice(&self.positions_mm[sites]);
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        for site in sites {
            let (columns, blocks) = self.row(site);
            visit(site, columns, blocks);
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let of = self.starts[sites.start] as usize..self.starts[sites.end] as usize;
        let own = (sites.start as u32, sites.end as u32);
        let reach = |(low, high): (u32, u32), j: &u32| (low.min(*j), high.max(j + 1));
        let (low, high) = self.columns[of].iter().fold(own, reach);
        low as usize..high as usize
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        for (site, y) in sites.zip(y) {
            *y = [0.0; 3];
            let (columns, blocks) = self.row(site);
            for (j, block) in columns.iter().zip(blocks) {
                let x = &x[*j as usize];
                for (y, row) in y.iter_mut().zip(block) {
                    *y += (0..3).map(|c| f64::from(row[c]) * x[c]).sum::<f64>();
                }
            }
        }
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        for (site, y) in sites.zip(y) {
            *y = [0.0; 3];
            let (columns, blocks) = self.row(site);
            for (j, block) in columns.iter().zip(blocks) {
                let x = &x[*j as usize];
                for (y, row) in y.iter_mut().zip(block) {
                    *y += row[0] * x[0] + row[1] * x[1] + row[2] * x[2];
                }
            }
        }
    }

    fn eigenvalue_bound(&self) -> f64 {
        self.eigenvalue_bound
    }
}
