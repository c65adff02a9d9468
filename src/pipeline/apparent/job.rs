//! Owns one solve, whichever its discretisation: its row's columns, its cost, its solution.

use crate::discretisation::voxels::{self, Planes};
use crate::error::{Error, Result};
use crate::operator::{Functional, MixedPrecision, Operator};
use crate::pipeline::apparent::discretisation::yielded::{Kept, NotKept};
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, EndSites, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::ends::reactions::reactions;
use crate::pipeline::apparent::equilibrium::{Observe, equilibrium};
use crate::pipeline::apparent::fields::{Equilibrated, Recorded};
use crate::pipeline::apparent::mechanisms::mechanisms;
use crate::pipeline::apparent::params::{Load, SolveParams};
use crate::pipeline::apparent::solved::{Moduli, Solved};
use crate::pipeline::apparent::stiffness::{Stiffness, stiffness};
use crate::pipeline::apparent::tissue::Tissue;
use crate::result::settings::{Motion, Settings};
use crate::solver::cg::Ended;
use crate::volume::Specimen;
use std::ops::Deref;

/// One solve to come.
pub struct Job(Box<dyn Solve>);

/// What a solve can be asked, whichever its discretisation.
pub trait Solve: Send + Sync {
    /// Fills in the settings of a row that say how the specimen is discretised.
    fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings;

    /// What the solve takes.
    ///
    /// # Errors
    /// Settings that do not fit the specimen.
    fn cost(&self, params: &SolveParams, known: Known) -> Result<Cost>;

    /// Discretises and solves; load steps are kept in `kept`.
    ///
    /// # Errors
    /// Settings that do not fit the specimen, steps that cannot be kept. Not converging is no error: the solution says so.
    fn solve(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        kept: &mut dyn Kept,
        observe: &mut Observe,
    ) -> Result<JobResult>;
}

/// The result of a solve.
#[allow(clippy::large_enum_variant)] // one value a solve, moved once
pub enum JobResult {
    /// Of one load.
    Modulus(Solved, Recorded),
    /// Of the six unit strains.
    Stiffness(Stiffness),
}

impl Deref for Job {
    type Target = dyn Solve;

    fn deref(&self) -> &Self::Target {
        &*self.0
    }
}

impl Job {
    /// The solve by one discretisation.
    pub fn of<D: Discretisation + 'static>(case: D::Case) -> Job {
        Job(Box::new(Of::<D>(case)))
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
        self.solve(Prepared { specimen, tissue }, params, &mut NotKept, observe)
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

/// A solve by one kind of discretisation.
struct Of<D: Discretisation>(D::Case);

impl<D: Discretisation> Solve for Of<D> {
    fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        D::label(&self.0, specimen, params, key)
    }

    fn cost(&self, params: &SolveParams, known: Known) -> Result<Cost> {
        D::cost(&self.0, params, known)
    }

    fn solve(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        kept: &mut dyn Kept,
        observe: &mut Observe,
    ) -> Result<JobResult> {
        if params.load == Load::Stiffness {
            let solved = stiffness::<D>(&self.0, prepared, params, observe)?;
            return Ok(JobResult::Stiffness(solved));
        }
        let model = D::build(&self.0, prepared, params)?;
        let system = model.system(LoadSet::Ends);
        if system.sites == 0 {
            let no_answer = bone_connects(prepared.specimen, params);
            let solved = Solved::disconnected(system.dropped, no_answer);
            return Ok(JobResult::Modulus(solved, Recorded::default()));
        }
        let mechanisms = count_mechanisms(&system)?;
        let loads = LoadSet::Ends.numbers();
        let (_, u, info) = equilibrium(&system, loads, params, observe)
            .next()
            .expect("one motion of the ends is one load");
        let mut force = vec![[0.0; 3]; u.len()];
        system.operator.apply(&u, &mut force);
        let elastic = Equilibrated {
            u: &u,
            force: &force,
            info: &info,
            plastic: None,
        };
        let EndSites {
            motion,
            planes_mm,
            each,
        } = &system.ends;
        let moduli = match motion.motion {
            Motion::Along => model.assess(&elastic),
            _ => Moduli::NONE,
        };
        let mut work = motion.work(&moduli, &info);
        // A mechanism bears nothing that could yield.
        let yielded = match (&system.load_steps, info.ended) {
            (Some(load), Ended::EnergyTolerance | Ended::ResidualTolerance) => {
                Some(load(prepared, &system.held, &u, kept)?)
            }
            _ => None,
        };
        let end = match &yielded {
            None => elastic,
            Some(y) => Equilibrated {
                u: &y.u,
                force: &y.force,
                info: &info,
                plastic: Some(&y.plastic),
            },
        };
        let mut recorded = model.fields(prepared, params, &end, &work)?;
        recorded.details.ends = reactions(motion, *planes_mm, end.force, each).to_vec();
        let iterations = info.iterations + yielded.as_ref().map_or(0, |y| y.iterations);
        let yielding = yielded.map(|y| y.yielding);
        if let Some(y) = &yielding {
            recorded.details.curve.clone_from(&y.curve);
            recorded.details.yielded.clone_from(&y.shares);
            work.force_n = y.curve.last().map(|p| p.force_n.abs());
        }
        let solved = Solved {
            sites: system.sites,
            dropped: system.dropped,
            model_bv_tv: Some(system.volume_mm3 / prepared.specimen.tv_mm3),
            unknowns: system.held.free::<3>(),
            iterations,
            residual: info.residual,
            ended: info.ended,
            moduli,
            work,
            mechanisms,
            no_answer: moduli.e_app_mpa == 0.0,
            yielding,
        };
        Ok(JobResult::Modulus(solved, recorded))
    }
}

/// Whether voxels of bone that share nodes join the grips. A grip that no voxel plane fits joins nothing.
pub fn bone_connects(specimen: &Specimen, params: &SolveParams) -> bool {
    let bone = &specimen.bone;
    let grips = Planes::within(&bone.grid, params.axis, params.grip_mm);
    grips.is_ok_and(|grips| voxels::connects(bone.grid, bone.as_slice(), |b| *b != 0, grips))
}

fn count_mechanisms<O: MixedPrecision, C, G: Functional<3>>(
    system: &System<O, C, G>,
) -> Result<Option<usize>> {
    match &system.places {
        Some(places) => {
            mechanisms(system.operator, &system.held, &places.at, places.reach).map(Some)
        }
        None => Ok(None),
    }
}
