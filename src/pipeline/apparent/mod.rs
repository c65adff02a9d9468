//! Owns the solve stage: material, load, supports and accuracy in, apparent moduli out.
//!
//! A discretisation of the specimen stands behind one trait, [`Discretisation`]; which one a solve takes is chosen here and
//! nowhere else. A new one is a file with that trait, and an arm below.

#[doc(hidden)]
pub mod checks;
#[doc(hidden)]
pub mod discretisation;
#[doc(hidden)]
pub mod ends;
#[doc(hidden)]
pub mod equilibrium;
#[doc(hidden)]
pub mod fields;
#[doc(hidden)]
pub mod geometry_fe;
#[doc(hidden)]
pub mod job;
#[doc(hidden)]
pub mod lattice;
#[doc(hidden)]
pub mod mechanisms;
pub mod params;
#[doc(hidden)]
pub mod resolution;
pub mod solved;
#[doc(hidden)]
pub mod stiffness;
#[doc(hidden)]
pub mod tissue;
#[doc(hidden)]
pub mod voxel_fe;

use crate::error::Result;
pub use crate::measure::apparent::EndWork;
pub use crate::measure::pistoia::Pistoia;
pub use crate::physics::material::{Label, Law, Material};
pub use crate::physics::plasticity::{DruckerPrager, LabelLaw, Plasticity, VonMises, YieldLaw};
use crate::pipeline::apparent::geometry_fe::GeometryModel;
use crate::pipeline::apparent::job::Job;
use crate::pipeline::apparent::lattice::connected::ConnectedModel;
use crate::pipeline::apparent::lattice::sites::SiteModel;
use crate::pipeline::apparent::solved::Solved;
use crate::pipeline::apparent::voxel_fe::VoxelModel;
use crate::pipeline::lattice::{Boundary, Case, LatticeParams};
pub use crate::solver::cg::{CgStep, Ended};
use crate::volume::Specimen;
#[doc(hidden)]
pub use discretisation::Discretisation;
pub use fields::Field;
#[doc(hidden)]
pub use geometry_fe::topology::settled;
pub use params::{
    CoarsenBy, Conditions, Ends, HeldLabel, Load, LoadSteps, Method, MovedLabel, PushedLabel, Sed,
    SolveParams, SurfaceOf,
};

/// The solves that the settings name, in the order of their rows.
#[doc(hidden)]
pub fn jobs(lattices: &LatticeParams, params: &SolveParams) -> Vec<Job> {
    match params.method {
        Method::Lattice => lattices.cases().into_iter().map(of_lattice).collect(),
        Method::VoxelFe => vec![of_voxels()],
        Method::GeometryFe => vec![of_geometry()],
    }
}

/// The solve of one lattice.
#[doc(hidden)]
pub fn of_lattice(case: Case) -> Job {
    match case.boundary {
        Boundary::Connected => Job::of::<ConnectedModel>(case),
        Boundary::Firm | Boundary::Floppy | Boundary::Weighted => Job::of::<SiteModel>(case),
    }
}

/// The solve by one hexahedron per voxel, or finer or coarser ones.
#[doc(hidden)]
pub fn of_voxels() -> Job {
    Job::of::<VoxelModel>(())
}

/// The solve by ten-node tetrahedra inside the smooth surface.
#[doc(hidden)]
pub fn of_geometry() -> Job {
    Job::of::<GeometryModel>(())
}

/// Solves one lattice of a specimen under one load.
///
/// # Errors
/// Settings that do not fit the specimen or the lattice.
pub fn solve_lattice(
    specimen: &Specimen,
    case: &Case,
    params: &SolveParams,
    mut observe: impl FnMut(CgStep),
) -> Result<Solved> {
    let solution = of_lattice(*case).solve_specimen(specimen, params, &mut |_, s| observe(s))?;
    Ok(solution.modulus()?.0)
}

/// Solves a specimen by voxel elements under one load.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn solve_voxels(
    specimen: &Specimen,
    params: &SolveParams,
    mut observe: impl FnMut(CgStep),
) -> Result<Solved> {
    let solution = of_voxels().solve_specimen(specimen, params, &mut |_, s| observe(s))?;
    Ok(solution.modulus()?.0)
}
