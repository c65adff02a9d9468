//! Owns the preconditioner of thin spring networks: a sparse Cholesky factor of the network with a small shift.
//!
//! Where a lattice is coarser than its struts, sites have few bonds, and pieces of all sizes hang by one site or two: they turn without
//! energy. Multigrid takes the sites of a box for a rigid body, so it cannot make such motions, and conjugate gradients has to find them one by
//! one (1541 iterations on a core). Networks so thin have sparse factors: 37 values an unknown on that core.

use crate::error::Result;
use crate::operator::SinglePreconditioner;
use crate::operator::coarsen::Coarsen;
use crate::operator::held::Held;
use crate::operator::sparse::Sparse;
use crate::solver::direct::DirectLlt;
use crate::solver::direct::fill::Order;
use std::sync::Mutex;

/// Shift, in units of the diagonal. Mechanisms have no stiffness of their own and need some; what bears load is stiffer: frames of forty
/// sites bend at some 4e-7 of it. Rounding of a single-precision residual is magnified by its inverse.
const SHIFT: f64 = 1e-7;

/// `z = (A + 1e-7 D)⁻¹ r` on the free unknowns that have stiffness.
pub struct NetworkFactor {
    /// Site and component of each.
    unknowns: Vec<(u32, u8)>,
    /// Used by one call at a time.
    factor: Mutex<(DirectLlt, Vec<f64>)>,
}

impl NetworkFactor {
    /// In the given order of the network's sites. None where nothing is free, or the factorisation fails.
    pub fn new(network: &impl Coarsen, held: &Held, order: &Order) -> Option<Self> {
        let (a, unknowns) = shifted(network, held, order);
        if unknowns.is_empty() {
            return None;
        }
        let llt = factorised(&a).ok()?;
        let room = vec![0.0; a.n()];
        Some(NetworkFactor {
            unknowns,
            factor: Mutex::new((llt, room)),
        })
    }
}

fn factorised(a: &Sparse) -> Result<DirectLlt> {
    let as_numbered: Vec<usize> = (0..a.n()).collect();
    let mut llt = DirectLlt::new(a, &as_numbered)?;
    llt.factorize(a)?;
    Ok(llt)
}

/// The shifted matrix, its unknowns numbered as they are eliminated, and site and component of each.
fn shifted(network: &impl Coarsen, held: &Held, order: &Order) -> (Sparse, Vec<(u32, u8)>) {
    let rows = Rows::of(network);
    let largest = rows
        .own
        .iter()
        .flat_map(|k| [k[0][0], k[1][1], k[2][2]])
        .fold(0.0, f64::max);
    let (mut number, mut unknowns) = (vec![[u32::MAX; 3]; rows.own.len()], Vec::new());
    for &site in &order.order {
        let own = &rows.own[site as usize];
        for (c, number) in number[site as usize].iter_mut().enumerate() {
            if !held.is_held(site as usize, c) && own[c][c] > SHIFT * largest {
                *number = unknowns.len() as u32;
                unknowns.push((site, c as u8));
            }
        }
    }
    (rows.matrix(&number, &unknowns), unknowns)
}

/// The couplings of a network, without its diagonal blocks, in double precision.
struct Rows {
    start: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<[[f32; 3]; 3]>,
    /// Minus the sum of each row's couplings: a translation costs nothing to the last bit, so no rounding makes a mechanism stiff.
    own: Vec<[[f64; 3]; 3]>,
}

impl Rows {
    fn of(network: &impl Coarsen) -> Self {
        let sites = network.sites();
        let mut rows = Rows {
            start: vec![0],
            columns: Vec::new(),
            blocks: Vec::new(),
            own: vec![[[0.0; 3]; 3]; sites],
        };
        network.each_row(0..sites, &mut |site, columns, blocks| {
            for (&column, block) in columns
                .iter()
                .zip(blocks)
                .filter(|(j, _)| **j as usize != site)
            {
                rows.columns.push(column);
                rows.blocks.push(*block);
                for (own, block) in rows.own[site].iter_mut().zip(block) {
                    own.iter_mut()
                        .zip(block)
                        .for_each(|(own, v)| *own -= f64::from(*v));
                }
            }
            rows.start.push(rows.columns.len());
        });
        rows
    }

    /// The shifted matrix of the unknowns.
    fn matrix(&self, number: &[[u32; 3]], unknowns: &[(u32, u8)]) -> Sparse {
        let row = |k: usize| (unknowns[k].0 as usize, unknowns[k].1 as usize);
        let mut a = Sparse::from_pattern(unknowns.len(), |k, list| {
            let (site, _) = row(k);
            let others = &self.columns[self.start[site]..self.start[site + 1]];
            let sites = others.iter().map(|&j| j as usize).chain([site]);
            list.extend(sites.flat_map(|j| number[j]).filter(|&q| q != u32::MAX));
        });
        a.fill(|rows| {
            for k in rows.range() {
                let (site, c) = row(k);
                for at in self.start[site]..self.start[site + 1] {
                    for (d, &q) in number[self.columns[at] as usize].iter().enumerate() {
                        if q != u32::MAX {
                            rows.add(k, q as usize, f64::from(self.blocks[at][c][d]));
                        }
                    }
                }
                for (d, &q) in number[site]
                    .iter()
                    .enumerate()
                    .filter(|(_, q)| **q != u32::MAX)
                {
                    let shift = if d == c { 1.0 + SHIFT } else { 1.0 };
                    rows.add(k, q as usize, shift * self.own[site][c][d]);
                }
            }
        });
        a
    }
}

impl SinglePreconditioner<3> for NetworkFactor {
    fn apply_single(&self, r: &[[f32; 3]], z: &mut Vec<[f32; 3]>, _: &mut Vec<[f32; 3]>) {
        let mut factor = self.factor.lock().unwrap_or_else(|e| e.into_inner());
        let (llt, x) = &mut *factor;
        let place = |&(site, c): &(u32, u8)| (site as usize, c as usize);
        for (x, (site, c)) in x.iter_mut().zip(self.unknowns.iter().map(place)) {
            *x = f64::from(r[site][c]);
        }
        llt.solve(x);
        z.fill([0.0; 3]);
        for (x, (site, c)) in x.iter().zip(self.unknowns.iter().map(place)) {
            z[site][c] = *x as f32;
        }
    }
}
