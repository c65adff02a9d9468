//! Owns one solve, whichever its discretisation: its row's columns, its cost, its solution.

use crate::discretisation::voxels::{self, Planes};
use crate::error::{Error, Result};
use crate::operator::{Functional, MixedPrecision, Operator};
use crate::pipeline::apparent::discretisation::memory::{Memory, Unlimited, counted, fitting};
use crate::pipeline::apparent::discretisation::yielded::{Kept, NotKept};
use crate::pipeline::apparent::discretisation::{
    Cost, Discretisation, EndSites, Known, LoadSet, Prepared, System,
};
use crate::pipeline::apparent::ends::reactions::reactions;
use crate::pipeline::apparent::equilibrium::{Observe, equilibrium};
use crate::pipeline::apparent::fields::{Equilibrated, Recorded};
use crate::pipeline::apparent::geometry_fe::topology::settled;
use crate::pipeline::apparent::mechanisms::mechanisms;
use crate::pipeline::apparent::params::{Load, SolveParams};
use crate::pipeline::apparent::solved::{Moduli, Solved};
use crate::pipeline::apparent::stiffness::{Stiffness, stiffness};
use crate::pipeline::apparent::tissue::Tissue;
use crate::result::settings::{Motion, Settings};
use crate::solver::cg::Ended;
use crate::volume::Specimen;
use std::ops::Deref;
use std::sync::Mutex;

/// One solve to come.
pub struct Job(Box<dyn Solve>);

/// What a solve can be asked, whichever its discretisation.
pub trait Solve: Send + Sync {
    /// Keeps the model from solve to solve.
    fn keep(&mut self);

    /// Fills in the settings of a row that say how the specimen is discretised.
    fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings;

    /// What the solve takes.
    ///
    /// # Errors
    /// Settings that do not fit the specimen.
    fn cost(&self, params: &SolveParams, known: Known) -> Result<Cost>;

    /// What the solve takes, its bytes counted in the bone. Takes time, and memory on lattices.
    ///
    /// # Errors
    /// As [`Solve::cost`].
    fn counted_cost(&self, prepared: Prepared, params: &SolveParams) -> Result<Cost>;

    /// Refuses a solve that `memory` does not hold.
    ///
    /// # Errors
    /// Such a solve, settings that do not fit the specimen.
    fn fits(&self, prepared: Prepared, params: &SolveParams, memory: &dyn Memory) -> Result<()>;

    /// Discretises and solves; load steps are kept in `kept`.
    ///
    /// # Errors
    /// Settings that do not fit the specimen, a solve that `memory` does not hold, steps that cannot be kept. Not converging is no
    /// error: the solution says so.
    fn solve(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        memory: &dyn Memory,
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
    pub fn of<D: Discretisation + Send + 'static>(case: D::Case) -> Job {
        Job(Box::new(Of::<D> { case, kept: None }))
    }

    /// The same job, which keeps its model from solve to solve: one specimen under several loads.
    pub fn of_a_family(mut self) -> Job {
        self.0.keep();
        self
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
        let params = &*settled(specimen, params)?;
        let tissue = &Tissue::of(specimen, params)?;
        let prepared = Prepared { specimen, tissue };
        self.solve(prepared, params, &Unlimited, &mut NotKept, observe)
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
struct Of<D: Discretisation> {
    case: D::Case,
    /// The model of the solve before; None where none is kept.
    kept: Option<Mutex<Option<D>>>,
}

impl<D: Discretisation> Of<D> {
    /// The model for this load: that of the solve before where only loads differ.
    fn model(&self, prepared: Prepared, params: &SolveParams, memory: &dyn Memory) -> Result<D> {
        if let Some(kept) = self.take_kept() {
            // What fitted before fits again.
            if let Some(model) = kept.under(prepared, params)? {
                return Ok(model);
            }
        }
        let counted = fitting::<D>(&self.case, prepared, params, memory)?;
        let mut model = match counted {
            Some(model) => model,
            None => D::build(&self.case, prepared, params)?,
        };
        if self.kept.is_some() {
            model.keep();
        }
        Ok(model)
    }

    fn take_kept(&self) -> Option<D> {
        let kept = self.kept.as_ref()?;
        kept.lock().unwrap_or_else(|e| e.into_inner()).take()
    }
}

impl<D: Discretisation + Send> Solve for Of<D> {
    fn keep(&mut self) {
        self.kept.get_or_insert_default();
    }

    fn label(&self, specimen: &Specimen, params: &SolveParams, key: Settings) -> Settings {
        D::label(&self.case, specimen, params, key)
    }

    fn cost(&self, params: &SolveParams, known: Known) -> Result<Cost> {
        D::cost(&self.case, params, known)
    }

    fn counted_cost(&self, prepared: Prepared, params: &SolveParams) -> Result<Cost> {
        Ok(counted::<D>(&self.case, prepared, params)?.0)
    }

    fn fits(&self, prepared: Prepared, params: &SolveParams, memory: &dyn Memory) -> Result<()> {
        fitting::<D>(&self.case, prepared, params, memory).map(drop)
    }

    fn solve(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        memory: &dyn Memory,
        kept: &mut dyn Kept,
        observe: &mut Observe,
    ) -> Result<JobResult> {
        if params.load == Load::Stiffness {
            let build = || self.model(prepared, params, memory);
            let solved = stiffness(build, prepared.specimen, params, observe)?;
            return Ok(JobResult::Stiffness(solved));
        }
        let model = self.model(prepared, params, memory)?;
        let result = of_ends(&model, prepared, params, kept, observe)?;
        if let Some(kept) = &self.kept {
            *kept.lock().unwrap_or_else(|e| e.into_inner()) = Some(model);
        }
        Ok(result)
    }
}

/// Solves a model under the motion of its ends, or the loads on labels.
fn of_ends<D: Discretisation>(
    model: &D,
    prepared: Prepared,
    params: &SolveParams,
    kept: &mut dyn Kept,
    observe: &mut Observe,
) -> Result<JobResult> {
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
    let mut work = match system.by_label {
        Some(labels) => labels.by.work(&info),
        None => motion.work(&moduli, &info),
    };
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
    match system.by_label {
        None => {
            recorded.details.ends = reactions(motion, *planes_mm, end.force, each).to_vec();
        }
        Some(labels) => {
            recorded.details.labels = labels.by.table(labels.mesh, end.u, end.force);
            recorded.note = labels.by.note();
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;
    use crate::pipeline::apparent::of_lattice;
    use crate::pipeline::lattice::{Boundary, Case, PLACED, Structure};
    use crate::volume::Volume;

    /// Memory that may not do, so that everything is counted first.
    struct InQuestion;

    impl Memory for InQuestion {
        fn surely_holds(&self, _: f64) -> bool {
            false
        }

        fn refuse(&self, cost: &Cost) -> Result<()> {
            assert!(cost.bytes[0] > 0.0);
            Ok(())
        }
    }

    #[test]
    fn a_lattice_that_is_counted_first_is_not_built_again() {
        let grid = Grid::new([12; 3], [0.05; 3]);
        let specimen = &Specimen {
            name: "block".into(),
            bone: Volume::from_vec(grid, vec![1; grid.len()]),
            tv_mm3: grid.size_mm().iter().product(),
            tv_definition: "box".into(),
            grey: None,
            threshold: None,
        };
        let params = SolveParams::default();
        let tissue = &Tissue::of(specimen, &params).unwrap();
        for boundary in [Boundary::Firm, Boundary::Connected] {
            let job = of_lattice(Case {
                structure: Structure::Sc,
                lp_mm: 0.1,
                boundary,
                registration_mm: [0.0; 3],
            });
            PLACED.set(0);
            let prepared = Prepared { specimen, tissue };
            let solved = job.solve(prepared, &params, &InQuestion, &mut NotKept, &mut |_, _| {});
            let (solved, _) = solved.unwrap().modulus().unwrap();
            assert!(solved.moduli.e_app_mpa > 0.0);
            assert_eq!(PLACED.get(), 1, "{boundary:?}");
        }
    }
}
