//! Owns the lattice element: central springs in two shells and a volumetric term per shell.
//!
//! Source: Zojaji et al. 2024, eqs 2–7. The paper prints one volumetric sum over all neighbours (eq 5), with which its
//! own eq 7 is wrong; squaring the sum shell by shell (Chen & Liu 2016) makes eq 7 exact, and is what stands here:
//!
//! `U = Σ_i w_i [ ½ Σ_s k_s Σ_{j∈s} dl_ij² + ½ T Σ_s (Σ_{j∈s} dl_ij)² ]`, `dl_ij = ½ n_ij · (u_j − u_i)`,
//!
//! with `w_i = 1`, or the bone fraction of the cell of a weighted site. Where tissue differs in ν, `w_i T` is each site's own.

pub mod moduli;

pub mod connected;
mod kernel;
pub mod multigrid;
mod scaled;

use crate::discretisation::lattice::sites::{Grips, Sites};
use crate::discretisation::lattice::stencil::Stencil;
use crate::operator::{MixedPrecision, Operator};
use crate::par::{each_chunk, sum_chunks};
pub use moduli::{Moduli, check_solid};
use rayon::prelude::*;
use scaled::Scaled;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard};

/// Bonds of one direction or, where bonds are taken pair by pair, of it and its opposite.
#[derive(Debug, Clone, Copy)]
struct Direction {
    /// In grid steps.
    d: [f64; 3],
    shell: usize,
    /// `k / (2 |d|²)`: a bond pulls by `spring · d (d · Δu)`.
    spring: f64,
    /// `1 / (2 |d|)`: a bond stretches by `half · d · Δu`, which it adds to its site's volumetric sum.
    half: f64,
}

impl Direction {
    /// Bond `b` of a stencil.
    fn of(stencil: &Stencil, b: usize, moduli: &Moduli) -> Self {
        let d = stencil.direction(b).map(f64::from);
        let squared: f64 = d.iter().map(|c| c * c).sum();
        let shell = usize::from(b / 2 >= stencil.first_shell_pairs);
        Direction {
            d,
            shell,
            spring: 0.5 * moduli.k[shell] / squared,
            half: 0.5 / squared.sqrt(),
        }
    }
}

/// The part of a bond between the innermost gripped planes, from a site's plane to that `steps` on; None where there is none.
fn part_in_gauge(grips: Grips, plane: i32, steps: f64) -> Option<f64> {
    let other = plane + steps as i32;
    let inside = plane.max(other).min(grips.high) - plane.min(other).max(grips.low);
    (inside > 0).then(|| f64::from(inside) / steps.abs())
}

/// Sites a task takes at once: a few hundred kilobytes of what it reads.
const PORTION: usize = 1024;

/// Sites of portion `c`, which is `len` long.
fn range(c: usize, len: usize) -> Range<usize> {
    c * PORTION..c * PORTION + len
}

/// Lattices whose sites contribute to a stress.
pub trait Virial: Sync {
    /// `Σ V_i σ_aa,i` in N mm along the load axis, of the sites that count: the derivative of their energy by a strain
    /// along it. Of a bond, only the part between the innermost gripped planes counts.
    fn virial<S: Copy + Into<f64>>(
        &self,
        u: &[[S; 3]],
        sites: Range<usize>,
        counts: impl Fn(usize) -> bool,
    ) -> f64;
}

/// The linearised lattice as an operator: `K u` is the gradient of the energy. N and mm.
pub struct Lattice {
    pub sites: Sites,
    moduli: Moduli,
    /// One of each pair of opposite directions.
    pairs: Vec<Direction>,
    double: Scaled<f64>,
    single: Scaled<f32>,
    scratch: Mutex<Vec<[f64; 2]>>,
}

impl Lattice {
    pub fn new(sites: Sites, moduli: Moduli) -> Self {
        Lattice::of(sites, moduli, None)
    }

    /// A lattice whose sites have volumetric moduli `w_i T` (N/mm) of their own, in addition to `w_i k_s`.
    pub fn with_volumetric(sites: Sites, moduli: Moduli, volumetric: Vec<f64>) -> Self {
        assert!(volumetric.len() == sites.len());
        Lattice::of(sites, moduli, Some(volumetric))
    }

    fn of(sites: Sites, moduli: Moduli, own_volumetric: Option<Vec<f64>>) -> Self {
        let stencil = sites.frame.structure.stencil();
        let pairs = 0..stencil.pairs.len();
        let pairs: Vec<Direction> = pairs
            .map(|p| Direction::of(&stencil, 2 * p, &moduli))
            .collect();
        let weighted = sites.weights.is_some();
        let double = Scaled {
            pairs: pairs.iter().map(|p| p.scaled(weighted)).collect(),
            weights: sites.weights.clone(),
            volumetric: moduli.t,
            own_volumetric,
        };
        let scratch = if double.is_volumetric() {
            sites.len()
        } else {
            0
        };
        Lattice {
            sites,
            moduli,
            pairs,
            single: double.to_single(),
            double,
            scratch: Mutex::new(vec![[0.0; 2]; scratch]),
        }
    }

    fn weight(&self, site: usize) -> f64 {
        self.sites.weights.as_ref().map_or(1.0, |w| w[site])
    }

    /// `w_i T`.
    fn volumetric(&self, site: usize) -> f64 {
        self.double.volumetric(site)
    }

    /// Every pair with both neighbours along it, from a row of them; a missing one is the site itself.
    fn bonded(&self, row: &[u32]) -> impl Iterator<Item = (&Direction, usize, usize)> {
        let ends = row.as_chunks().0.iter();
        let pairs = self.pairs.iter().zip(ends);
        pairs.map(|(pair, &[plus, minus])| (pair, plus as usize, minus as usize))
    }

    /// Volumetric sums `θ_s = Σ_{j∈s} dl_ij` of the site with these neighbours.
    fn volumetric_sums<S: Copy + Into<f64>>(&self, u: &[[S; 3]], row: &[u32]) -> [f64; 2] {
        let mut theta = [0.0; 2];
        for (pair, plus, minus) in self.bonded(row) {
            theta[pair.shell] += pair.half * along(pair.d, u[plus], u[minus]);
        }
        theta
    }

    /// Elastic energy in N mm.
    pub fn energy(&self, u: &[[f64; 3]]) -> f64 {
        sum_chunks(self.sites.len(), |range| {
            range.map(|s| self.site_energy(u, s)).sum()
        })
    }

    /// Energy of one site in N mm, by the formula of the module's head.
    pub fn site_energy(&self, u: &[[f64; 3]], site: usize) -> f64 {
        let row = self.sites.neighbours_of(site);
        let mut springs = 0.0;
        for (pair, plus, minus) in self.bonded(&row) {
            for end in [plus, minus] {
                let dl = pair.half * along(pair.d, u[end], u[site]);
                springs += self.moduli.k[pair.shell] * dl * dl;
            }
        }
        let [a, b] = self.volumetric_sums(u, &row);
        0.5 * (self.weight(site) * springs + self.volumetric(site) * (a * a + b * b))
    }
}

impl Virial for Lattice {
    fn virial<S: Copy + Into<f64>>(
        &self,
        u: &[[S; 3]],
        sites: Range<usize>,
        counts: impl Fn(usize) -> bool,
    ) -> f64 {
        let mut sum = 0.0;
        self.sites.neighbours.each(sites, |site, row| {
            if counts(site) {
                sum += self.site_virial(u, site, row);
            }
        });
        sum
    }
}

impl Lattice {
    fn site_virial<S: Copy + Into<f64>>(&self, u: &[[S; 3]], site: usize, row: &[u32]) -> f64 {
        let (axis, grips) = (self.sites.frame.axis.index(), self.sites.grips);
        let theta = match self.double.is_volumetric() {
            true => self.volumetric_sums(u, row),
            false => [0.0; 2],
        };
        let (w, t) = (self.weight(site), self.volumetric(site));
        let plane = self.sites.plane(site);
        let mut sum = 0.0;
        for (pair, plus, minus) in self.bonded(row) {
            if pair.d[axis] == 0.0 {
                continue;
            }
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let Some(share) = part_in_gauge(grips, plane, sign * pair.d[axis]) else {
                    continue;
                };
                let dl = sign * pair.half * along(pair.d, u[end], u[site]);
                let lever = pair.half * pair.d[axis] * pair.d[axis] * self.sites.frame.step_mm;
                sum += share * lever * (w * self.moduli.k[pair.shell] * dl + t * theta[pair.shell]);
            }
        }
        sum
    }
}

impl Direction {
    /// The pair as the kernels want it; where sites are weighted with the half of `½ (w_i + w_j)`.
    fn scaled(&self, weighted: bool) -> kernel::Pair<f64> {
        let d = self.d;
        let c = -self.spring * if weighted { 0.5 } else { 1.0 };
        let cyclic = |turn: usize| {
            let [x, y, z] = [0, 1, 2].map(|a| c * d[a] * d[(a + 3 - turn) % 3]);
            [x, y, z, 0.0]
        };
        kernel::Pair {
            diagonals: [cyclic(0), cyclic(1), cyclic(2)],
            lever: [self.half * d[0], self.half * d[1], self.half * d[2], 0.0],
        }
    }
}

/// `d · (a − b)`.
fn along<S: Copy + Into<f64>>(d: [f64; 3], a: [S; 3], b: [S; 3]) -> f64 {
    (0..3).map(|c| d[c] * (a[c].into() - b[c].into())).sum()
}

impl Operator<3> for Lattice {
    fn sites(&self) -> usize {
        self.sites.len()
    }

    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        let mut scratch = self.scratch();
        self.double
            .apply(&self.sites, x, y, &mut scratch, |_, _| 0.0);
    }

    fn diagonal(&self, d: &mut [[f64; 3]]) {
        d.par_chunks_mut(PORTION).enumerate().for_each(|(c, d)| {
            let sites = range(c, d.len());
            let mut d = d.iter_mut();
            self.sites.neighbours.each(sites, |site, row| {
                *d.next().expect("a row a site") = self.site_diagonal(site, row);
            });
        });
    }
}

impl MixedPrecision for Lattice {
    fn apply_single(
        &self,
        x: &[[f32; 3]],
        y: &mut [[f32; 3]],
        finish: impl Fn(usize, &mut [[f32; 3]]) -> f64 + Sync,
    ) -> f64 {
        let mut scratch = self.scratch();
        let sites = scratch.len();
        let scratch = &mut bytemuck::cast_slice_mut(&mut scratch)[..sites];
        self.single.apply(&self.sites, x, y, scratch, finish)
    }

    fn for_each_chunk(
        &self,
        x: &[[f64; 3]],
        out: &mut [[f32; 3]],
        consume: impl Fn(usize, &[[f64; 3]], &mut [[f32; 3]]) -> [f64; 2] + Sync,
    ) -> [f64; 2] {
        let (sites, double) = (&self.sites, &self.double);
        let mut t = self.scratch();
        t.par_chunks_mut(PORTION).enumerate().for_each(|(c, t)| {
            double.pressures(sites, range(c, t.len()), x, t);
        });
        each_chunk(out, PORTION, |first, out| {
            let mut image = [[0.0; 3]; PORTION];
            let image = &mut image[..out.len()];
            let own = first..first + out.len();
            double.springs(sites, own.clone(), x, image);
            if !t.is_empty() {
                double.add_volumetric_forces(sites, own, &t, image);
            }
            consume(first, image, out)
        })
    }
}

impl Lattice {
    /// Scratch for every site's `w T θ`; empty at ν = ¼, where no volumetric pass is made.
    fn scratch(&self) -> MutexGuard<'_, Vec<[f64; 2]>> {
        self.scratch
            .lock()
            .expect("no application panics while it holds the scratch")
    }

    fn site_diagonal(&self, site: usize, row: &[u32]) -> [f64; 3] {
        let w = self.weight(site);
        let (mut d, mut gradient) = ([0.0; 3], [[0.0; 3]; 2]);
        for (pair, plus, minus) in self.bonded(row) {
            for (end, sign) in [(plus, 1.0), (minus, -1.0)] {
                if end == site {
                    continue;
                }
                let spring = 0.5 * (w + self.weight(end)) * pair.spring;
                let volumetric = self.volumetric(end) * pair.half * pair.half;
                for c in 0..3 {
                    d[c] += (spring + volumetric) * pair.d[c] * pair.d[c];
                    gradient[pair.shell][c] += sign * pair.half * pair.d[c];
                }
            }
        }
        let t = self.volumetric(site);
        for c in 0..3 {
            d[c] += t * (gradient[0][c].powi(2) + gradient[1][c].powi(2));
        }
        d
    }
}
