//! Owns the moving window about a crack front: the rest of the body is condensed onto its points, so that bonds broken
//! inside it cost a dense solve of the window alone.

mod lost;
mod saved_state;

pub use lost::{WindowBond, opposite};

use super::equilibrium::{Factorised, factorise, right_hand_side};
use super::setup::Setup;
use crate::error::Result;
use crate::physics::continuum_molecular::body::Body;
use crate::physics::continuum_molecular::bond::Blocks;
use crate::solver::direct::schur::SchurComplement;
use lost::{add_forces, entries};

const OUTSIDE: u32 = u32::MAX;

/// What breaking bonds changed, per unit of load squared and thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    pub iterations: usize,
    /// Energy the remaining body gave up while it moved to its new equilibrium.
    pub relaxed: f64,
    /// Whether that equilibrium was reached.
    pub converged: bool,
}

/// Equilibrium under unit load of a body some of whose bonds are broken after its factorisation.
pub struct Window<const D: usize> {
    factorised: Factorised,
    schur: SchurComplement,
    /// Points of the window, in order of elimination.
    points: Vec<u32>,
    local: Vec<u32>,
    /// Whether all neighbours of a window point that could be in the window are.
    inner: Vec<bool>,
    /// Right-hand side of the unknowns under unit load.
    load: Vec<f64>,
    /// Window values at factorisation, at the last absorption, and since then.
    first: Vec<f64>,
    base: Vec<f64>,
    since: Vec<f64>,
    /// Bonds broken (with their factor) since the factorisation; those from `fresh` on since the last absorption.
    broken: Vec<(WindowBond, f64)>,
    fresh: usize,
    /// How many bonds were broken at each absorption.
    absorbed: Vec<usize>,
    /// x·A x at factorisation.
    stored: f64,
}

/// Conjugate gradient iterations beyond which the dense factor is renewed. A choice, not tuned: so many take `64 n²` operations, with
/// `n` = 1500 unknowns an eighth of the `n³ / 3` of a factorisation, and each solve that follows takes them again.
const RENEW: usize = 32;
/// Error of a solve in the energy norm, relative to the norm of the whole solution: bond energies at a crack front are
/// about 1e-6 of the body's, so their error is about 1e-5 of themselves.
const TOLERANCE: f64 = 1e-8;

impl<const D: usize> Window<D> {
    /// Factorises `body` as it is and condenses it onto `chosen` points (none of whose values is held). Returns the
    /// solution under unit load as well.
    pub fn new(
        body: &Body<D>,
        setup: &Setup,
        held: &[Option<f64>],
        chosen: &[usize],
    ) -> Result<(Self, Vec<[f64; D]>)> {
        let mut factorised = factorise(body, &setup.points, held, &[], chosen)?;
        let load = right_hand_side(body, &factorised, held, &[]);
        let size = chosen.len() * D;
        let schur = SchurComplement::new(&factorised.llt.corner(size), size);
        let mut q = load.clone();
        factorised.llt.solve(&mut q);
        let x = factorised.expand(&q, held);
        let mut local = vec![OUTSIDE; setup.points.len()];
        chosen
            .iter()
            .enumerate()
            .for_each(|(k, &p)| local[p] = k as u32);
        // Next to held points a crack cannot leave the window: their bonds never break.
        let held_at = |q: usize| (0..D).any(|d| held[q * D + d].is_some());
        let inside = |q: usize| local[q] != OUTSIDE || held_at(q);
        let whole = |&p: &usize| setup.family.of(p).all(|(q, _)| inside(q));
        let first: Vec<f64> = chosen.iter().flat_map(|&p| x[p]).collect();
        let window = Window {
            schur,
            points: chosen.iter().map(|&p| p as u32).collect(),
            inner: chosen.iter().map(whole).collect(),
            local,
            load,
            base: first.clone(),
            since: vec![0.0; size],
            first,
            broken: Vec::new(),
            fresh: 0,
            absorbed: Vec::new(),
            stored: 2.0 * body.energy(&x),
            factorised,
        };
        Ok((window, x))
    }

    pub fn holds(&self, p: usize) -> bool {
        self.local[p] != OUTSIDE
    }

    pub fn unknowns(&self) -> usize {
        self.load.len()
    }

    /// Whether both ends of a bond have all of their family in the window that could be there.
    pub fn is_inner(&self, bond: &WindowBond) -> bool {
        self.inner[bond.a as usize] && self.inner[bond.b as usize]
    }

    /// Number of a window point in the body.
    pub fn point(&self, a: u32) -> usize {
        self.points[a as usize] as usize
    }

    /// Bonds of the window for which `keep(slot)` holds, each once.
    pub fn bonds(&self, setup: &Setup, keep: impl Fn(usize) -> bool) -> Vec<WindowBond> {
        let mut all = Vec::new();
        for &p in &self.points {
            for slot in setup.family.range(p as usize) {
                let (q, _) = setup.family.kind(slot);
                if q > p as usize && self.holds(q) && keep(slot) {
                    all.push(self.bond(setup, p as usize, slot));
                }
            }
        }
        all
    }

    /// The bond listed at `slot` of point `p`, both ends of which are in the window.
    pub fn bond(&self, setup: &Setup, p: usize, slot: usize) -> WindowBond {
        let (q, kind) = setup.family.kind(slot);
        let (back, opposite) = opposite(setup, p, q);
        WindowBond {
            a: self.local[p],
            b: self.local[q],
            kinds: [kind as u16, opposite as u16],
            slots: [slot, back],
        }
    }

    /// Values at a window point under unit load.
    pub fn value(&self, a: u32) -> [f64; D] {
        let at = a as usize * D;
        std::array::from_fn(|d| self.base[at + d] + self.since[at + d])
    }

    /// x·A x of the body as it is now, under unit load.
    pub fn twice_energy(&self, blocks: &[Blocks<D>]) -> f64 {
        let now: Vec<f64> = self
            .base
            .iter()
            .zip(&self.since)
            .map(|(b, s)| b + s)
            .collect();
        let mut force = vec![0.0; now.len()];
        add_forces(&self.broken, blocks, &now, &mut force);
        self.stored
            - self
                .first
                .iter()
                .zip(&force)
                .map(|(q, f)| q * f)
                .sum::<f64>()
    }

    /// Breaks bonds: `lost` is the factor each of them loses.
    pub fn cut(&mut self, blocks: &[Blocks<D>], lost: &[(WindowBond, f64)]) -> Cut {
        let before = self.since.clone();
        self.broken.extend_from_slice(lost);
        let fresh = &self.broken[self.fresh..];
        let mut b = vec![0.0; self.base.len()];
        add_forces(fresh, blocks, &self.base, &mut b);
        let change = |x: &[f64], y: &mut [f64]| add_forces(fresh, blocks, x, y);
        let scale = self.stored.sqrt();
        let info = self
            .schur
            .solve(change, &b, &mut self.since, scale, TOLERANCE);
        let moved: Vec<f64> = self.since.iter().zip(&before).map(|(n, b)| n - b).collect();
        let mut force = self.schur.multiply(&moved);
        let mut given = vec![0.0; moved.len()];
        add_forces(fresh, blocks, &moved, &mut given);
        force.iter_mut().zip(&given).for_each(|(f, g)| *f -= g);
        let relaxed = moved.iter().zip(&force).map(|(m, f)| 0.5 * m * f).sum();
        if info.iterations > RENEW && self.absorb(blocks, self.broken.len()) {
            self.base
                .iter_mut()
                .zip(&self.since)
                .for_each(|(b, s)| *b += s);
            self.since.fill(0.0);
        }
        Cut {
            iterations: info.iterations,
            relaxed,
            converged: info.converged,
        }
    }

    /// Renews the dense factor without the first `count` broken bonds. False if there is none.
    fn absorb(&mut self, blocks: &[Blocks<D>], count: usize) -> bool {
        let fresh = &self.broken[self.fresh..count];
        let done = self.schur.absorb(entries(fresh, blocks));
        if done {
            self.fresh = count;
            self.absorbed.push(count);
        }
        done
    }

    /// The solution under unit load everywhere.
    pub fn whole(&mut self, blocks: &[Blocks<D>], held: &[Option<f64>]) -> Vec<[f64; D]> {
        let now: Vec<f64> = self
            .base
            .iter()
            .zip(&self.since)
            .map(|(b, s)| b + s)
            .collect();
        let mut force = vec![0.0; now.len()];
        add_forces(&self.broken, blocks, &now, &mut force);
        let mut q = self.load.clone();
        let tail = self.factorised.order.len() - force.len();
        for (i, f) in force.into_iter().enumerate() {
            q[self.factorised.order[tail + i]] += f;
        }
        self.factorised.llt.solve(&mut q);
        self.factorised.expand(&q, held)
    }
}
