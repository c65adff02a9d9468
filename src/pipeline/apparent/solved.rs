//! Owns what a solve yields, and its row of the results table.

use crate::pipeline::apparent::params::{Load, Method, SolveParams};
use crate::result::notes;
use crate::result::row::{Marks, Row, Solution};
use crate::result::settings::{Settings, Supports};
use crate::solver::cg::Ended;
use crate::volume::Specimen;

/// A number with the part of it that the solver left undone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// The headline (see [`Solution::e_app_mpa`]).
    pub e_app_mpa: f64,
    pub from_energy_mpa: f64,
    pub from_reaction_mpa: f64,
    /// Over all sites; for firm over the fully coordinated ones.
    pub from_stress_mpa: f64,
    /// Estimated algebraic error of the headline.
    pub algebraic_error_mpa: f64,
}

/// A solved model.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    pub sites: usize,
    pub dropped: usize,
    pub unknowns: usize,
    pub iterations: usize,
    pub residual: f64,
    pub ended: Ended,
    pub moduli: Moduli,
    /// Only where the settings ask for a count.
    pub mechanisms: Option<usize>,
    /// True where the modulus is 0 although the bone connects the loaded faces: the model does not, or counts none of its sites.
    pub no_answer: bool,
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
            dropped,
            unknowns: 0,
            iterations: 0,
            residual: 0.0,
            ended: Ended::ResidualTolerance,
            moduli: zero,
            mechanisms: None,
            no_answer,
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
            supports: match self.load {
                Load::Stiffness => Supports::Faces(self.conditions),
                Load::Uniaxial | Load::Confined => Supports::Ends(self.ends),
            },
            axis: self.axis,
            strain: self.strain,
            grip_mm: self.grip_mm,
            tv_definition: specimen.tv_definition.clone(),
            tv_mm3: specimen.tv_mm3,
            bv_tv: specimen.bv_tv(),
            tolerance: Some(self.tolerance),
            ..Settings::default()
        }
    }
}

impl Solved {
    /// Completes the row of a solve with its numbers. The clock and the memory are the caller's to fill in.
    pub fn row(&self, blank: Row) -> Row {
        let m = &self.moduli;
        let count = |n: usize| Some(n as u64);
        let solution = Solution {
            sites: count(self.sites),
            dropped_sites: count(self.dropped),
            unknowns: count(self.unknowns),
            iterations: count(self.iterations),
            residual: Some(self.residual),
            converged: Some(self.ended.converged()),
            // Of no sites the stress is a sum of nothing, which is -0.
            e_app_mpa: Some(m.e_app_mpa + 0.0),
            e_app_reaction_mpa: Some(m.from_reaction_mpa),
            e_app_stress_mpa: Some(m.from_stress_mpa),
            algebraic_error_mpa: Some(m.algebraic_error_mpa).filter(|e| e.is_finite()),
            mechanisms: self.mechanisms.map(|n| n as u64),
            ..Solution::default()
        };
        Row {
            solved: Some(solution),
            marks: Marks {
                note: self.note(blank.key.method),
                ..blank.marks
            },
            ..blank
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

    /// What a reader must know of this row, in words.
    fn note(&self, method: Method) -> Option<String> {
        match self.ended {
            _ if self.no_answer => Some(format!("{}: {}", self.lost(method), notes::NO_ANSWER)),
            _ if !self.connected() => {
                Some("no path of bone between the loaded faces: E_app is 0".into())
            }
            Ended::IterationLimit => Some("not converged: iteration limit reached".into()),
            Ended::Breakdown => Some("not converged: the model is not positive definite".into()),
            Ended::Mechanism => Some(
                "what connects the loaded faces only turns and shifts: E_app is 0 to rounding"
                    .into(),
            ),
            Ended::EnergyTolerance | Ended::ResidualTolerance => None,
        }
    }
}
