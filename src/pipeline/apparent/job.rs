//! Owns one solve, whichever its discretisation: its row's columns, its cost, its solution.

use crate::error::{Error, Result};
use crate::operator::coarsen::Coarsen;
use crate::operator::{Functional, MixedPrecision};
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::equilibrium::{Observe, equilibrium};
use crate::pipeline::apparent::fields::Recorded;
use crate::pipeline::apparent::mechanisms::mechanisms;
use crate::pipeline::apparent::params::{Load, SolveParams};
use crate::pipeline::apparent::solved::Solved;
use crate::pipeline::apparent::stiffness::{Stiffness, stiffness};
use crate::pipeline::apparent::tissue::Tissue;
use crate::result::settings::Settings;
use crate::volume::Specimen;

type Label = dyn Fn(&Specimen, &SolveParams, Settings) -> Settings + Send + Sync;
type AskCost = dyn Fn(&SolveParams, Known) -> Result<Cost> + Send + Sync;
type Solve = dyn Fn(Prepared, &SolveParams, &mut Observe) -> Result<JobResult> + Send + Sync;

/// One solve to come.
pub struct Job {
    label: Box<Label>,
    cost: Box<AskCost>,
    solve: Box<Solve>,
}

/// What a solve came to.
#[allow(clippy::large_enum_variant)] // one value a solve, moved once
pub enum JobResult {
    /// Of one load.
    Modulus(Solved, Recorded),
    /// Of the six unit strains.
    Stiffness(Stiffness),
}

impl Job {
    pub fn of<D: Discretisation>(case: D::Case) -> Job {
        Job {
            label: Box::new(move |specimen, params, key| D::label(&case, specimen, params, key)),
            cost: Box::new(move |params, known| D::cost(&case, params, known)),
            solve: Box::new(move |prepared, params, observe| {
                solve::<D>(&case, prepared, params, observe)
            }),
        }
    }

    /// Fills in the settings of a row that say how the specimen is discretised.
    pub fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        (self.label)(specimen, params, key)
    }

    /// What the solve takes.
    ///
    /// # Errors
    /// Settings that do not fit the specimen.
    pub fn cost(&self, params: &SolveParams, known: Known) -> Result<Cost> {
        (self.cost)(params, known)
    }

    /// Discretises and solves.
    ///
    /// # Errors
    /// Settings that do not fit the specimen. Not converging is no error: the solution says so.
    pub fn solve(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        observe: &mut Observe,
    ) -> Result<JobResult> {
        (self.solve)(prepared, params, observe)
    }

    /// The same from the specimen alone, for a single solve.
    ///
    /// # Errors
    /// Settings that are not usable or do not fit the specimen.
    pub fn solve_specimen(
        &self,
        specimen: &Specimen,
        params: &SolveParams,
        observe: &mut Observe,
    ) -> Result<JobResult> {
        params.check()?;
        let tissue = &Tissue::of(specimen, params)?;
        self.solve(Prepared { specimen, tissue }, params, observe)
    }
}

impl JobResult {
    /// The modulus of one load, and its fields.
    ///
    /// # Errors
    /// A stiffness matrix, which is no single modulus.
    pub fn modulus(self) -> Result<(Solved, Recorded)> {
        match self {
            JobResult::Modulus(solved, recorded) => Ok((solved, recorded)),
            JobResult::Stiffness(_) => Err(Error::setting(
                "load",
                "the apparent stiffness matrix is no single modulus",
                "use --load uniaxial or confined",
            )),
        }
    }
}

fn solve<D: Discretisation>(
    case: &D::Case,
    prepared: Prepared,
    params: &SolveParams,
    observe: &mut Observe,
) -> Result<JobResult> {
    if params.load == Load::Stiffness {
        let solved = stiffness::<D>(case, prepared, params, observe)?;
        return Ok(JobResult::Stiffness(solved));
    }
    let model = D::build(case, prepared, params)?;
    let system = model.system(LoadSet::Compression);
    if system.sites == 0 {
        let solved = Solved::disconnected(system.dropped);
        return Ok(JobResult::Modulus(solved, Recorded::default()));
    }
    let mechanisms = count_mechanisms(&system)?;
    let loads = LoadSet::Compression.numbers();
    let (_, u, info) = equilibrium(&system, loads, params, observe)
        .next()
        .expect("a compression is one load");
    let moduli = model.assess(&u, &info);
    let recorded = model.fields(prepared, params, &u, &moduli)?;
    let solved = Solved {
        sites: system.sites,
        dropped: system.dropped,
        unknowns: system.held.free::<3>(),
        iterations: info.iterations,
        residual: info.residual,
        ended: info.ended,
        moduli,
        mechanisms,
    };
    Ok(JobResult::Modulus(solved, recorded))
}

fn count_mechanisms<O: MixedPrecision, C: Coarsen, G: Functional<3>>(
    system: &System<O, C, G>,
) -> Result<Option<usize>> {
    match &system.places {
        Some(places) => {
            mechanisms(system.operator, &system.held, &places.at, places.reach).map(Some)
        }
        None => Ok(None),
    }
}
