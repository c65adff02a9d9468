//! Owns the making of bonds between components of bone that touch.

use super::touching::Touching;
use super::{Bonds, Component};
use crate::discretisation::lattice::placement::Frame;
use rayon::prelude::*;

/// Bonds with less than this share are left out.
const LEAST_SHARE: f32 = 1e-4;

/// What bonds are made from.
pub struct Bonding<'a> {
    pub frame: &'a Frame,
    pub components: &'a [Component],
    pub touching: &'a Touching,
}

/// ConnectedSites whose bonds a task makes at once.
const PORTION: usize = 4096;

impl Bonding<'_> {
    /// The bonds of all components: counted first, so that no more is ever held than they need.
    pub fn all(&self) -> Bonds {
        let directions = self.directions();
        let count = self.components.len();
        let lengths: Vec<u32> = (0..count)
            .into_par_iter()
            .map_init(Vec::new, |row, p| {
                self.row(p, &directions, row);
                row.len() as u32
            })
            .collect();
        let mut start = Vec::with_capacity(count + 1);
        start.push(0u32);
        let mut total = 0;
        for length in lengths {
            total += length;
            start.push(total);
        }
        let total = total as usize;
        let (mut neighbour, mut direction) = (vec![0u32; total], vec![0u8; total]);
        let mut share = vec![0f32; total];
        let mut rest = (&mut neighbour[..], &mut direction[..], &mut share[..]);
        let mut portions = Vec::new();
        for first in (0..count).step_by(PORTION) {
            let last = (first + PORTION).min(count);
            let n = (start[last] - start[first]) as usize;
            let (a, b, c) = rest;
            let (a, b, c) = (a.split_at_mut(n), b.split_at_mut(n), c.split_at_mut(n));
            portions.push((first..last, a.0, b.0, c.0));
            rest = (a.1, b.1, c.1);
        }
        portions
            .into_par_iter()
            .for_each(|(components, neighbour, direction, share)| {
                let (mut row, mut at) = (Vec::new(), 0);
                for p in components {
                    self.row(p, &directions, &mut row);
                    for &(end, d, s) in &row {
                        (neighbour[at], direction[at], share[at]) = (end, d, s);
                        at += 1;
                    }
                }
            });
        Bonds {
            start,
            neighbour,
            direction,
            share,
        }
    }

    fn directions(&self) -> Vec<[i32; 3]> {
        let stencil = self.frame.structure.stencil();
        (0..stencil.coordination())
            .map(|b| stencil.direction(b))
            .collect()
    }

    /// One component's bonds: end, direction, share; those to components it touches, and those along diagonals past them.
    fn row(&self, p: usize, directions: &[[i32; 3]], row: &mut Vec<(u32, u8, f32)>) {
        row.clear();
        for (q, b) in self.touching.of(p) {
            row.push(self.bond(p, q, b, directions[b]));
            for (r, e) in self.touching.of(q) {
                let sum: [i32; 3] = std::array::from_fn(|a| directions[b][a] + directions[e][a]);
                let Some(diagonal) = directions.iter().position(|d| *d == sum) else {
                    continue;
                };
                let same = |x: &(u32, u8, f32)| (x.0 as usize, usize::from(x.1)) == (r, diagonal);
                if !row.iter().any(same) {
                    row.push(self.bond(p, r, diagonal, sum));
                }
            }
        }
        row.retain(|x| x.2 > LEAST_SHARE);
        row.sort_unstable_by_key(|x| (x.1, x.0));
    }

    fn bond(&self, p: usize, q: usize, b: usize, d: [i32; 3]) -> (u32, u8, f32) {
        let share = (self.along(p, d, 1) * self.along(q, d, -1)).sqrt();
        // Of the cells around the end planes only the half between the planes is under load.
        let axis = self.frame.axis.index();
        let plane = self.frame.indices(self.components[p].cell as usize)[axis];
        let half = d[axis] == 0 && (plane == 0 || plane == self.frame.planes() as i32 - 1);
        (q as u32, b as u8, if half { 0.5 * share } else { share })
    }

    /// Mean cross-section of a component's half cell towards (`sign` 1) or against a direction.
    fn along(&self, p: usize, d: [i32; 3], sign: i32) -> f32 {
        let axes = (0..3).filter(|&a| d[a] != 0);
        let (sum, n) = axes.fold((0.0, 0.0), |(sum, n), a| {
            let side = usize::from(sign * d[a] > 0);
            (sum + self.components[p].ends[a][side], n + 1.0)
        });
        sum / n
    }
}
