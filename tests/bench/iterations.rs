//! Iterations to 0.1 % of E_app by voxel FE: those after which the true error is that small, those after which the program
//! stops, and those of plain conjugate gradients. `cargo bench --bench iterations`, half an hour; words choose
//! cases (`-- thin-3 stack`). Iterations do not depend on the machine.

#![allow(missing_docs, reason = "a bench is no interface")]

mod specimens;

use bonepd_ct::discretisation::voxels::Planes;
use bonepd_ct::operator::held::Constrained;
use bonepd_ct::pipeline::apparent::discretisation::Prepared;
use bonepd_ct::pipeline::apparent::ends::motion::EndMotion;
use bonepd_ct::pipeline::apparent::ends::supports;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::apparent::tissue::Tissue;
use bonepd_ct::pipeline::apparent::voxel_fe::bricks::{Bricks, Keep};
use bonepd_ct::pipeline::apparent::voxel_fe::nodes::Gripped;
use bonepd_ct::pipeline::apparent::{Ends, SolveParams};
use bonepd_ct::pipeline::phantom::PhantomParams;
use bonepd_ct::solver::cg;
use bonepd_ct::solver::cg::jacobi::Jacobi;
use bonepd_ct::solver::cg::{CgParams, ENERGY_ALONE};
use bonepd_ct::volume::Specimen;
use std::path::Path;

const TARGET: f64 = 1e-3;

fn main() {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|w| !w.starts_with('-'))
        .collect();
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    for seed in 1..=5 {
        let name = format!("thin-{seed}");
        if wanted(&name) {
            report(&name, &thin(seed), Ends::Bonded);
        }
    }
    if wanted("stack") {
        match std::env::var_os("BONEPD_STACK") {
            Some(stack) => report("stack", &specimens::real(Path::new(&stack)), Ends::Free),
            None => println!("stack: skipped: BONEPD_STACK does not name the folder of its slices"),
        }
    }
}

/// Struts of two voxels at BV/TV 12 %, about a million unknowns.
fn thin(seed: u64) -> Specimen {
    specimens::phantom(&PhantomParams {
        size_mm: [2.3; 3],
        spacing_mm: 0.02,
        bvtv: 0.12,
        thickness_mm: 0.04,
        seed,
        ..PhantomParams::default()
    })
}

fn report(name: &str, specimen: &Specimen, ends: Ends) {
    let params = SolveParams {
        ends,
        ..SolveParams::default()
    };
    let solve = |params: &SolveParams| {
        let solved = solve_voxels(specimen, params, |_| ()).expect("a solve");
        (solved.iterations, solved.moduli.e_app_mpa, solved.unknowns)
    };
    let (_, exact, unknowns) = solve(&SolveParams {
        tolerance: 1e-8,
        ..params.clone()
    });
    let (stopped, e_app, _) = solve(&params);
    let error_after = |max_iterations: usize| {
        let (_, e_app, _) = solve(&SolveParams {
            max_iterations,
            ..params.clone()
        });
        e_app / exact - 1.0
    };
    let mut enough = stopped;
    while enough > 1 && error_after(enough - 1) < TARGET {
        enough -= 1;
    }
    println!(
        "{name}: {unknowns} unknowns, E_app {exact:.4} MPa; below 0.1 % after {enough} iterations, stopped after {stopped} with {:+.4} %",
        100.0 * (e_app / exact - 1.0),
    );
    let (iterations, energy) = plain(specimen, &params);
    let energy_exact = exact * specimen.tv_mm3 * params.strain * params.strain;
    println!(
        "{name}: plain conjugate gradients to a residual of 1e-6: {iterations} iterations, {:+.4} %",
        100.0 * (energy / energy_exact - 1.0)
    );
}

/// Iterations of conjugate gradients with the diagonal until the residual is 1e-6 of the first, and the energy `uᵀAu`.
fn plain(specimen: &Specimen, params: &SolveParams) -> (usize, f64) {
    let tissue = &Tissue::of(specimen, params).expect("one solid");
    let prepared = Prepared { specimen, tissue };
    let model = Bricks::new(prepared, params, Keep::BetweenGrips).expect("bricks");
    let grid = model.mesh().grid;
    let grips = Planes::within(&grid, params.axis, 0.0).expect("room between the ends");
    let motion = EndMotion::of(specimen, params, grid.size_mm()[params.axis.index()]);
    let mesh = model.mesh();
    let nodes = Gripped {
        mesh,
        grips,
        uneven: None,
    };
    let held = supports::held(&nodes, &motion, params.load);
    let mut u = supports::start(&nodes, &motion);
    let diagonal = Jacobi::new(&Constrained {
        inner: &model,
        held: &held,
    });
    let cg = CgParams {
        energy_tolerance: 0.0,
        residual_tolerance: 1e-6,
        ..CgParams::default()
    };
    let info = cg::minimise(&model, &held, &diagonal, &mut u, &cg, ENERGY_ALONE, |_| ());
    (info.iterations, info.energy)
}
