//! Owns the lattice of one specimen: its sites, their neighbours, its grips, and what was dropped.

use crate::discretisation::lattice::marks::{Marks, Numbered};
use crate::discretisation::lattice::neighbours::{Neighbours, Row};
use crate::discretisation::lattice::placement::Frame;
use crate::discretisation::lattice::stencil::Stencil;
use rayon::prelude::*;

/// Sites that carry load, numbered with x fastest.
#[derive(Debug, Clone)]
pub struct Sites {
    pub frame: Frame,
    /// Grid indices of each site.
    pub indices: Vec<[i32; 3]>,
    /// A missing neighbour is the site itself (its bond then stretches by nothing).
    pub neighbours: Neighbours,
    /// Stiffness over that of a whole site of the lattice's tissue, only where sites differ (weighted by bone, mixed tissue).
    pub weights: Option<Vec<f64>>,
    /// Planes (indices along the load axis) up to which, and from which, sites are gripped.
    pub grips: Grips,
    /// Sites that exist but have no path of bonds to both grips.
    pub dropped: usize,
}

/// Planes along the load axis that are held: `0..=low` and `high..`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grips {
    pub low: i32,
    pub high: i32,
}

impl Grips {
    /// Grips of thickness `grip_mm` from each face, at least the end planes (BCC and FCC: the end planes of both
    /// sublattices, that is all sites within LP/2). None where the grips meet.
    pub fn new(frame: &Frame, length_mm: f64, grip_mm: f64) -> Option<Self> {
        let a = frame.axis.index();
        let last = frame.planes() as i32 - 1;
        let least = frame.structure.steps_per_lp() as i32 - 1;
        let within = |depth: f64| ((depth + 1e-9 * frame.step_mm) / frame.step_mm).floor() as i32;
        let last_mm = frame.first_mm[a] + f64::from(last) * frame.step_mm;
        let low = within(grip_mm - frame.first_mm[a]).max(least);
        let high = last - within(grip_mm - (length_mm - last_mm)).max(least);
        (low < high).then_some(Grips { low, high })
    }

    pub fn holds(&self, plane: i32) -> bool {
        plane <= self.low || plane >= self.high
    }
}

impl Sites {
    /// Builds the lattice from the candidates' weights, keeping what has a path of bonds to both grips.
    pub fn connect(frame: Frame, weights: Vec<f32>, grips: Grips) -> Self {
        let stencil = frame.structure.stencil();
        let kept = Numbered::from(load_carrying(&frame, &weights, &stencil, grips));
        let existing = weights.iter().filter(|&&w| w > 0.0).count();
        let weighted = weights.iter().any(|&w| w > 0.0 && w != 1.0);
        let own = |c: usize| f64::from(weights[c]);
        let own: Option<Vec<f64>> = weighted.then(|| kept.iter().map(own).collect());
        // A frame has many more candidates than sites, above all where structure is thin: none of it is kept for long.
        drop(weights);
        let mut indices = Vec::with_capacity(kept.len());
        indices.extend(kept.iter().map(|c| frame.indices(c)));
        let row_step = frame.structure.steps_per_lp() as i32;
        let follows = |s: usize| {
            let [i, j, k] = indices[s];
            s > 0 && indices[s - 1] == [i - row_step, j, k]
        };
        let neighbours = Neighbours::new(kept.len(), &stencil, follows, |s, b| {
            kept.number(step(&frame, indices[s], stencil.direction(b))?)
        });
        Sites {
            frame,
            dropped: existing - kept.len(),
            indices,
            neighbours,
            weights: own,
            grips,
        }
    }

    pub fn len(&self) -> usize {
        self.indices.len()
    }

    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// Neighbours of a site, one per bond of the stencil; a missing one is the site itself.
    pub fn neighbours_of(&self, site: usize) -> Row {
        self.neighbours.row(site)
    }

    /// Calls `visit` with every site and its neighbours, as [`Sites::neighbours_of`], but cheaper.
    pub fn each_row(&self, mut visit: impl FnMut(usize, &[u32])) {
        let z = self.neighbours.coordination();
        let all = 0..self.len();
        self.neighbours
            .each(all, |site, row| visit(site, &row[..z]));
    }

    /// Index of a site's plane along the load axis.
    pub fn plane(&self, site: usize) -> i32 {
        self.indices[site][self.frame.axis.index()]
    }

    /// Bonds, each counted once.
    pub fn bonds(&self) -> usize {
        let bonded = |s: usize| self.neighbours.bonds(s) as usize;
        (0..self.len()).into_par_iter().map(bonded).sum::<usize>() / 2
    }

    /// Whether a site has all its bonds; on the loaded faces, all the bonds that stay inside the volume.
    pub fn fully_coordinated(&self, site: usize) -> bool {
        let stencil = self.frame.structure.stencil();
        let a = self.frame.axis.index();
        let last = self.frame.planes() as i32 - 1;
        (0..stencil.coordination()).all(|b| {
            let plane = self.plane(site) + stencil.direction(b)[a];
            plane < 0 || plane > last || self.neighbours.has(site, b)
        })
    }

    /// Distance of the innermost gripped planes in mm.
    pub fn gauge_length_mm(&self) -> f64 {
        f64::from(self.grips.high - self.grips.low) * self.frame.step_mm
    }

    /// Volume of one site's cell in mm³.
    pub fn cell_mm3(&self) -> f64 {
        self.frame.structure.cell_volume() * self.frame.lp_mm.powi(3)
    }

    /// Volume of all cells in mm³, of weighted sites that of their bone.
    pub fn volume_mm3(&self) -> f64 {
        let whole = match &self.weights {
            Some(weights) => weights.iter().sum(),
            None => self.len() as f64,
        };
        whole * self.cell_mm3()
    }
}

/// The candidate one bond away, if within the frame.
fn step(frame: &Frame, at: [i32; 3], direction: [i32; 3]) -> Option<usize> {
    frame.candidate(std::array::from_fn(|a| at[a] + direction[a]))
}

/// Candidates with a path of bonds to both grips.
fn load_carrying(frame: &Frame, weights: &[f32], stencil: &Stencil, grips: Grips) -> Marks {
    let a = frame.axis.index();
    let plane = |c: usize| (weights[c] > 0.0).then(|| frame.indices(c)[a]);
    Marks::between(
        weights.len(),
        |c| plane(c).is_some_and(|plane| plane <= grips.low),
        |c| plane(c).is_some_and(|plane| plane >= grips.high),
        |c| {
            let at = frame.indices(c);
            (0..stencil.coordination())
                .filter_map(move |b| step(frame, at, stencil.direction(b)))
                .filter(move |&n| weights[n] > 0.0)
        },
    )
}
