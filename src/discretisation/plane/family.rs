//! Owns families: the neighbours of each point within a horizon, from one stencil shared by all points of the grid.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};

/// One bond of the stencil.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// Cells from the point to its neighbour.
    pub offset: [i32; 2],
    /// Undeformed bond vector.
    pub xi: [f64; 2],
    /// Its length `L`.
    pub length: f64,
    /// Share `α` of the neighbour's cell inside the horizon; 1 without partial volumes.
    pub share: f64,
}

/// The bonds of a point whose whole neighbourhood is filled, ordered by offset (y, then x).
#[derive(Debug, Clone, PartialEq)]
pub struct Stencil {
    pub spacing: f64,
    pub horizon: f64,
    pub bonds: Vec<Bond>,
}

impl Stencil {
    /// Without partial volumes the neighbours are those with `L ≤ δ (1 + 1e-12)`; with them, those with
    /// `α = clip((δ + Δ/2 − L)/Δ, 0, 1) > 0` (Hu's rule).
    pub fn new(spacing: f64, horizon: f64, partial_volumes: bool) -> Result<Self> {
        let ratio = horizon / spacing;
        if !(ratio.is_finite() && (1.0..=100.0).contains(&ratio)) {
            return Err(Error::setting(
                "grid.horizon",
                format!("δ/Δ is {ratio}; expected 1 to 100"),
                "take about 3 grid spacings",
            ));
        }
        let share = |length: f64| match partial_volumes {
            true => ((horizon + 0.5 * spacing - length) / spacing).clamp(0.0, 1.0),
            false => f64::from(length <= horizon * (1.0 + 1e-12)),
        };
        let reach = ratio.ceil() as i32 + 1;
        let mut bonds = Vec::new();
        for j in -reach..=reach {
            for i in -reach..=reach {
                let xi = [i as f64 * spacing, j as f64 * spacing];
                let length = xi[0].hypot(xi[1]);
                if (i, j) != (0, 0) && share(length) > 0.0 {
                    bonds.push(Bond {
                        offset: [i, j],
                        xi,
                        length,
                        share: share(length),
                    });
                }
            }
        }
        Ok(Stencil {
            spacing,
            horizon,
            bonds,
        })
    }

    /// `Σ f(bond) α Δ²`: the horizon integral of a function of the bond alone, on a full neighbourhood.
    pub fn integrate(&self, f: impl Fn(&Bond) -> f64) -> f64 {
        let volume = self.spacing * self.spacing;
        self.bonds.iter().map(|b| f(b) * b.share * volume).sum()
    }

    /// Cells from a point to its farthest neighbour along an axis.
    pub fn reach(&self) -> i32 {
        self.bonds.iter().map(|b| b.offset[0]).max().unwrap_or(0)
    }
}

/// Neighbours of the first `rows` points, in compressed rows ordered as the stencil is. A bond between two of them is
/// listed in both rows.
#[derive(Debug, Clone)]
pub struct Family {
    pub stencil: Stencil,
    start: Vec<u32>,
    neighbour: Vec<u32>,
    bond: Vec<u16>,
}

impl Family {
    pub fn new(points: &Points, rows: usize, stencil: Stencil) -> Self {
        let mut start = vec![0];
        let mut neighbour = Vec::new();
        let mut bond = Vec::new();
        for i in 0..rows {
            let [ci, cj] = points.cell(i);
            for (b, entry) in stencil.bonds.iter().enumerate() {
                if let Some(j) = points.at([ci + entry.offset[0], cj + entry.offset[1]]) {
                    neighbour.push(j as u32);
                    bond.push(b as u16);
                }
            }
            start.push(neighbour.len() as u32);
        }
        Family {
            stencil,
            start,
            neighbour,
            bond,
        }
    }

    /// Keeps the bonds for which `keep(i, j)` holds (the same for both ends), for cuts and notches.
    pub fn retain(&mut self, keep: impl Fn(usize, usize) -> bool) {
        let mut kept = 0;
        let mut first = 0;
        for i in 0..self.rows() {
            let end = self.start[i + 1] as usize;
            for b in first..end {
                if keep(i, self.neighbour[b] as usize) {
                    self.neighbour[kept] = self.neighbour[b];
                    self.bond[kept] = self.bond[b];
                    kept += 1;
                }
            }
            first = end;
            self.start[i + 1] = kept as u32;
        }
        self.neighbour.truncate(kept);
        self.bond.truncate(kept);
    }

    /// Points that have a row.
    pub fn rows(&self) -> usize {
        self.start.len() - 1
    }

    /// Bonds listed, each from each of its ends that has a row.
    pub fn len(&self) -> usize {
        self.neighbour.len()
    }

    pub fn is_empty(&self) -> bool {
        self.neighbour.is_empty()
    }

    /// Where the row of point `i` lies in the list of bonds.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i] as usize..self.start[i + 1] as usize
    }

    /// The neighbour and the stencil's bond at place `b` of the list.
    pub fn entry(&self, b: usize) -> (usize, &Bond) {
        (
            self.neighbour[b] as usize,
            &self.stencil.bonds[self.bond[b] as usize],
        )
    }

    /// The neighbour, and the number of the stencil's bond, at place `b` of the list.
    pub fn kind(&self, b: usize) -> (usize, usize) {
        (self.neighbour[b] as usize, self.bond[b] as usize)
    }

    /// Neighbours of point `i` with the stencil's bond to each.
    pub fn of(&self, i: usize) -> impl Iterator<Item = (usize, &Bond)> {
        self.range(i).map(|b| self.entry(b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts and sums with Hu's partial volumes, and without.
    #[test]
    fn stencils_count_as_published() {
        let hu = |m: f64| Stencil::new(1.0, m, true).unwrap();
        for (m, bonds, sum) in [(5.0, 96, 78.126525), (3.0, 36, 27.388070)] {
            assert_eq!(hu(m).bonds.len(), bonds);
            assert!((hu(m).integrate(|_| 1.0) - sum).abs() < 1e-6);
        }
        let counts = [
            (2.01, 12),
            (2.5125, 20),
            (3.01, 28),
            (4.02, 48),
            (5.025, 80),
            (10.05, 324),
        ];
        for (m, bonds) in counts {
            assert_eq!(
                Stencil::new(0.1, 0.1 * m, false).unwrap().bonds.len(),
                bonds
            );
        }
    }

    #[test]
    fn families_are_mutual_and_cuts_cut_both_ways() {
        let points = Points::from_box([0.0; 2], 1.0, [6, 5], |p| p[0] + p[1] < 8.0);
        let stencil = Stencil::new(1.0, 2.01, false).unwrap();
        let mut family = Family::new(&points, points.len(), stencil);
        let mutual = |f: &Family| {
            (0..f.rows()).all(|i| f.of(i).all(|(j, _)| f.of(j).any(|(back, _)| back == i)))
        };
        assert!(mutual(&family));
        let before = family.len();
        let side = |i: usize| points.position(i)[0] < 3.0;
        family.retain(|i, j| side(i) == side(j));
        assert!(mutual(&family) && family.len() < before);
        assert!((0..family.rows()).all(|i| family.of(i).all(|(j, _)| side(i) == side(j))));
    }
}
