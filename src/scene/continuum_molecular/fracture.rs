//! Owns quasi-static fracture under a load that grows in proportion: bonds break at the very load at which they reach
//! their critical energy, the most overstressed first, and never heal.
//!
//! Between breaks the body is linear, so the load of the next break is known without trial steps: a step is cut there
//! instead of being halved until it is near. Work, elastic energy, the energy of broken bonds and the energy given up
//! while the body moves to its new equilibrium at constant load are counted separately and must balance.

mod report;
mod saved_state;
pub mod start;
mod watch;

use super::crack::Crack;
use super::setup::{Conductor, Setup};
use super::solid::Solid;
use super::window::{Window, WindowBond, opposite};
use super::{Fracture, Molecular};
use crate::error::Result;
use crate::physics::continuum_molecular::body::{Body, RESIDUAL};
use crate::scene::frame::{Observer, Summary};
use crate::scene::setting::Setting;
use rayon::prelude::*;

/// Running sums, per unit thickness.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Ledger {
    work: f64,
    /// Energy in bonds when they broke.
    broken: f64,
    /// Energy given up on the way to the next equilibrium.
    relaxed: f64,
}

struct CrackGrowth<'a, const D: usize> {
    scene: &'a Setting,
    model: &'a Molecular,
    params: &'a Fracture,
    setup: &'a Setup,
    solid: Solid<D>,
    /// Critical energy of each bond of the stencil.
    critical: Vec<f64>,
    /// Points at which bonds never break.
    unbreakable: Vec<bool>,
    crack: Crack,
    /// One flag per listed bond.
    broken: Vec<bool>,
    /// Broken bonds in their order: a point and the bond's place in the list. Those from `before_window` on broke in
    /// this window.
    order: Vec<(usize, usize)>,
    before_window: usize,
    conductor: Option<Body<1>>,
    window: Window<D>,
    bonds: Vec<WindowBond>,
    /// Under unit load, as of the last update of the whole body: renewed before every use.
    x: Vec<[f64; D]>,
    /// Largest energy ratio outside the window then, under unit load, and whether bonds have broken since.
    max_ratio_outside: f64,
    stale: bool,
    /// The load step under way, and the events in it since the last update of the whole body.
    step: usize,
    events: usize,
    lambda: f64,
    recorded: f64,
    ledger: Ledger,
    peak: f64,
    worst_balance: f64,
    solves: usize,
    iterations: usize,
    windows: usize,
    /// Solves of a window that did not reach equilibrium; a new one was put after each.
    unsettled: usize,
    /// As of the last accepted load.
    potential_drop: f64,
    potential_unknowns: usize,
}

/// Events at constant load between updates of the whole body. A choice: in between, bonds outside the window are judged by the solution
/// before; solutions of the whole body were 11 % of a run of the notched plate (docs/notes/continuum-molecular.md).
const EVENTS_BETWEEN_UPDATES: usize = 25;

/// Runs a scene with fracture to the end of its load, or until a stop region is reached.
pub fn run<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    params: &Fracture,
    mut solid: Solid<D>,
    conductor: Option<Conductor>,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let time = start::growing(scene)?;
    let steps = time.steps()? as usize;
    solid.held = start::unit_load(scene, setup, &solid, time.end)?;
    observer.start(&setup.points, steps)?;
    let mut growth = CrackGrowth::new(scene, model, params, solid, conductor, setup)?;
    observer.say(&format!(
        "bonds never break at {} of {} points, unbreakable or held in some component",
        growth.unbreakable_points(),
        setup.points.len()
    ));
    match observer.resume()? {
        Some(state) => {
            growth.restore(&state)?;
            observer.say(&format!("resumed at a load of {:.6}", growth.lambda));
        }
        None => growth.record(observer, true, false)?,
    }
    while growth.step <= steps && !growth.crack.stopped {
        growth.load_to(time.step * growth.step as f64, observer)?;
        let last = growth.step == steps || growth.crack.stopped;
        growth.record(observer, true, last)?;
        (growth.step, growth.events) = (growth.step + 1, 0);
    }
    if growth.unsettled > 0 {
        observer.say(&format!(
            "{} of {} solves about the crack front did not converge: take a smaller batch",
            growth.unsettled, growth.solves
        ));
    }
    Ok(growth.summary(steps))
}

impl<const D: usize> CrackGrowth<'_, D> {
    /// Raises the load to `target`, breaking bonds on the way.
    fn load_to(&mut self, target: f64, observer: &mut dyn Observer) -> Result<()> {
        while !self.crack.stopped {
            observer.keep(&|| self.state())?;
            let ratios: Vec<f64> = self
                .bonds
                .par_iter()
                .map(|b| {
                    self.ratio(
                        b.kinds[0] as usize,
                        &self.window.value(b.a),
                        &self.window.value(b.b),
                    )
                })
                .collect();
            let near = ratios.iter().fold(0.0_f64, |m, r| m.max(*r));
            // Rounding must not keep a bond that broke its limit at this very load.
            let running = self.lambda * self.lambda * near >= 1.0 - 1e-9;
            // Far from the front ratios change slowly: while the front is well ahead, an update now and then will do.
            let reaches = near.max(self.max_ratio_outside) * target * target >= 1.0;
            let close = 2.0 * self.max_ratio_outside > near || !reaches;
            if self.stale && (self.events >= EVENTS_BETWEEN_UPDATES || (!running && close)) {
                self.update_whole_body();
                self.events = 0;
            }
            let largest = near.max(self.max_ratio_outside);
            if target * target * largest < 1.0 && !running {
                self.advance(target);
                return Ok(());
            }
            if self.max_ratio_outside > near && self.max_ratio_outside * target * target >= 1.0 {
                self.look_and_move()?;
                continue;
            }
            if !running {
                self.advance(near.sqrt().recip().max(self.lambda));
                self.record(observer, false, false)?;
            }
            self.events += 1;
            let limit = (1.0 - 1e-9) / (self.lambda * self.lambda);
            let limit = limit.max((1.0 - self.params.batch) * near);
            self.break_bonds(&ratios, limit)?;
        }
        Ok(())
    }

    fn look_and_move(&mut self) -> Result<()> {
        self.update_whole_body();
        self.move_window()
    }

    /// Raises the load without breaking anything.
    fn advance(&mut self, to: f64) {
        let stiffness = self.window.twice_energy(&self.solid.body.blocks);
        self.ledger.work += 0.5 * stiffness * (to * to - self.lambda * self.lambda);
        self.lambda = to;
        self.peak = self.peak.max(to * stiffness * self.model.thickness);
    }

    /// Breaks the window's bonds whose ratio reaches `limit`.
    fn break_bonds(&mut self, ratios: &[f64], limit: f64) -> Result<()> {
        let mut lost = Vec::new();
        let mut leaves = false;
        let square = self.lambda * self.lambda;
        let chosen: Vec<usize> = (0..ratios.len()).filter(|&k| ratios[k] >= limit).collect();
        for &k in &chosen {
            let bond = self.bonds[k];
            let kind = bond.kinds[0] as usize;
            let w = ratios[k] * self.critical[kind];
            leaves |= !self.window.is_inner(&bond);
            let (bond, factor) = self.lose(self.window.point(bond.a), bond.slots[0]);
            let volume = self.setup.bonds[kind].volume_mm2 * self.setup.cell;
            self.ledger.broken += square * factor * w * volume;
            lost.push((bond, factor));
        }
        let mut keep = chosen.iter().peekable();
        let mut at = 0;
        self.bonds.retain(|_| {
            let drop = keep.peek() == Some(&&at);
            if drop {
                keep.next();
            }
            at += 1;
            !drop
        });
        let cut = self.window.cut(&self.solid.body.blocks, &lost);
        self.ledger.relaxed += square * cut.relaxed;
        self.iterations += cut.iterations;
        self.solves += 1;
        self.stale = true;
        if !cut.converged {
            self.unsettled += 1;
        }
        if leaves || !cut.converged {
            self.look_and_move()?;
        }
        Ok(())
    }

    /// Marks the bond listed at `slot` of point `p` as broken in the bodies and in the crack's measures; the factor it
    /// loses.
    fn mark(&mut self, p: usize, slot: usize) -> f64 {
        let (q, _) = self.setup.family.kind(slot);
        let slots = [slot, opposite(self.setup, p, q).0];
        let lost = self.solid.body.factor(slot) * (1.0 - RESIDUAL);
        slots.iter().for_each(|&s| self.broken[s] = true);
        self.solid.body.scale(slots, RESIDUAL);
        if let Some(conductor) = &mut self.conductor {
            conductor.scale(slots, RESIDUAL);
        }
        self.crack.grow(&self.setup.points, [p, q]);
        self.order.push((p, slot));
        lost
    }
}
