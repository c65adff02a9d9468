//! Owns what a solve yields, and its row of the results table.

use crate::measure::apparent::EndWork;
use crate::physics::plasticity::Plasticity;
use crate::pipeline::apparent::params::{Ends, Load, Method, SolveParams};
use crate::result::notes;
use crate::result::row::{Marks, Row, Solution};
use crate::result::settings::{Motion, Settings, Supports};
use crate::result::strength::{Strength, Yielding, long_steps_in_words, strength};
use crate::solver::cg::Ended;
use crate::volume::Specimen;

/// A number with the part of it that the solver left undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// The headline (see [`Solution::e_app_mpa`]).
    pub e_app_mpa: f64,
    /// From twice the strain energy.
    pub from_energy_mpa: f64,
    /// From the force at the ends.
    pub from_reaction_mpa: f64,
    /// Over all sites; for firm over the fully coordinated ones.
    pub from_stress_mpa: f64,
    /// Estimated algebraic error of the headline.
    pub algebraic_error_mpa: f64,
}

impl Moduli {
    /// Not a number: ends that slide, tilt or turn have no apparent modulus.
    pub const NONE: Moduli = Moduli {
        e_app_mpa: f64::NAN,
        from_energy_mpa: f64::NAN,
        from_reaction_mpa: f64::NAN,
        from_stress_mpa: f64::NAN,
        algebraic_error_mpa: f64::NAN,
    };
}

/// A solved model.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Lattice sites or elements that carry load.
    pub sites: usize,
    /// Volume of the model that carries load over TV.
    pub model_bv_tv: Option<f64>,
    /// Those that exist but carry none.
    pub dropped: usize,
    /// Degrees of freedom.
    pub unknowns: usize,
    /// Iterations of the solver.
    pub iterations: usize,
    /// Relative residual at the end.
    pub residual: f64,
    /// How the solver ended.
    pub ended: Ended,
    /// [`Moduli::NONE`] under shear, bending and torsion.
    pub moduli: Moduli,
    /// Of the moved end.
    pub work: EndWork,
    /// Only where the settings ask for a count.
    pub mechanisms: Option<usize>,
    /// True where the modulus is 0 although the bone connects the loaded faces: the model does not, or counts none of its sites.
    pub no_answer: bool,
    /// Of tissue that yields.
    pub yielding: Option<Yielding>,
}

impl Solved {
    /// The result of a model that does not connect the faces; `no_answer` where the bone does.
    pub fn disconnected(dropped: usize, no_answer: bool) -> Self {
        let zero = Moduli {
            e_app_mpa: 0.0,
            from_energy_mpa: 0.0,
            from_reaction_mpa: 0.0,
            from_stress_mpa: 0.0,
            algebraic_error_mpa: 0.0,
        };
        Solved {
            sites: 0,
            model_bv_tv: None,
            dropped,
            unknowns: 0,
            iterations: 0,
            residual: 0.0,
            ended: Ended::ResidualTolerance,
            moduli: zero,
            work: EndWork {
                force_n: Some(0.0),
                stiffness_n_per_mm: Some(0.0),
                moment_nmm: Some(0.0),
                relative_error: 0.0,
            },
            mechanisms: None,
            no_answer,
            yielding: None,
        }
    }

    /// Whether the model connects the loaded faces.
    pub fn connected(&self) -> bool {
        self.sites > 0
    }
}

impl SolveParams {
    /// A row's settings. Method, structure and resolution are the caller's to fill in.
    pub fn key(&self, specimen: &Specimen) -> Settings {
        Settings {
            scan: specimen.name.clone(),
            voxel_mm: specimen.bone.grid.spacing_mm,
            young_mpa: self.young_mpa,
            poisson: self.poisson,
            load: self.load,
            supports: match self.load.motion() {
                None => Supports::Faces(self.conditions),
                Some(Motion::Along) => Supports::Ends(self.ends),
                Some(Motion::ByLabel) => Supports::Labels,
                Some(_) => Supports::Ends(Ends::Bonded),
            },
            axis: self.axis,
            strain: match self.load.is_by_angle() || self.load == Load::Labels {
                true => 0.0,
                false => self.strain,
            },
            angle_deg: self.load.is_by_angle().then_some(self.angle_deg),
            grip_mm: self.grip_mm,
            tv_definition: specimen.tv_definition.clone(),
            tv_mm3: specimen.tv_mm3,
            bv_tv: specimen.bv_tv(),
            tolerance: Some(self.tolerance),
            plasticity: self.plasticity.as_ref().map(Plasticity::words),
            steps: self.plasticity.as_ref().map(|_| self.steps),
            held_by: self.supports_in_words(),
            sed: (self.method != Method::Lattice && self.load != Load::Stiffness)
                .then_some(self.sed),
            ..Settings::default()
        }
    }
}

impl Solved {
    /// Completes the row of a solve with its numbers. The clock and the memory are the caller's to fill in.
    pub fn row(&self, blank: Row) -> Row {
        let m = &self.moduli;
        let count = |n: usize| Some(n as u64);
        let by_angle = blank.key.load.is_by_angle();
        // A model that is not connected has a force and a moment of 0 each.
        let of_force = |v: Option<f64>| v.filter(|v| !by_angle && v.is_finite());
        let modulus = |v: f64| Some(v).filter(|v| blank.key.load.has_modulus() && !v.is_nan());
        let solution = Solution {
            sites: count(self.sites),
            model_bv_tv: self.model_bv_tv,
            dropped_sites: count(self.dropped),
            unknowns: count(self.unknowns),
            iterations: count(self.iterations),
            residual: Some(self.residual),
            converged: Some(self.ended.converged() && !self.is_stopped()),
            // Of no sites the stress is a sum of nothing, which is -0.
            e_app_mpa: modulus(m.e_app_mpa + 0.0),
            e_app_reaction_mpa: modulus(m.from_reaction_mpa),
            e_app_stress_mpa: modulus(m.from_stress_mpa),
            algebraic_error_mpa: modulus(m.algebraic_error_mpa).filter(|e| e.is_finite()),
            algebraic_error_percent: Some(100.0 * self.work.relative_error)
                .filter(|e| e.is_finite()),
            stiffness_n_per_mm: of_force(self.work.stiffness_n_per_mm),
            force_n: of_force(self.work.force_n),
            moment_nmm: self.work.moment_nmm.filter(|v| by_angle && v.is_finite()),
            mechanisms: self.mechanisms.map(|n| n as u64),
            strength: self.yielding.as_ref().map_or_else(Strength::default, |y| {
                strength(&y.curve, self.slope(&blank.key))
            }),
            ..Solution::default()
        };
        Row {
            solved: Some(solution),
            marks: Marks {
                is_no_answer: self.no_answer,
                note: self.all_notes(&blank.key),
                ..blank.marks
            },
            ..blank
        }
    }

    /// Whether load steps ended before the whole load.
    fn is_stopped(&self) -> bool {
        self.yielding.as_ref().is_some_and(|y| y.stopped)
    }

    /// Slope of the elastic part of the curve: the modulus, or under shear what the first step has.
    fn slope(&self, key: &Settings) -> f64 {
        let first = self.yielding.as_ref().and_then(|y| y.curve.first());
        match key.load.has_modulus() {
            true => self.moduli.e_app_mpa,
            false => first.map_or(f64::NAN, |p| p.stress_mpa / p.strain),
        }
    }

    /// What a model lacks that carries no load although the bone does.
    fn lost(&self, method: Method) -> &'static str {
        match (self.connected(), method) {
            (true, _) => {
                "no site of this lattice has all its bonds, and firm counts such sites only"
            }
            (false, Method::Lattice) => {
                "this lattice is disconnected although the bone connects the loaded faces"
            }
            (false, _) => {
                "elements of this size are disconnected although the bone connects the loaded faces"
            }
        }
    }

    /// The same with what was said of load steps.
    fn all_notes(&self, key: &Settings) -> Option<String> {
        let mut note = self.note(key);
        if let Some(yielding) = &self.yielding {
            let steps = long_steps_in_words(&yielding.curve, self.slope(key));
            for words in yielding.said.iter().chain(&steps) {
                notes::add(&mut note, words);
            }
        }
        note
    }

    /// What a reader must know of this row, in words.
    fn note(&self, key: &Settings) -> Option<String> {
        let zero = match key.load.has_modulus() {
            true => "E_app is 0",
            false => "force and moment are 0",
        };
        match self.ended {
            _ if self.no_answer => Some(format!("{}: {}", self.lost(key.method), notes::NO_ANSWER)),
            _ if !self.connected() => {
                Some(format!("no path of bone between the loaded faces: {zero}"))
            }
            Ended::IterationLimit => Some("not converged: iteration limit reached".into()),
            Ended::Breakdown => Some("not converged: the model is not positive definite".into()),
            Ended::Mechanism => Some(format!(
                "only a mechanism connects the loaded faces (parts that turn and shift freely): {zero} to rounding"
            )),
            Ended::EnergyTolerance | Ended::ResidualTolerance => None,
        }
    }
}
