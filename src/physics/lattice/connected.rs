//! Owns the lattice of connected components: the lattice element with a share of a whole bond's stiffness on each bond.
//!
//! `U = Σ_i [ ½ Σ_s k_s Σ_j σ_ij dl_ij² + ½ T Σ_s (N_s / Σ_j σ_ij) (Σ_j σ_ij dl_ij)² ]` with shares `σ` and `N_s` bonds
//! of a whole site in shell `s`. Where all shares are 1 this is the uniform lattice, and by Cauchy and Schwarz it is never
//! negative where the uniform one is not (`k_s + N_s T >= 0`), whatever the shares.

use super::{Direction, Moduli, Virial, part_in_gauge};
use crate::discretisation::lattice::connected::ConnectedSites;
use crate::operator::coarsen::{Block, Coarsen, VisitRow};
use crate::operator::{MixedPrecision, Operator};
use crate::par::each_chunk;
use rayon::prelude::*;
use std::ops::Range;

/// Sites a task takes at once.
const PORTION: usize = 512;

/// The linearised lattice of connected components as an operator: `K u` is the gradient of the energy. N and mm.
pub struct ConnectedLattice {
    pub sites: ConnectedSites,
    moduli: Moduli,
    directions: Vec<Direction>,
    /// `d` and `spring · d` of each direction, for products in single precision.
    single: Vec<[[f32; 3]; 2]>,
    /// `T N_s / Σ σ` of each site and shell; empty at ν = ¼, where no volumetric pass is made.
    volumetric: Vec<[f64; 2]>,
}

impl ConnectedLattice {
    pub fn new(sites: ConnectedSites, moduli: Moduli) -> Self {
        let stencil = sites.frame.structure.stencil();
        let directions = 0..stencil.coordination();
        let directions: Vec<Direction> = directions
            .map(|b| Direction::of(&stencil, b, &moduli))
            .collect();
        let single = |d: &Direction| [1.0, d.spring].map(|by| d.d.map(|c| (by * c) as f32));
        let mut whole = [0.0; 2];
        directions.iter().for_each(|d| whole[d.shell] += 1.0);
        let coefficients = |site: usize| {
            let mut shares = [0.0; 2];
            for (_, b, share) in sites.bonds.of(site) {
                shares[directions[b].shell] += f64::from(share);
            }
            let of = |s: usize| {
                if shares[s] > 0.0 {
                    moduli.t * whole[s] / shares[s]
                } else {
                    0.0
                }
            };
            [of(0), of(1)]
        };
        let count = if moduli.t == 0.0 { 0 } else { sites.len() };
        ConnectedLattice {
            volumetric: (0..count).into_par_iter().map(coefficients).collect(),
            single: directions.iter().map(single).collect(),
            sites,
            moduli,
            directions,
        }
    }

    /// Elongations of a site's bonds: end, direction, share, `dl`.
    #[inline]
    fn stretched<'b, S: Copy + Into<f64>>(
        &'b self,
        u: &'b [[S; 3]],
        site: usize,
    ) -> impl Iterator<Item = (usize, &'b Direction, f64, f64)> + 'b {
        self.sites.bonds.of(site).map(move |(end, b, share)| {
            let d = &self.directions[b];
            let along = super::along(d.d, u[end], u[site]);
            (end, d, f64::from(share), d.half * along)
        })
    }

    /// `T N_s / Σ σ · Σ σ dl` of both shells.
    fn pressures<S: Copy + Into<f64>>(&self, u: &[[S; 3]], site: usize) -> [f64; 2] {
        let mut sums = [0.0; 2];
        for (_, d, share, dl) in self.stretched(u, site) {
            sums[d.shell] += share * dl;
        }
        let t = self.volumetric[site];
        [t[0] * sums[0], t[1] * sums[1]]
    }

    /// Energy of one site in N mm, by the formula of the module's head.
    pub fn site_energy(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let (mut energy, mut sums) = (0.0, [0.0; 2]);
        for (_, d, share, dl) in self.stretched(u, site) {
            energy += 0.5 * self.moduli.k[d.shell] * share * dl * dl;
            sums[d.shell] += share * dl;
        }
        let t = self.volumetric.get(site).copied().unwrap_or_default();
        energy + 0.5 * (t[0] * sums[0] * sums[0] + t[1] * sums[1] * sums[1])
    }

    /// Elastic energy in N mm.
    pub fn energy(&self, u: &[[f64; 3]]) -> f64 {
        crate::par::sum_chunks(self.sites.len(), |sites| {
            sites.map(|s| self.site_energy(u, s)).sum()
        })
    }

    /// Of every site, what a volumetric pass gives; none at ν = ¼.
    fn all_pressures<S: Copy + Into<f64> + Sync>(&self, u: &[[S; 3]]) -> Vec<[f64; 2]> {
        assert_eq!(u.len(), self.sites.len());
        (0..self.volumetric.len())
            .into_par_iter()
            .with_min_len(PORTION)
            .map(|site| self.pressures(u, site))
            .collect()
    }

    /// A site's row of `K u`.
    fn row<S: Copy + Into<f64>>(
        &self,
        u: &[[S; 3]],
        pressures: &[[f64; 2]],
        site: usize,
    ) -> [f64; 3] {
        let mut f = [0.0; 3];
        for (end, d, share, dl) in self.stretched(u, site) {
            let mut pull = 2.0 * self.moduli.k[d.shell] * dl;
            if let (Some(here), Some(there)) = (pressures.get(site), pressures.get(end)) {
                pull += here[d.shell] + there[d.shell];
            }
            (0..3).for_each(|c| f[c] -= share * pull * d.half * d.d[c]);
        }
        f
    }
}

impl Virial for ConnectedLattice {
    fn virial<S: Copy + Into<f64>>(
        &self,
        u: &[[S; 3]],
        sites: Range<usize>,
        counts: impl Fn(usize) -> bool,
    ) -> f64 {
        let sites = sites.filter(|&s| counts(s));
        sites.map(|s| self.site_virial(u, s)).sum()
    }
}

impl ConnectedLattice {
    fn site_virial<S: Copy + Into<f64>>(&self, u: &[[S; 3]], site: usize) -> f64 {
        let (axis, grips) = (self.sites.frame.axis.index(), self.sites.grips);
        let plane = self.sites.indices[site][axis];
        let pressures = if self.volumetric.is_empty() {
            [0.0; 2]
        } else {
            self.pressures(u, site)
        };
        let part = |(_, d, share, dl): (usize, &Direction, f64, f64)| {
            let Some(inside) = part_in_gauge(grips, plane, d.d[axis]) else {
                return 0.0;
            };
            let lever = d.half * d.d[axis] * d.d[axis] * self.sites.frame.step_mm;
            inside * lever * share * (self.moduli.k[d.shell] * dl + pressures[d.shell])
        };
        self.stretched(u, site).map(part).sum()
    }
}

impl Operator<3> for ConnectedLattice {
    fn sites(&self) -> usize {
        self.sites.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let pressures = self.all_pressures(x);
        y.par_iter_mut()
            .with_min_len(PORTION)
            .enumerate()
            .for_each(|(site, y)| *y = self.row(x, &pressures, site));
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(site, d)| {
            let (mut own, mut gradient) = ([0.0; 3], [[0.0; 3]; 2]);
            for (end, b, share) in self.sites.bonds.of(site) {
                let (share, b) = (f64::from(share), &self.directions[b]);
                let there = self.volumetric.get(end).map_or(0.0, |t| t[b.shell]);
                for c in 0..3 {
                    let step = b.half * b.d[c];
                    own[c] += share * b.spring * b.d[c] * b.d[c] + there * (share * step).powi(2);
                    gradient[b.shell][c] += share * step;
                }
            }
            let t = self.volumetric.get(site).copied().unwrap_or_default();
            for c in 0..3 {
                own[c] += t[0] * gradient[0][c].powi(2) + t[1] * gradient[1][c].powi(2);
            }
            *d = own;
        });
    }
}

impl MixedPrecision for ConnectedLattice {
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64 {
        let pressures = self.all_pressures(x);
        let [sum] = each_chunk(y, PORTION, |first, y| {
            for (site, y) in (first..).zip(y.iter_mut()) {
                *y = self.row(x, &pressures, site).map(|f| f as f32);
            }
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
        let pressures = self.all_pressures(x);
        each_chunk(out, PORTION, |first, out| {
            let sites = first..first + out.len();
            let image: Vec<[f64; 3]> = sites.map(|s| self.row(x, &pressures, s)).collect();
            consume(first, &image, out)
        })
    }
}

/// What multigrid sees of a lattice of connected components: its springs.
pub struct ConnectedSprings<'a>(pub &'a ConnectedLattice);

impl ConnectedSprings<'_> {
    /// Neighbour and spring of each bond of a site.
    fn springs(&self, site: usize) -> impl Iterator<Item = (usize, [f64; 3], f64)> + '_ {
        let bonds = self.0.sites.bonds.of(site);
        bonds.map(|(end, b, share)| {
            let d = &self.0.directions[b];
            (end, d.d, d.spring * f64::from(share))
        })
    }
}

impl Operator<3> for ConnectedSprings<'_> {
    fn sites(&self) -> usize {
        self.0.sites()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        y.par_chunks_mut(PORTION).enumerate().for_each(|(c, y)| {
            let first = c * PORTION;
            self.rows_f64(first..first + y.len(), x, y);
        });
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_iter_mut().enumerate().for_each(|(site, own)| {
            *own = [0.0; 3];
            for (_, d, spring) in self.springs(site) {
                (0..3).for_each(|c| own[c] += spring * d[c] * d[c]);
            }
        });
    }
}

impl Coarsen for ConnectedSprings<'_> {
    fn positions(&self, sites: Range<usize>, x: &mut [[f64; 3]]) {
        let ConnectedSites { frame, indices, .. } = &self.0.sites;
        for (x, at) in x.iter_mut().zip(&indices[sites]) {
            *x = frame.position_mm(*at);
        }
    }

    fn each_row(&self, sites: Range<usize>, visit: &mut VisitRow<Block>) {
        let (mut columns, mut blocks) = (Vec::with_capacity(19), Vec::with_capacity(19));
        for site in sites {
            let mut own = [[0f32; 3]; 3];
            columns.clear();
            blocks.clear();
            for (end, d, spring) in self.springs(site) {
                let block = d.map(|a| d.map(|b| (spring * a * b) as f32));
                for (own, row) in own.iter_mut().zip(&block) {
                    (0..3).for_each(|b| own[b] += row[b]);
                }
                columns.push(end as u32);
                blocks.push(block.map(|r| r.map(|v| -v)));
            }
            columns.push(site as u32);
            blocks.push(own);
            visit(site, &columns, &blocks);
        }
    }

    fn reach(&self, sites: Range<usize>) -> Range<usize> {
        let mut reach = sites.clone();
        for (end, ..) in sites.flat_map(|site| self.springs(site)) {
            reach.start = reach.start.min(end);
            reach.end = reach.end.max(end + 1);
        }
        reach
    }

    fn rows_f64(&self, sites: Range<usize>, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        for (site, y) in sites.zip(y) {
            let mut f = [0.0; 3];
            for (end, d, spring) in self.springs(site) {
                let along: f64 = (0..3).map(|c| d[c] * (x[site][c] - x[end][c])).sum();
                (0..3).for_each(|c| f[c] += spring * along * d[c]);
            }
            *y = f;
        }
    }

    fn rows_f32(&self, sites: Range<usize>, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
        for (site, y) in sites.zip(y) {
            let mut f = [0f32; 3];
            for (end, b, share) in self.0.sites.bonds.of(site) {
                let [d, pull] = &self.0.single[b];
                let along: f32 = (0..3).map(|c| d[c] * (x[site][c] - x[end][c])).sum();
                (0..3).for_each(|c| f[c] += share * along * pull[c]);
            }
            *y = f;
        }
    }

    /// Of one spring, `(u_i − u_j)² <= 2 u_i² + 2 u_j²`.
    fn eigenvalue_bound(&self) -> f64 {
        2.0
    }
}
