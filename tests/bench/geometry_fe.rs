//! Where the time of geometry-based finite elements goes: surface, mesh, set-up, iterations, sensitivity. CPU seconds, wall seconds
//! and the resident memory at its highest after each part.
//! `cargo bench --bench geometry_fe`: the stack in the folder that `BONEPD_STACK` names, else a phantom; numbers are sizes of elements in mm
//! (`-- 0.06 0.044`; none: the default size). `RAYON_NUM_THREADS` sets the threads.

mod specimens;

use bonepd_ct::discretisation::tetrahedra::fill::fill;
use bonepd_ct::discretisation::tetrahedra::lattice::{Lattice, planes};
use bonepd_ct::discretisation::tetrahedra::nodes::TetMesh;
use bonepd_ct::discretisation::tetrahedra::pieces::{Keep, keep};
use bonepd_ct::discretisation::tetrahedra::quality::{euler, quality};
use bonepd_ct::discretisation::tetrahedra::surface::{Bound, Surface};
use bonepd_ct::measure::apparent::EndWork;
use bonepd_ct::measure::morphometry;
use bonepd_ct::operator::Operator;
use bonepd_ct::physics::tet10::Tet10;
use bonepd_ct::pipeline::apparent::discretisation::precondition::Precondition;
use bonepd_ct::pipeline::apparent::discretisation::{Discretisation, LoadSet, Prepared};
use bonepd_ct::pipeline::apparent::fields::Equilibrated;
use bonepd_ct::pipeline::apparent::geometry_fe::GeometryModel;
use bonepd_ct::pipeline::apparent::tissue::Tissue;
use bonepd_ct::pipeline::apparent::{Method, SolveParams};
use bonepd_ct::pipeline::phantom::PhantomParams;
use bonepd_ct::solver::cg::CgParams;
use bonepd_ct::solver::cg::fallback::minimise_or_fall_back;
use bonepd_ct::system;
use bonepd_ct::volume::Specimen;
use std::path::Path;
use std::time::Instant;

fn main() {
    let sizes: Vec<f64> = std::env::args()
        .skip(1)
        .filter_map(|word| word.parse().ok())
        .collect();
    let specimen = match std::env::var_os("BONEPD_STACK") {
        Some(stack) => timed("read and segment", || specimens::real(Path::new(&stack))),
        None => timed("phantom", phantom),
    };
    let voxels = specimen.bone.as_slice().iter().filter(|b| **b != 0).count();
    println!(
        "{voxels} bone voxels, {} threads",
        rayon::current_num_threads()
    );
    if sizes.is_empty() {
        solve(&specimen, None);
    }
    for size in sizes {
        solve(&specimen, Some(size));
    }
}

/// What `part` yields, after a line of what it took.
fn timed<T>(name: &str, part: impl FnOnce() -> T) -> T {
    let (cpu, wall) = (cpu_s(), Instant::now());
    let made = part();
    println!(
        "{name:28} {:8.2} CPU s {:8.2} s {:8.0} MiB at the highest so far",
        cpu_s() - cpu,
        wall.elapsed().as_secs_f64(),
        peak_mib()
    );
    made
}

/// Processor time of this process in seconds, all threads.
#[cfg(unix)]
fn cpu_s() -> f64 {
    let mut at = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the pointer is valid for writes of one `timespec`.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut at) };
    at.tv_sec as f64 + 1e-9 * at.tv_nsec as f64
}

/// Not asked for elsewhere.
#[cfg(not(unix))]
fn cpu_s() -> f64 {
    f64::NAN
}

fn peak_mib() -> f64 {
    system::peak_bytes().map_or(f64::NAN, |bytes| bytes / (1024.0 * 1024.0))
}

fn phantom() -> Specimen {
    specimens::phantom(&PhantomParams {
        size_mm: [2.0; 3],
        spacing_mm: 0.02,
        bvtv: 0.25,
        thickness_mm: 0.16,
        seed: 1,
        ..PhantomParams::default()
    })
}

/// One solve, part by part; then the parts of its mesh once more, by themselves.
fn solve(specimen: &Specimen, element_mm: Option<f64>) {
    let params = SolveParams {
        method: Method::GeometryFe,
        element_mm,
        ..SolveParams::default()
    };
    let tissue = &Tissue::of(specimen, &params).expect("one solid");
    let prepared = Prepared { specimen, tissue };
    let start = (cpu_s(), Instant::now());
    let model = timed("surface, mesh, operator", || {
        GeometryModel::build(&(), prepared, &params).expect("a mesh")
    });
    let system = model.system(LoadSet::Ends);
    let multigrid = timed("multigrid's set-up", || {
        system.coarsen.precondition(&system.held, &system.multigrid)
    });
    let mut u = (system.start)(0);
    let cg = CgParams {
        energy_tolerance: params.tolerance,
        max_iterations: params.max_iterations,
        ..CgParams::default()
    };
    let goal = system.goal.as_ref();
    let info = timed("iterations", || {
        minimise_or_fall_back(
            system.operator,
            &system.held,
            &multigrid,
            &mut u,
            &cg,
            goal,
            |_| (),
        )
    });
    let mut force = vec![[0.0; 3]; u.len()];
    system.operator.apply(&u, &mut force);
    let solved = Equilibrated {
        u: &u,
        force: &force,
        info: &info,
        plastic: None,
    };
    let moduli = model.assess(&solved);
    let recorded = timed("sensitivity", || {
        model.fields(prepared, &params, &solved, &EndWork::default())
    });
    println!(
        "all                          {:8.2} CPU s {:8.2} s {:8.0} MiB",
        cpu_s() - start.0,
        start.1.elapsed().as_secs_f64(),
        peak_mib()
    );
    println!(
        "{} elements of {:.4} mm, {} unknowns, {} iterations, {:.4} MPa, sensitivity {:.3}",
        system.sites,
        model.elements().mesh.cell_mm,
        system.held.free::<3>(),
        info.iterations,
        moduli.e_app_mpa,
        recorded.map_or(f64::NAN, |r| r.surface.map_or(f64::NAN, |s| s.sensitivity))
    );
    let size_mm = model.elements().mesh.cell_mm;
    drop(multigrid);
    of_mesh(specimen, size_mm);
}

/// Parts of the first line of a solve.
fn of_mesh(specimen: &Specimen, size_mm: f64) {
    let (Some(grey), Some(threshold)) = (&specimen.grey, &specimen.threshold) else {
        return;
    };
    let surface = timed("  surface", || {
        Surface::new(vec![Bound {
            values: grey.clone(),
            level: threshold.lower,
            sign: 1.0,
        }])
    });
    let ends = surface.grid().size_mm();
    let lattice = Lattice::new(std::array::from_fn(|a| planes(&[0.0, ends[a]], size_mm)));
    let mut mesh = timed("  lattice and tetrahedra", || {
        fill(&surface, &lattice).expect("a mesh")
    });
    timed("  angles", || quality(&mesh));
    timed("  Euler number of the mesh", || euler(&mesh));
    timed("  Euler number of the mask", || {
        morphometry::euler(&specimen.bone)
    });
    let between = Keep::Between {
        axis: 2,
        ends_mm: [0.0, ends[2]],
    };
    timed("  pieces", || keep(&mut mesh, between));
    let nodes = timed("  nodes", || TetMesh::of(&mesh));
    timed("  operator", || Tet10::new(nodes, 1000.0, 0.3, None));
}
