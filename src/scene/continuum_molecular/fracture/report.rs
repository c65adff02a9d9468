//! Owns what fracture reports: damage, loads, energies and their balance, the crack's measures.

use super::{CrackGrowth, Ledger};
use crate::error::Result;
use crate::physics::continuum_molecular::body::Body;
use crate::physics::continuum_molecular::piezoresistance::Piezoresistance;
use crate::scene::continuum_molecular::Problem;
use crate::scene::continuum_molecular::conduction::potential;
use crate::scene::continuum_molecular::path::drop;
use crate::scene::continuum_molecular::steady::coupled::strained;
use crate::scene::continuum_molecular::steady::{displacement, scalar, summary};
use crate::scene::frame::{Frame, Observer, Summary};

impl<const D: usize> CrackGrowth<'_, D> {
    /// d = 1 - Σ over intact bonds/Σ over all (eq. 105).
    pub fn damage(&self) -> Vec<f64> {
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

    pub fn unbreakable_points(&self) -> usize {
        self.unbreakable.iter().filter(|s| **s).count()
    }

    pub fn numbers(&mut self) -> Vec<(String, f64)> {
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
            ("broken_bonds", self.crack.broken as f64),
            ("crack_length", self.crack.length),
        ];
        names.into_iter().map(|(n, v)| (n.to_owned(), v)).collect()
    }

    /// Reports the state. At `accepted` loads with the potential, at the `last` one with all fields.
    pub fn record(
        &mut self,
        observer: &mut dyn Observer,
        accepted: bool,
        last: bool,
    ) -> Result<()> {
        let mut numbers = self.numbers();
        let mut fields = Vec::new();
        let due = accepted && (last || self.scene.output.due(self.recorded, self.lambda));
        let probes = self.model.problem.probes();
        if accepted && self.piezoresistance().is_some() {
            self.update_whole_body();
        }
        if let Some(conductor) = self.conductor.as_ref().filter(|_| accepted) {
            let strained = self.strained(conductor)?;
            let conductor = strained.as_ref().unwrap_or(conductor);
            let (values, unknowns) = potential(
                self.scene,
                self.model,
                self.setup,
                conductor,
                &self.broken,
                self.lambda,
            )?;
            self.potential_unknowns = unknowns;
            if let Some(probes) = probes {
                let before = self.potential_drop;
                self.potential_drop = drop(self.setup, probes, &values);
                if self.potential_drop.is_nan() && !before.is_nan() {
                    observer.warn(&format!(
                        "at a load of {:.6} the crack leaves the current no path: potential_drop is no number from there on",
                        self.lambda
                    ));
                }
            }
            if due {
                fields.push(scalar("potential", values));
            }
        }
        if probes.is_some() {
            numbers.push(("potential_drop".into(), self.potential_drop));
        }
        if due {
            self.update_whole_body();
            fields.insert(0, scalar("damage", self.damage()));
            fields.push(displacement(&self.x, self.lambda));
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

    fn piezoresistance(&self) -> Option<Piezoresistance> {
        match &self.model.problem {
            Problem::Fracture { conduction, .. } => conduction.as_ref()?.piezoresistance(),
            _ => None,
        }
    }

    /// The conductor as the load strains it, where its bonds are piezoresistive.
    fn strained(&self, conductor: &Body<1>) -> Result<Option<Body<1>>> {
        let Some(law) = self.piezoresistance() else {
            return Ok(None);
        };
        let (x, scale, broken) = (&self.x, self.lambda, &self.broken);
        strained(law, self.setup, &self.solid, x, scale, conductor, broken).map(Some)
    }

    pub fn summary(&self, steps: usize) -> Summary {
        let numbers = [
            ("peak_load", self.peak),
            ("last_load_parameter", self.lambda),
            ("broken_bonds", self.crack.broken as f64),
            ("crack_length", self.crack.length),
            ("crack_end_x", self.crack.end[0]),
            ("crack_end_y", self.crack.end[1]),
            ("mean_direction_deg", self.crack.mean_direction_deg()),
            ("end_direction_deg", self.crack.end_direction_deg()),
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
            ("sound_points", self.unbreakable_points() as f64),
            ("solves", self.solves as f64),
            ("solve_iterations", self.iterations as f64),
            ("windows", self.windows as f64),
        ];
        let coupled = self
            .conductor
            .is_some()
            .then_some(self.potential_unknowns as f64);
        let numbers = numbers
            .into_iter()
            .chain(coupled.map(|n| ("potential_unknowns", n)))
            .map(|(n, v)| (n.to_owned(), v))
            .collect();
        let bodies = [
            Some(self.solid.body.bond_values()),
            self.conductor.as_ref().map(Body::bond_values),
        ];
        let stored = self.broken.len() + bodies.into_iter().flatten().sum::<usize>();
        let mut summary = summary(self.setup, self.window.unknowns(), stored, steps, numbers);
        summary.converged = self.unsettled == 0;
        if self.crack.stopped {
            summary.stopped = Some("the crack reached the stop region".into());
        }
        summary
    }
}
