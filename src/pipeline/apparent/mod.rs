//! Owns the solve stage: material, load, supports and accuracy in, apparent moduli out.
//!
//! A discretisation of the specimen stands behind one trait, [`Discretisation`]; which one a solve takes is chosen here and
//! nowhere else. A new one is a file with that trait, and an arm below.

pub mod discretisation;
pub mod equilibrium;
pub mod fields;
pub mod job;
pub mod lattice;
pub mod mechanisms;
pub mod params;
pub mod solved;
pub mod stiffness;
pub mod tissue;
pub mod voxel_fe;

use crate::error::Result;
use crate::pipeline::apparent::discretisation::Prepared;
use crate::pipeline::apparent::job::Job;
use crate::pipeline::apparent::lattice::connected::ConnectedModel;
use crate::pipeline::apparent::lattice::sites::SiteModel;
use crate::pipeline::apparent::solved::Solved;
use crate::pipeline::apparent::tissue::Tissue;
use crate::pipeline::apparent::voxel_fe::VoxelModel;
use crate::pipeline::lattice::{Boundary, Case, LatticeParams};
use crate::solver::cg::CgStep;
use crate::volume::Specimen;
pub use discretisation::Discretisation;
pub use params::{Conditions, Ends, Load, Method, SolveParams};

/// The solves that the settings name, in the order of their rows.
pub fn jobs(lattices: &LatticeParams, params: &SolveParams) -> Vec<Job> {
    match params.method {
        Method::Lattice => lattices.cases().into_iter().map(of_lattice).collect(),
        Method::VoxelFe => vec![Job::of::<VoxelModel>(())],
    }
}

/// The solve of one lattice.
pub fn of_lattice(case: Case) -> Job {
    match case.boundary {
        Boundary::Graded if case.is_connected() => Job::of::<ConnectedModel>(case),
        _ => Job::of::<SiteModel>(case),
    }
}

/// Solves one lattice of a specimen under one load.
///
/// # Errors
/// Settings that do not fit the specimen or the lattice.
pub fn solve_lattice(
    specimen: &Specimen,
    case: &Case,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> Result<Solved> {
    solve_one(&of_lattice(*case), specimen, params, observe)
}

/// Solves a specimen with one hexahedron per voxel, or finer or coarser ones, under one load.
///
/// # Errors
/// Settings that do not fit the specimen.
pub fn solve_voxels(
    specimen: &Specimen,
    params: &SolveParams,
    observe: impl FnMut(CgStep),
) -> Result<Solved> {
    solve_one(&Job::of::<VoxelModel>(()), specimen, params, observe)
}

fn solve_one(
    job: &Job,
    specimen: &Specimen,
    params: &SolveParams,
    mut observe: impl FnMut(CgStep),
) -> Result<Solved> {
    params.check()?;
    let tissue = Tissue::of(specimen, params)?;
    let prepared = Prepared {
        specimen,
        tissue: &tissue,
    };
    let solution = job.solve(prepared, params, &mut |_, step| observe(step))?;
    Ok(solution.modulus()?.0)
}
