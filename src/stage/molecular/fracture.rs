//! Owns quasi-static fracture under a load that grows in proportion: bonds break at the very load at which they reach
//! their critical energy, the most overstressed first, and never heal.
//!
//! Between breaks the body is linear, so the load of the next break is known without trial steps: a step is cut there
//! instead of being halved until it is near. Work, elastic energy, the energy of broken bonds and the energy given up
//! while the body moves to its new equilibrium at constant load are counted separately and must balance.

use super::setup::{DISPLACEMENT, Setup, Solid};
use super::steady::{displacement, drop, potential, scalar, summary};
use super::window::{Window, WindowBond, opposite};
use super::{Fracture, Molecular};
use crate::error::{Error, Result};
use crate::physics::anisotropic::body::{Body, RESIDUAL};
use crate::physics::anisotropic::toughness::critical_energy;
use crate::stage::scene::Scene;
use crate::stage::scene::frame::{Frame, Observer, Summary};
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

struct Front<'a, const D: usize> {
    scene: &'a Scene,
    model: &'a Molecular,
    params: &'a Fracture,
    setup: &'a Setup,
    solid: Solid<D>,
    /// Critical energy of each bond of the stencil.
    critical: Vec<f64>,
    /// Points at which bonds never break.
    sound: Vec<bool>,
    stop: Vec<bool>,
    /// One flag per listed bond.
    broken: Vec<bool>,
    conductor: Option<Body<1>>,
    window: Window<D>,
    bonds: Vec<WindowBond>,
    /// Under unit load, as of the last whole solution.
    x: Vec<[f64; D]>,
    /// Largest energy ratio outside the window then, under unit load, and whether bonds have broken since.
    far: f64,
    stale: bool,
    lambda: f64,
    recorded: f64,
    ledger: Ledger,
    count: usize,
    length: f64,
    /// Sum of the centres of broken nearest-neighbour bonds, from the tip.
    lean: [f64; 2],
    end_point: [f64; 2],
    peak: f64,
    worst_balance: f64,
    solves: usize,
    iterations: usize,
    windows: usize,
    stopped: bool,
    /// As of the last accepted load.
    potential_drop: f64,
}

/// Dense points of a window about each seed reach this many spacings.
const REACH: f64 = 13.0;
/// Events at constant load between looks at the whole body.
const LOOK: usize = 25;

/// Runs a scene with fracture to the end of its load, or until a stop region is reached.
pub fn run<const D: usize>(
    scene: &Scene,
    model: &Molecular,
    params: &Fracture,
    mut solid: Solid<D>,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    let time = scene.time.as_ref().ok_or_else(|| {
        Error::setting(
            "time",
            "fracture needs a load that grows, found no time",
            "add [time] with end and step; hold values must be proportional to time",
        )
    })?;
    time.check()?;
    if model
        .elasticity
        .as_ref()
        .is_some_and(|e| e.thermal.is_some())
        || !(0.0..1.0).contains(&params.batch)
    {
        return Err(Error::setting(
            "fracture",
            "thermal strain with fracture, or a batch outside 0 to 1",
            "take one of them out; batch is a share",
        ));
    }
    solid.held = unit_load(scene, model, setup, &solid, time.end)?;
    observer.start(&setup.points, (time.end / time.step).round() as usize)?;
    let mut front = Front::new(scene, model, params, solid, setup)?;
    let steps = (time.end / time.step).round().max(1.0) as usize;
    front.record(observer, true, false)?;
    for step in 1..=steps {
        front.load_to(time.step * step as f64, observer)?;
        front.record(observer, true, step == steps || front.stopped)?;
        if front.stopped {
            break;
        }
    }
    Ok(front.summary(steps))
}

/// What is held at load one. Refuses holds that do not grow in proportion to time.
fn unit_load<const D: usize>(
    scene: &Scene,
    model: &Molecular,
    setup: &Setup,
    solid: &Solid<D>,
    end: f64,
) -> Result<Vec<Option<f64>>> {
    let mut without = model.clone();
    without.known.clear();
    let names: [&[&str]; D] = std::array::from_fn(|d| DISPLACEMENT[d]);
    let full = setup.held(scene, &without, names, end, None)?;
    let half = setup.held(scene, &without, names, 0.5 * end, None)?;
    let proportional = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (b - 0.5 * a).abs() <= 1e-9 * a.abs(),
        _ => true,
    };
    if !full.iter().zip(&half).all(proportional)
        || !scene.load.iter().all(|l| is_electric(&l.component))
    {
        return Err(Error::setting(
            "hold.value",
            "fracture follows displacements that grow in proportion to time, found another load",
            "use value = { times = [0, end], values = [0, largest] }, or 0",
        ));
    }
    let known = |v: usize| full[v].map(|f| f / end).or(solid.held[v]);
    Ok((0..full.len()).map(known).collect())
}

fn is_electric(component: &str) -> bool {
    component == "potential" || component == "temperature"
}

impl<'a, const D: usize> Front<'a, D> {
    fn new(
        scene: &'a Scene,
        model: &'a Molecular,
        params: &'a Fracture,
        solid: Solid<D>,
        setup: &'a Setup,
    ) -> Result<Self> {
        let angle = model
            .elasticity
            .as_ref()
            .map_or(0.0, |e| e.angle_deg)
            .to_radians();
        let law = critical_energy(
            params.energy[0],
            params.energy[1],
            setup.horizon(),
            params.exponent,
            params.frequency,
            angle,
        )?;
        let n = setup.points.len();
        let mut sound: Vec<bool> = (0..n)
            .map(|p| (0..D).any(|d| solid.held[p * D + d].is_some()))
            .collect();
        for region in &params.unbreakable {
            let chosen = region.select(&setup.points, n, "fracture.unbreakable")?;
            chosen.into_iter().for_each(|p| sound[p] = true);
        }
        let mut stop = vec![false; n];
        if let Some(region) = &params.stop {
            let chosen = region.select(&setup.points, n, "fracture.stop")?;
            chosen.into_iter().for_each(|p| stop[p] = true);
        }
        let conductor = match &model.conduction {
            Some(conduction) => Some(setup.conductor(model, conduction)?.0),
            None => None,
        };
        let (window, x) = Window::new(&solid.body, setup, &solid.held, &[])?;
        let mut front = Front {
            critical: setup.bonds.iter().map(|b| law.at(b.psi())).collect(),
            broken: vec![false; setup.family.len()],
            scene,
            model,
            params,
            setup,
            solid,
            sound,
            stop,
            conductor,
            window,
            bonds: Vec::new(),
            x,
            far: 0.0,
            stale: false,
            lambda: 0.0,
            recorded: 0.0,
            ledger: Ledger::default(),
            count: 0,
            length: 0.0,
            lean: [0.0; 2],
            end_point: params.tip,
            peak: 0.0,
            worst_balance: 0.0,
            solves: 0,
            iterations: 0,
            windows: 0,
            stopped: false,
            potential_drop: 0.0,
        };
        front.move_window()?;
        Ok(front)
    }

    /// Energy over critical energy of a bond under unit load; 0 where it cannot break.
    fn ratio(&self, kind: usize, here: &[f64; D], there: &[f64; D]) -> f64 {
        let b = &self.setup.bonds[kind];
        let d = b.deformation(here, there);
        if self.params.extension_only && d.stretch < 0.0 {
            return 0.0;
        }
        b.energy(&self.solid.moduli[kind], &d) / self.critical[kind]
    }

    /// Ratios of the bonds of point `p` to later points, from the whole solution.
    fn ratios(&self, p: usize) -> impl Iterator<Item = (usize, f64)> {
        self.setup.family.range(p).filter_map(move |slot| {
            let (q, kind) = self.setup.family.kind(slot);
            let may = q > p && !self.broken[slot] && !self.sound[p] && !self.sound[q];
            may.then(|| (q, self.ratio(kind, &self.x[p], &self.x[q])))
        })
    }

    /// Renews the whole solution and what is known of the bonds outside the window.
    fn look(&mut self) {
        self.x = self.window.whole(&self.solid.body.blocks, &self.solid.held);
        self.stale = false;
        let outside = |p: usize| {
            let bonds = self.ratios(p);
            bonds
                .filter(|(q, _)| !self.window.holds(p) || !self.window.holds(*q))
                .fold(0.0_f64, |m, (_, r)| m.max(r))
        };
        self.far = (0..self.setup.points.len())
            .into_par_iter()
            .map(outside)
            .reduce(|| 0.0, f64::max);
    }

    /// Puts a new window about the bonds nearest to breaking, and factorises the body as it is.
    fn move_window(&mut self) -> Result<()> {
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
        let chosen = self.around(&seeds);
        let (window, x) = Window::new(&self.solid.body, self.setup, &self.solid.held, &chosen)?;
        self.window = window;
        self.x = x;
        let may = |slot: usize, p: usize, q: usize| {
            !self.broken[slot] && !self.sound[p] && !self.sound[q]
        };
        let mut bonds = self.window.bonds(self.setup, |slot| !self.broken[slot]);
        bonds.retain(|b| may(b.slots[0], self.window.point(b.a), self.window.point(b.b)));
        self.bonds = bonds;
        self.windows += 1;
        self.look();
        Ok(())
    }

    /// Free points within reach of the seeds, the first seeds first, up to the window's size.
    fn around(&self, seeds: &[usize]) -> Vec<usize> {
        let setup = self.setup;
        let mut taken = vec![false; setup.points.len()];
        let mut chosen = Vec::new();
        let reach = REACH.ceil() as i32;
        for &seed in seeds {
            if chosen.len() >= self.params.window_points {
                break;
            }
            let [i, j] = setup.points.cell(seed);
            for dj in -reach..=reach {
                for di in -reach..=reach {
                    let near = f64::from(di * di + dj * dj) <= REACH * REACH;
                    let Some(p) = setup.points.at([i + di, j + dj]).filter(|_| near) else {
                        continue;
                    };
                    if !taken[p] && (0..D).all(|d| self.solid.held[p * D + d].is_none()) {
                        taken[p] = true;
                        chosen.push(p);
                    }
                }
            }
        }
        chosen
    }

    /// Raises the load to `target`, breaking bonds on the way.
    fn load_to(&mut self, target: f64, observer: &mut dyn Observer) -> Result<()> {
        let mut events = 0;
        while !self.stopped {
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
            // Far from the front ratios change slowly: while the front is well ahead, looking now and then will do.
            let reaches = near.max(self.far) * target * target >= 1.0;
            let close = 2.0 * self.far > near || !reaches;
            if self.stale && (events >= LOOK || (!running && close)) {
                self.look();
                events = 0;
            }
            let largest = near.max(self.far);
            if target * target * largest < 1.0 && !running {
                self.advance(target);
                return Ok(());
            }
            if self.far > near && self.far * target * target >= 1.0 {
                self.look_and_move()?;
                continue;
            }
            if !running {
                self.advance(near.sqrt().recip().max(self.lambda));
                self.record(observer, false, false)?;
            }
            events += 1;
            let limit = (1.0 - 1e-9) / (self.lambda * self.lambda);
            let limit = limit.max((1.0 - self.params.batch) * near);
            self.break_bonds(&ratios, limit)?;
        }
        Ok(())
    }

    fn look_and_move(&mut self) -> Result<()> {
        self.look();
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
            let (p, q) = (self.window.point(bond.a), self.window.point(bond.b));
            let factor = self.solid.body.factor(bond.slots[0]);
            let b = &self.setup.bonds[bond.kinds[0] as usize];
            let w = ratios[k] * self.critical[bond.kinds[0] as usize];
            self.ledger.broken +=
                square * factor * w * b.volume_mm2 * self.setup.cell * (1.0 - RESIDUAL);
            lost.push((bond, factor * (1.0 - RESIDUAL)));
            leaves |= !self.window.is_inner(&bond);
            self.mark(bond.slots, p, q);
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
        if leaves {
            self.look_and_move()?;
        }
        Ok(())
    }

    /// Marks a bond as broken in the bodies and in the crack's measures.
    fn mark(&mut self, slots: [usize; 2], p: usize, q: usize) {
        debug_assert_eq!(opposite(self.setup, p, q).0, slots[1]);
        slots.iter().for_each(|&s| self.broken[s] = true);
        self.solid.body.scale(slots, RESIDUAL);
        if let Some(conductor) = &mut self.conductor {
            conductor.scale(slots, RESIDUAL);
        }
        self.count += 1;
        self.stopped |= self.stop[p] || self.stop[q];
        let (a, b) = (self.setup.points.position(p), self.setup.points.position(q));
        let centre = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let from = [
            centre[0] - self.params.tip[0],
            centre[1] - self.params.tip[1],
        ];
        // Longer bonds break ahead of the crack's faces.
        if (a[0] - b[0]).hypot(a[1] - b[1]) < 1.1 * self.setup.points.spacing {
            self.lean = [self.lean[0] + from[0], self.lean[1] + from[1]];
            if from[0].hypot(from[1]) > self.length {
                self.length = from[0].hypot(from[1]);
                self.end_point = centre;
            }
        }
    }

    /// d = 1 - Σ over intact bonds/Σ over all (eq. 105).
    fn damage(&self) -> Vec<f64> {
        let at = |p: usize| {
            let (mut all, mut gone) = (0.0, 0.0);
            for slot in self.setup.family.range(p) {
                let share = self.setup.family.entry(slot).1.share;
                all += share;
                gone += if self.broken[slot] { share } else { 0.0 };
            }
            if all > 0.0 { gone / all } else { 0.0 }
        };
        (0..self.setup.points.len()).map(at).collect()
    }

    fn numbers(&mut self) -> Vec<(String, f64)> {
        let h = self.model.thickness;
        let stiffness = self.window.twice_energy(&self.solid.body.blocks);
        let elastic = 0.5 * stiffness * self.lambda * self.lambda;
        let Ledger {
            work,
            broken,
            relaxed,
        } = self.ledger;
        let balance = if work > 0.0 {
            (work - elastic - broken - relaxed) / work
        } else {
            0.0
        };
        self.worst_balance = self.worst_balance.max(balance.abs());
        let names = [
            ("load", h * stiffness * self.lambda),
            ("work", h * work),
            ("elastic_energy", h * elastic),
            ("broken_bond_energy", h * broken),
            ("relaxation_energy", h * relaxed),
            ("balance_error", balance),
            ("broken_bonds", self.count as f64),
            ("crack_length", self.length),
        ];
        names.into_iter().map(|(n, v)| (n.to_owned(), v)).collect()
    }

    /// Reports the state. At `accepted` loads with the potential, at the `last` one with all fields.
    fn record(&mut self, observer: &mut dyn Observer, accepted: bool, last: bool) -> Result<()> {
        let mut numbers = self.numbers();
        let mut fields = Vec::new();
        let due = accepted && (last || self.scene.output.due(self.recorded, self.lambda));
        let conducting = self.conductor.as_ref().zip(self.model.conduction.as_ref());
        if let Some((conductor, conduction)) = conducting.filter(|_| accepted) {
            let values = potential(self.scene, self.model, self.setup, conductor)?;
            if let Some(probes) = conduction.probes {
                self.potential_drop = drop(self.setup, probes, &values);
            }
            if due {
                fields.push(scalar("potential", values));
            }
        }
        if self.conductor.is_some() {
            numbers.push(("potential_drop".into(), self.potential_drop));
        }
        if due {
            self.look();
            fields.insert(0, scalar("damage", self.damage()));
            fields.push(displacement(&self.x, self.lambda));
            fields.push(scalar(
                "displacement_y",
                self.x.iter().map(|u| self.lambda * u[1]).collect(),
            ));
        }
        if accepted {
            self.recorded = self.lambda;
        }
        observer.frame(&Frame {
            time: self.lambda,
            numbers,
            fields,
        })
    }

    fn summary(&self, steps: usize) -> Summary {
        let [x, y] = self.lean;
        let end = [
            self.end_point[0] - self.params.tip[0],
            self.end_point[1] - self.params.tip[1],
        ];
        let numbers = [
            ("peak_load", self.peak),
            ("last_load_parameter", self.lambda),
            ("broken_bonds", self.count as f64),
            ("crack_length", self.length),
            ("crack_end_x", self.end_point[0]),
            ("crack_end_y", self.end_point[1]),
            ("mean_direction_deg", y.atan2(x).to_degrees()),
            ("end_direction_deg", end[1].atan2(end[0]).to_degrees()),
            (
                "broken_bond_energy",
                self.model.thickness * self.ledger.broken,
            ),
            (
                "relaxation_energy",
                self.model.thickness * self.ledger.relaxed,
            ),
            ("work", self.model.thickness * self.ledger.work),
            ("worst_balance_error", self.worst_balance),
            ("solves", self.solves as f64),
            ("solve_iterations", self.iterations as f64),
            ("windows", self.windows as f64),
        ];
        let numbers = numbers
            .into_iter()
            .map(|(n, v)| (n.to_owned(), v))
            .collect();
        let mut summary = summary(self.setup, self.window.unknowns(), steps, numbers);
        if self.stopped {
            summary.stopped = Some("the crack reached the stop region".into());
        }
        summary
    }
}
