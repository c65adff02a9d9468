//! Owns the fast sum over bonds: energy, force and the energy's slope of every material point, eight neighbours of a
//! row of cells at a time. Points are spread over a grid padded by the horizon, so that a bond is a constant shift and
//! its partners are read in one piece, without a list of neighbours.

use crate::discretisation::plane::Points;
use crate::discretisation::plane::family::Stencil;
use crate::physics::growth::Weight;
use crate::simd::{Isa, isa};
use rayon::prelude::*;

const LANES: usize = 8;
type Lane = [f64; LANES];

/// Where the placement of an empty cell is put: far from all bodies, so that no bond to it has length zero; its volume
/// is zero, so that it adds nothing.
const AWAY: f64 = 1e30;

const NONE: u32 = u32::MAX;

/// Blocks per parallel task.
const TASK: usize = 64;

/// What the bonds of a point sum to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PointState {
    /// Weighted energy density Ψ (eq 11).
    pub energy: f64,
    /// Force density (eq 20 before it is set to zero).
    pub force: [f64; 2],
    /// `∂Ψ/∂ρ` by the point's own density.
    pub by_density: f64,
}

/// The grid, padded, with what does not change over time.
#[derive(Debug, Clone)]
pub struct Padded {
    bonds: Vec<Shift>,
    /// Cell of each point.
    place: Vec<u32>,
    /// Share of each cell that belongs to the body.
    volume: Vec<f64>,
    /// First cell of each block.
    first: Vec<u32>,
    /// The material point in each lane of each block.
    lanes: Vec<[u32; LANES]>,
}

#[derive(Debug, Clone, Copy)]
struct Shift {
    by: isize,
    length: f64,
    /// `C V / L`, of a whole cell.
    stiffness: f64,
}

/// Placements and densities in the padded grid; densities are halved and relative, so that two of them add to a mean.
struct Spread {
    x: Vec<f64>,
    y: Vec<f64>,
    half: Vec<f64>,
}

impl Padded {
    /// `rows` material points come first in `points`; `shares` as in [`super::BondBased::shares`].
    pub fn new(
        points: &Points,
        rows: usize,
        stencil: &Stencil,
        micromodulus: f64,
        shares: Option<&[f64]>,
    ) -> Self {
        let (low, n) = points.bounds();
        let reach = stencil.reach();
        let pad = reach as usize;
        let stride = n[0] + 2 * pad + LANES;
        let size = stride * (n[1] + 2 * pad);
        let cell = |p: usize| {
            let c = points.cell(p);
            let at = |a: usize| (c[a] - low[a] + reach) as usize;
            at(1) * stride + at(0)
        };
        let place: Vec<u32> = (0..points.len()).map(|p| cell(p) as u32).collect();
        let mut volume = vec![0.0; size];
        let mut material = vec![NONE; size];
        for (p, &at) in place.iter().enumerate() {
            volume[at as usize] = shares.map_or(1.0, |s| s[p]);
            if p < rows {
                material[at as usize] = p as u32;
            }
        }
        let (mut first, mut lanes) = (Vec::new(), Vec::new());
        let mut at = 0;
        while at < size {
            if material[at] == NONE {
                at += 1;
                continue;
            }
            first.push(at as u32);
            lanes.push(std::array::from_fn(|l| {
                material.get(at + l).copied().unwrap_or(NONE)
            }));
            at += LANES;
        }
        let area = stencil.spacing * stencil.spacing;
        let shift = |b: &crate::discretisation::plane::family::Bond| Shift {
            by: b.offset[1] as isize * stride as isize + b.offset[0] as isize,
            length: b.length,
            stiffness: micromodulus * b.share * area / b.length,
        };
        Padded {
            bonds: stencil.bonds.iter().map(shift).collect(),
            place,
            volume,
            first,
            lanes,
        }
    }

    fn spread(&self, values: &[f64], reference: f64) -> Spread {
        let size = self.volume.len();
        let mut spread = Spread {
            x: vec![AWAY; size],
            y: vec![AWAY; size],
            half: vec![0.5; size],
        };
        let (densities, placements) = values.split_at(self.place.len());
        for (p, &at) in self.place.iter().enumerate() {
            let at = at as usize;
            spread.x[at] = placements[2 * p];
            spread.y[at] = placements[2 * p + 1];
            spread.half[at] = densities[p] * (0.5 / reference);
        }
        spread
    }

    /// The state of the first `rows` points.
    pub fn states(&self, values: &[f64], rows: usize, weight: Weight) -> Vec<PointState> {
        let spread = self.spread(values, weight.reference);
        let blocks: Vec<[PointState; LANES]> = self
            .first
            .par_iter()
            .with_min_len(TASK)
            .map(|&at| self.block(at as usize, &spread, weight))
            .collect();
        let mut states = vec![PointState::default(); rows];
        for (lanes, block) in self.lanes.iter().zip(&blocks) {
            for (&p, state) in lanes.iter().zip(block) {
                if p != NONE {
                    states[p as usize] = *state;
                }
            }
        }
        states
    }

    fn block(&self, at: usize, spread: &Spread, weight: Weight) -> [PointState; LANES] {
        #[cfg(target_arch = "x86_64")]
        match isa() {
            // SAFETY: `isa` reports this only where the processor has AVX-512F, AVX2 and FMA, all that the function asks for.
            Isa::Avx512 => return unsafe { block_avx512(self, at, spread, weight) },
            // SAFETY: `isa` reports this only where the processor has AVX2 and FMA, all that the function asks for.
            Isa::Avx2 => return unsafe { block_avx2(self, at, spread, weight) },
            Isa::Portable => {}
        }
        block(self, at, spread, weight)
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx2,fma")]
fn block_avx512(g: &Padded, at: usize, s: &Spread, weight: Weight) -> [PointState; LANES] {
    block(g, at, s, weight)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn block_avx2(g: &Padded, at: usize, s: &Spread, weight: Weight) -> [PointState; LANES] {
    block(g, at, s, weight)
}

#[inline(always)]
fn lane(values: &[f64], at: usize) -> Lane {
    values[at..at + LANES].try_into().expect("LANES of them")
}

#[inline(always)]
fn block(g: &Padded, at: usize, s: &Spread, weight: Weight) -> [PointState; LANES] {
    // The usual exponent without the cost of a general power.
    match weight.exponent == 2.0 {
        true => sum(g, at, s, weight, |mean| (mean * mean, mean)),
        false => sum(g, at, s, weight, |mean| {
            let below = mean.powf(weight.exponent - 1.0);
            (below * mean, below)
        }),
    }
}

/// `power` gives `mean^n` and `mean^(n−1)`.
#[inline(always)]
fn sum(
    g: &Padded,
    at: usize,
    s: &Spread,
    weight: Weight,
    power: impl Fn(f64) -> (f64, f64),
) -> [PointState; LANES] {
    let (x, y, half) = (lane(&s.x, at), lane(&s.y, at), lane(&s.half, at));
    let (mut energy, mut slope) = ([0.0; LANES], [0.0; LANES]);
    let (mut fx, mut fy) = ([0.0; LANES], [0.0; LANES]);
    for bond in &g.bonds {
        let there = at.wrapping_add_signed(bond.by);
        let (xi, yi) = (lane(&s.x, there), lane(&s.y, there));
        let (hi, volume) = (lane(&s.half, there), lane(&g.volume, there));
        for l in 0..LANES {
            let (dx, dy) = (xi[l] - x[l], yi[l] - y[l]);
            let length = (dx * dx + dy * dy).sqrt();
            let change = length - bond.length;
            let (w, below) = power(half[l] + hi[l]);
            let stretch = volume[l] * bond.stiffness * change;
            let pull = w * stretch / length;
            energy[l] += w * stretch * change;
            slope[l] += below * stretch * change;
            fx[l] += pull * dx;
            fy[l] += pull * dy;
        }
    }
    // Ψ = ½ Σ w (C L/2)(l/L − 1)² V, and ∂w/∂ρ_a = n mean^(n−1) / (2 ρ*).
    let by = 0.25 * 0.5 * weight.exponent / weight.reference;
    std::array::from_fn(|l| PointState {
        energy: 0.25 * energy[l],
        force: [fx[l], fy[l]],
        by_density: by * slope[l],
    })
}
