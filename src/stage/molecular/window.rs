//! Owns the moving window about a crack front: the rest of the body is condensed onto its points, so that bonds broken
//! inside it cost a dense solve of the window alone.

use super::equilibrium::{Factorised, factorise, right_hand_side};
use super::setup::Setup;
use crate::error::Result;
use crate::physics::anisotropic::body::Body;
use crate::physics::anisotropic::bond::Blocks;
use crate::solve::zone::Zone;

const OUTSIDE: u32 = u32::MAX;

/// A bond between points `a` and `b` of the window (window numbers), and its places in the family's list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowBond {
    pub a: u32,
    pub b: u32,
    /// Kinds in the stencil seen from `a` and from `b`.
    pub kinds: [u16; 2],
    pub slots: [usize; 2],
}

/// What breaking bonds came to, per unit of load squared and thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    pub iterations: usize,
    /// Energy the remaining body gave up while it moved to its new equilibrium.
    pub relaxed: f64,
}

/// Equilibrium under unit load of a body some of whose bonds are broken after its factorisation.
pub struct Window<const D: usize> {
    factorised: Factorised,
    zone: Zone,
    /// Points of the window, in order of elimination.
    points: Vec<u32>,
    local: Vec<u32>,
    /// Whether all neighbours of a window point are in the window.
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
    /// x·A x at factorisation.
    stored: f64,
}

/// Conjugate gradient iterations beyond which the dense factor is renewed.
const RENEW: usize = 32;
/// Error of a solve in the energy norm, relative to the norm of the whole solution: bond energies at a crack front are
/// about 1e-6 of the body's, so their error is about 1e-5 of themselves.
const TOLERANCE: f64 = 1e-8;

impl<const D: usize> Window<D> {
    /// Factorises `body` as it is and condenses it onto `chosen` points (none of whose values is held). Returns the
    /// solution under unit load, too.
    pub fn new(
        body: &Body<D>,
        setup: &Setup,
        held: &[Option<f64>],
        chosen: &[usize],
    ) -> Result<(Self, Vec<[f64; D]>)> {
        let mut factorised = factorise(body, &setup.points, held, &[], chosen)?;
        let load = right_hand_side(body, &factorised, held, &[]);
        let size = chosen.len() * D;
        let zone = Zone::new(&factorised.llt.corner(size), size);
        let mut q = load.clone();
        factorised.llt.solve(&mut q);
        let x = factorised.expand(&q, held);
        let mut local = vec![OUTSIDE; setup.points.len()];
        chosen
            .iter()
            .enumerate()
            .for_each(|(k, &p)| local[p] = k as u32);
        let whole = |&p: &usize| setup.family.of(p).all(|(q, _)| local[q] != OUTSIDE);
        let first: Vec<f64> = chosen.iter().flat_map(|&p| x[p]).collect();
        let window = Window {
            zone,
            points: chosen.iter().map(|&p| p as u32).collect(),
            inner: chosen.iter().map(whole).collect(),
            local,
            load,
            base: first.clone(),
            since: vec![0.0; size],
            first,
            broken: Vec::new(),
            fresh: 0,
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

    /// Whether both ends of a bond have their whole family in the window.
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
        for (a, &p) in self.points.iter().enumerate() {
            for slot in setup.family.range(p as usize) {
                let (q, kind) = setup.family.kind(slot);
                if q > p as usize && self.holds(q) && keep(slot) {
                    let (back, opposite) = opposite(setup, p as usize, q);
                    all.push(WindowBond {
                        a: a as u32,
                        b: self.local[q],
                        kinds: [kind as u16, opposite as u16],
                        slots: [slot, back],
                    });
                }
            }
        }
        all
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
            .zone
            .solve(change, &b, &mut self.since, scale, TOLERANCE);
        let moved: Vec<f64> = self.since.iter().zip(&before).map(|(n, b)| n - b).collect();
        let mut force = self.zone.multiply(&moved);
        let mut given = vec![0.0; moved.len()];
        add_forces(fresh, blocks, &moved, &mut given);
        force.iter_mut().zip(&given).for_each(|(f, g)| *f -= g);
        let relaxed = moved.iter().zip(&force).map(|(m, f)| 0.5 * m * f).sum();
        if info.iterations > RENEW && self.zone.absorb(entries(fresh, blocks)) {
            self.fresh = self.broken.len();
            self.base
                .iter_mut()
                .zip(&self.since)
                .for_each(|(b, s)| *b += s);
            self.since.fill(0.0);
        }
        Cut {
            iterations: info.iterations,
            relaxed,
        }
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

/// Slot and kind of the bond from `q` back to `p`.
pub fn opposite(setup: &Setup, p: usize, q: usize) -> (usize, usize) {
    let back = setup.family.range(q).find(|&s| setup.family.kind(s).0 == p);
    let back = back.expect("bonds are listed at both ends");
    (back, setup.family.kind(back).1)
}

/// Adds the forces the broken bonds no longer carry.
fn add_forces<const D: usize>(
    bonds: &[(WindowBond, f64)],
    blocks: &[Blocks<D>],
    x: &[f64],
    y: &mut [f64],
) {
    let at = |p: u32| -> [f64; D] { std::array::from_fn(|d| x[p as usize * D + d]) };
    for (bond, lost) in bonds {
        let (a, b) = (at(bond.a), at(bond.b));
        let forces = [
            (bond.a, blocks[bond.kinds[0] as usize].apply(&a, &b)),
            (bond.b, blocks[bond.kinds[1] as usize].apply(&b, &a)),
        ];
        for (p, force) in forces {
            for (d, f) in force.into_iter().enumerate() {
                y[p as usize * D + d] += lost * f;
            }
        }
    }
}

/// The same as matrix entries.
fn entries<const D: usize>(
    bonds: &[(WindowBond, f64)],
    blocks: &[Blocks<D>],
) -> impl Iterator<Item = (usize, usize, f64)> {
    bonds.iter().flat_map(move |(bond, lost)| {
        let ends = [
            (bond.a, bond.b, bond.kinds[0]),
            (bond.b, bond.a, bond.kinds[1]),
        ];
        ends.into_iter().flat_map(move |(here, there, kind)| {
            let block = blocks[kind as usize];
            (0..D * D).flat_map(move |k| {
                let (i, j) = (k / D, k % D);
                let row = here as usize * D + i;
                [
                    (row, here as usize * D + j, lost * block.own[i][j]),
                    (row, there as usize * D + j, lost * block.cross[i][j]),
                ]
            })
        })
    })
}
