//! Owns the seam: what a solve needs of a three-dimensional discretisation of a specimen.

pub mod memory;
pub mod precondition;
pub mod steps;
pub mod yielded;

use crate::discretisation::voxels::VoxelMesh;
use crate::error::Result;
use crate::measure::apparent::EndWork;
use crate::operator::held::Held;
use crate::operator::{Functional, MixedPrecision};
use crate::pipeline::apparent::discretisation::precondition::Precondition;
use crate::pipeline::apparent::discretisation::yielded::{Kept, Yielded};
use crate::pipeline::apparent::ends::by_label::ByLabel;
use crate::pipeline::apparent::ends::motion::EndMotion;
use crate::pipeline::apparent::ends::reactions::End;
use crate::pipeline::apparent::fields::{Equilibrated, Recorded};
use crate::pipeline::apparent::params::SolveParams;
use crate::pipeline::apparent::solved::Moduli;
use crate::pipeline::apparent::tissue::Tissue;
use crate::result::settings::Settings;
use crate::solver::amg::AmgParams;
use crate::volume::Specimen;

/// Displacements of all sites, in mm.
pub type Displacements = Vec<[f64; 3]>;

/// A specimen with the tissue of its voxels: both are made once and serve all solves of a command.
#[derive(Clone, Copy)]
pub struct Prepared<'a> {
    /// The mask and, where needed, grey values.
    pub specimen: &'a Specimen,
    /// What its voxels are made of.
    pub tissue: &'a Tissue,
}

/// A discretised specimen, ready to be loaded.
pub trait Discretisation: Sized {
    /// What distinguishes one discretisation of this kind from another, apart from the settings of the solve.
    type Case: Copy + Send + Sync + 'static;

    /// Fills in the settings of a row that say how the specimen is discretised.
    fn label(
        case: &Self::Case,
        specimen: &Specimen,
        params: &SolveParams,
        key: Settings,
    ) -> Settings;

    /// What a solve takes, from what is known of the bone.
    ///
    /// # Errors
    /// Settings that do not fit the specimen.
    fn cost(case: &Self::Case, params: &SolveParams, known: Known) -> Result<Cost>;

    /// Bytes of a solve beyond the specimen, counted in the bone; and the model, where counting is building it, so that it is not built
    /// again. 0 where there is nothing to solve.
    ///
    /// # Errors
    /// As [`Discretisation::build`].
    fn count(
        case: &Self::Case,
        prepared: Prepared,
        params: &SolveParams,
    ) -> Result<(f64, Option<Self>)> {
        let [_, most] = Self::cost(case, params, Known::Bone(prepared))?.bytes;
        Ok((most, None))
    }

    /// Discretises the specimen: what carries load from support to support.
    ///
    /// # Errors
    /// Settings that do not fit the specimen, loads that this discretisation cannot bear.
    fn build(case: &Self::Case, prepared: Prepared, params: &SolveParams) -> Result<Self>;

    /// Keeps from now on what later loads may use.
    fn keep(&mut self) {}

    /// The same discretisation under other loads; None where the settings differ in more than loads, or nothing is gained.
    ///
    /// # Errors
    /// As [`Discretisation::build`].
    fn under(self, _prepared: Prepared, _params: &SolveParams) -> Result<Option<Self>> {
        Ok(None)
    }

    /// The equations of a set of loads that share their supports.
    fn system(
        &self,
        loads: LoadSet,
    ) -> System<'_, impl MixedPrecision, impl Precondition, impl Functional<3>>;

    /// Apparent moduli of a solution under [`LoadSet::Ends`], where the ends come nearer or part.
    fn assess(&self, solved: &Equilibrated) -> Moduli;

    /// Fields and other numbers of the same solution, as far as the settings ask for them.
    ///
    /// # Errors
    /// Settings that do not fit the specimen.
    fn fields(
        &self,
        prepared: Prepared,
        params: &SolveParams,
        solved: &Equilibrated,
        work: &EndWork,
    ) -> Result<Recorded>;
}

/// Calls what it is given with each site of the ends, and its place in mm.
pub type EachEndSite<'a> = Box<dyn Fn(&mut dyn FnMut(usize, End, [f64; 3])) + 'a>;

/// Supports and loads on the labels of an image, and the mesh whose nodes have them.
#[derive(Clone, Copy)]
pub struct LabelSupports<'a> {
    /// Which nodes do what.
    pub by: &'a ByLabel,
    /// Elements with their nodes.
    pub mesh: &'a VoxelMesh,
}

/// The ends of a discretised specimen.
pub struct EndSites<'a> {
    /// How they move.
    pub motion: EndMotion,
    /// Heights of the innermost gripped planes.
    pub planes_mm: [f64; 2],
    /// Goes over their sites.
    pub each: EachEndSite<'a>,
}

/// The body at the end of its load steps, from the elastic solution under the whole load. Fails on settings that do not fit the
/// specimen and on steps that cannot be kept.
pub type LoadSteps<'a> =
    Box<dyn Fn(Prepared, &Held, &Displacements, &mut dyn Kept) -> Result<Yielded> + 'a>;

/// Loads that share their supports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadSet {
    /// The one motion of the ends that the settings describe, load number 0.
    Ends,
    /// Unit strains that share their supports (Voigt order, 0 to 5), under the settings' conditions.
    UnitStrains(&'static [usize]),
}

impl LoadSet {
    /// Numbers of the loads.
    pub fn numbers(self) -> &'static [usize] {
        match self {
            LoadSet::Ends => &[0],
            LoadSet::UnitStrains(numbers) => numbers,
        }
    }
}

/// Equations of equilibrium, `A u = 0` on the unknowns that are not held.
pub struct System<'a, O, C, G> {
    /// The stiffness.
    pub operator: &'a O,
    /// What the preconditioner is built on: the operator, or the part of it that dominates.
    pub coarsen: C,
    /// Settings of multigrid.
    pub multigrid: AmgParams,
    /// The quantity wanted, where it is not the energy.
    pub goal: Option<G>,
    /// Which unknowns are held.
    pub held: Held,
    /// The start of a load (by number), which has the prescribed displacements: the field of a homogeneous body.
    pub start: Box<dyn Fn(usize) -> Displacements + 'a>,
    /// The sites at both ends and how they move.
    pub ends: EndSites<'a>,
    /// What is on the labels of an image in place of ends; None: ends.
    pub by_label: Option<LabelSupports<'a>>,
    /// How the body is loaded until it yields; None where nothing can yield.
    pub load_steps: Option<LoadSteps<'a>>,
    /// Sites or elements that carry load; 0 where the supports are not connected.
    pub sites: usize,
    /// Those that exist but carry none.
    pub dropped: usize,
    /// Volume of the sites' cells (connected, weighted: of their bone) or of the elements that carry load.
    pub volume_mm3: f64,
    /// Where sites are on an integer grid and how far the operator couples them; only where mechanisms are to be counted.
    pub places: Option<Places>,
}

/// Sites on an integer grid; `reach` is how far, along an axis, one site's displacement can be felt.
pub struct Places {
    /// Place of each site, in steps of the grid.
    pub at: Vec<[i32; 3]>,
    /// In steps of the grid.
    pub reach: i32,
}

/// What is known of the bone when the cost of a solve is asked for.
#[derive(Clone, Copy)]
pub enum Known<'a> {
    /// The size of the scan, from its header: voxels and, where their size is known, volume in mm³.
    Header {
        /// Number of voxels.
        voxels: f64,
        /// Volume of the scan; None where the voxel size is not known.
        volume_mm3: Option<f64>,
    },
    /// The bone, of which only the volume is looked at.
    Bone(Prepared<'a>),
}

/// What a solve takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Bytes beyond the specimen at the highest: at least and at most. 0 where there is nothing to solve.
    pub bytes: [f64; 2],
    /// Seconds on two cores; None where the voxel size is not known.
    pub time_s: Option<f64>,
    /// The setting that makes a solve smaller.
    pub resolution: Resolution,
}

/// The setting to change where a solve takes too much memory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Resolution {
    /// A larger one takes less.
    LatticeParameter(f64),
    /// Elements per voxel along each axis: fewer take less.
    Refine(usize),
    /// Voxels per element along each axis: more take less.
    Coarsen(usize),
    /// Edge of smooth elements in mm: a larger one takes less. 0: not known.
    Element(f64),
}

/// Share of a scan's volume that is taken for bone before it is read: trabecular bone fills less, but lattices pad it
/// (120 096 of 274 625 places at LP 0.06 mm measured).
pub const ASSUMED_BONE: f64 = 0.5;
