//! Owns voxel elements of tissue that yields: laws by element, load steps from the elastic solution on, and what is said of their end.

mod summary;

use crate::error::{Error, Result};
use crate::operator::held::Held;
use crate::physics::hex8::plastic::points::Points;
use crate::physics::hex8::plastic::{PlasticBricks, Tissue as Yielder};
use crate::physics::plasticity::{Elastic, Plasticity, YieldLaw};
use crate::pipeline::apparent::discretisation::Displacements;
use crate::pipeline::apparent::discretisation::steps::length::{Adaptive, Lengths};
use crate::pipeline::apparent::discretisation::steps::{History, Loading, Outcome, Stepping, load};
use crate::pipeline::apparent::discretisation::yielded::{Kept, Yielded};
use crate::pipeline::apparent::params::{LoadSteps, SolveParams};
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::VoxelModel;
use crate::result::strength::OFFSET;
use crate::solver::load_step::StepParams;

/// Squared energy norm of the error left in a step, over its work and the tolerance of the solve: with it energies balance to 1e-6.
const BALANCED: f64 = 1e-6;

/// A step is halved so many times at most.
const HALVINGS: u32 = 6;

impl VoxelModel {
    /// Loads the body step by step, from its elastic solution under the whole load.
    ///
    /// # Errors
    /// Labels without a law, steps that cannot be kept.
    pub(super) fn yielded(
        &self,
        tissue: &Tissue,
        held: &Held,
        elastic: &Displacements,
        kept: &mut dyn Kept,
    ) -> Result<Yielded> {
        let mesh = self.bricks.mesh();
        let laws = self.laws()?;
        let solids = Solids::of(tissue);
        let of_node = |node: usize| {
            let (factor, kind) = self.bricks.stiffness_of(node);
            Yielder {
                elastic: solids.elastic(f64::from(factor), kind),
                law: laws.at(node),
            }
        };
        let points = Points::new(mesh.grid.spacing_mm, true);
        let strain = self.motion.loaded.displacement_mm / self.motion.loaded.gauge_mm;
        let preconditioner = self.family.multigrid(held, &self.multigrid());
        let loading = Loading {
            held,
            elastic,
            external: None,
        };
        let fresh = || History::new(mesh.len());
        let mut history = kept
            .resume()
            .filter(|h| h.u.len() == mesh.len())
            .unwrap_or_else(fresh);
        let mut failed = None;
        let body = PlasticBricks::new(&*self.bricks, mesh, points, of_node);
        let outcome = load(
            body,
            &loading,
            &preconditioner,
            &stepping(&self.params, strain),
            &mut history,
            |history| match kept.keep(history) {
                Ok(()) => true,
                Err(error) => {
                    failed = Some(error);
                    false
                }
            },
        );
        match failed {
            Some(error) => Err(error),
            None => Ok(self.summary(history, outcome, of_node)),
        }
    }

    /// The law of each element.
    ///
    /// # Errors
    /// A label of the bone without a law.
    fn laws(&self) -> Result<Laws> {
        let labelled = match &self.params.plasticity {
            Some(Plasticity::Labels(labels)) => labels,
            Some(Plasticity::All(law)) => return Ok(Laws::All(*law)),
            None => unreachable!("only tissue that yields is loaded to yield"),
        };
        let Some(labels) = &self.labels else {
            return Err(Error::setting(
                "solve.plasticity",
                "laws are given by label, and the scan keeps no labels",
                "segment a labelled scan with --labels, or give one law for all tissue",
            ));
        };
        let law_of = |value: i32| labelled.iter().position(|l| l.value == value);
        if let Some(value) = labels.all().iter().find(|value| law_of(**value).is_none()) {
            return Err(Error::setting(
                "solve.plasticity",
                format!("bone with the label {value} has no law"),
                "add the label, or segment again without it",
            ));
        }
        let mesh = self.bricks.mesh();
        let of = |element: Option<usize>| {
            let value = element.map(|e| labels.at(self.voxel(e)));
            value.and_then(law_of).unwrap_or(0) as u8
        };
        Ok(Laws::Labels(
            labelled.iter().map(|l| l.law).collect(),
            mesh.low_corner_elements().map(of).collect(),
        ))
    }

    /// The voxel of an element, which is one or a part of one.
    fn voxel(&self, element: usize) -> usize {
        let ([nx, ny, nz], n) = (self.bricks.mesh().grid.n, self.params.refine);
        let (x, y, z) = (element % nx, element / nx % ny, element / (nx * ny));
        let voxels = crate::grid::Grid::new([nx / n, ny / n, nz / n], [1.0; 3]);
        voxels.index([x / n, y / n, z / n])
    }
}

/// `strain`: of the ends under the whole load.
fn stepping(params: &SolveParams, strain: f64) -> Stepping {
    Stepping {
        lengths: match params.steps {
            LoadSteps::Even(steps) => Lengths::Even(steps),
            LoadSteps::Adaptive(divided) => Lengths::Adaptive(Adaptive {
                offset: OFFSET / strain.abs(),
                divided,
            }),
        },
        halvings: HALVINGS,
        params: StepParams {
            tolerance: BALANCED * params.tolerance,
            max_iterations: 25,
            max_cg_iterations: 1000,
        },
    }
}

/// Laws by the node that is an element's corner of smallest x, y, z.
enum Laws {
    All(YieldLaw),
    Labels(Vec<YieldLaw>, Vec<u8>),
}

impl Laws {
    fn at(&self, node: usize) -> YieldLaw {
        match self {
            Laws::All(law) => *law,
            Laws::Labels(laws, of) => laws[usize::from(of[node])],
        }
    }
}

/// Elastic moduli before an element's factor.
struct Solids(Vec<(f64, f64)>);

impl Solids {
    fn of(tissue: &Tissue) -> Solids {
        Solids(match tissue {
            Tissue::Uniform(s) => vec![(s.young_mpa, s.poisson)],
            Tissue::Mixed(m) => m.poissons.iter().map(|&nu| (m.mean_mpa, nu)).collect(),
        })
    }

    fn elastic(&self, factor: f64, kind: u8) -> Elastic {
        let (young, poisson) = self.0[usize::from(kind)];
        Elastic::of(factor * young, poisson)
    }
}

/// How steps that ended early are named.
fn stopped_in_words(outcome: Outcome, history: &History) -> Option<String> {
    let last = history.steps.last().map_or(0.0, |s| s.load);
    match outcome {
        Outcome::Done => None,
        Outcome::Stopped { length } => Some(format!(
            "not converged: no equilibrium was found beyond {:.1} % of the load, in steps of {:.2} %",
            100.0 * last,
            100.0 * length
        )),
    }
}
