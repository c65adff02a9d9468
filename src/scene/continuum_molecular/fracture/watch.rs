//! Owns where bonds are close to breaking: energy ratios everywhere, and the window that follows the largest.

use super::CrackGrowth;
use crate::error::Result;
use crate::scene::continuum_molecular::window::Window;
use rayon::prelude::*;

/// Dense points of a window about each seed reach this many spacings, or one farther than bonds do. A disc of 13 has
/// about 530 points: with a second seed the 500 to 1000 that a dense factor takes well (docs/notes/continuum-molecular.md).
const REACH: i32 = 13;

impl<const D: usize> CrackGrowth<'_, D> {
    /// Energy over critical energy of a bond under unit load; 0 where it cannot break.
    pub fn ratio(&self, kind: usize, here: &[f64; D], there: &[f64; D]) -> f64 {
        let b = &self.setup.bonds[kind];
        let d = b.deformation(here, there);
        if self.params.extension_only && d.stretch < 0.0 {
            return 0.0;
        }
        b.energy(&self.solid.moduli[kind], &d) / self.critical[kind]
    }

    /// Ratios of the bonds of point `p` to later points, from the whole solution.
    pub fn ratios(&self, p: usize) -> impl Iterator<Item = (usize, f64)> {
        self.setup.family.range(p).filter_map(move |slot| {
            let (q, kind) = self.setup.family.kind(slot);
            let may = q > p && !self.broken[slot] && !self.unbreakable[p] && !self.unbreakable[q];
            may.then(|| (q, self.ratio(kind, &self.x[p], &self.x[q])))
        })
    }

    /// Renews the whole solution and what is known of the bonds outside the window.
    pub fn update_whole_body(&mut self) {
        self.x = self.window.whole(&self.solid.body.blocks, &self.solid.held);
        self.stale = false;
        let outside = |p: usize| {
            let bonds = self.ratios(p);
            bonds
                .filter(|(q, _)| !self.window.holds(p) || !self.window.holds(*q))
                .fold(0.0_f64, |m, (_, r)| m.max(r))
        };
        self.max_ratio_outside = (0..self.setup.points.len())
            .into_par_iter()
            .map(outside)
            .reduce(|| 0.0, f64::max);
    }

    /// Puts a new window about the bonds nearest to breaking, and factorises the body as it is.
    pub fn move_window(&mut self) -> Result<()> {
        let worst = |p: usize| self.ratios(p).fold(0.0_f64, |m, (_, r)| m.max(r));
        let worst: Vec<f64> = (0..self.setup.points.len())
            .into_par_iter()
            .map(worst)
            .collect();
        let largest = worst.iter().fold(0.0_f64, |m, r| m.max(*r));
        let mut seeds: Vec<usize> = (0..worst.len())
            .filter(|&p| worst[p] >= 0.6 * largest && worst[p] > 0.0)
            .collect();
        seeds.sort_by(|&a, &b| worst[b].total_cmp(&worst[a]).then(a.cmp(&b)));
        self.put_window(&self.around(&seeds))?;
        self.windows += 1;
        self.update_whole_body();
        Ok(())
    }

    /// Factorises the body as it is, with a window on the `chosen` points.
    pub fn put_window(&mut self, chosen: &[usize]) -> Result<()> {
        let (window, x) = Window::new(&self.solid.body, self.setup, &self.solid.held, chosen)?;
        self.before_window = self.order.len();
        self.window = window;
        self.x = x;
        let may = |slot: usize, p: usize, q: usize| {
            !self.broken[slot] && !self.unbreakable[p] && !self.unbreakable[q]
        };
        let mut bonds = self.window.bonds(self.setup, |slot| !self.broken[slot]);
        bonds.retain(|b| may(b.slots[0], self.window.point(b.a), self.window.point(b.b)));
        self.bonds = bonds;
        Ok(())
    }

    /// Free points within reach of the seeds: first about those that no earlier one covers, so that two tips of a crack
    /// share a window, then about the others up to the window's size, the first seeds first.
    pub fn around(&self, seeds: &[usize]) -> Vec<usize> {
        let mut taken = vec![false; self.setup.points.len()];
        let mut chosen = Vec::new();
        for filling in [false, true] {
            for &seed in seeds {
                if chosen.len() >= self.params.window_points {
                    return chosen;
                }
                if filling || !taken[seed] {
                    self.cover(seed, &mut taken, &mut chosen);
                }
            }
        }
        chosen
    }

    /// Takes the free points within reach of `seed`.
    fn cover(&self, seed: usize, taken: &mut [bool], chosen: &mut Vec<usize>) {
        let points = &self.setup.points;
        let [i, j] = points.cell(seed);
        let reach = REACH.max(self.setup.family.stencil.reach() + 1);
        for dj in -reach..=reach {
            for di in -reach..=reach {
                let near = di * di + dj * dj <= reach * reach;
                let Some(p) = points.at([i + di, j + dj]).filter(|_| near) else {
                    continue;
                };
                if !taken[p] && (0..D).all(|d| self.solid.held[p * D + d].is_none()) {
                    taken[p] = true;
                    chosen.push(p);
                }
            }
        }
    }
}
