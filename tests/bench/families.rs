//! Solves that come in families, as ratios to one solve: six unit strains, twenty solves of a body that weakens, unit loads of one mesh,
//! mixed conditions. `cargo bench --bench families`; `BONEPD_BENCH_VOXELS` sets the edge (default 100). CPU seconds of one thread.

#![allow(missing_docs, reason = "a bench is no interface")]

mod specimen;

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::Axis;
use bonepd_ct::operator::held::Held;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::pipeline::apparent::{Conditions, Ends, Load, SolveParams, of_voxels};
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::cg::fallback::minimise_or_fall_back;
use bonepd_ct::solver::cg::{CgParams, ENERGY_ALONE};
use bonepd_ct::volume::Specimen;
use std::time::Instant;

/// Solves of the sequence.
const SOLVES: i32 = 20;

fn main() {
    let n = specimen::edge(100);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a pool of threads").install(|| {
        for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
            let bone = specimen::waves(n, wave, solid);
            loads(name, &bone);
            sequence(name, &bone);
        }
    });
}

fn seconds(mut f: impl FnMut()) -> f64 {
    let mut times = [0.0; 3].map(|_: f64| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64()
    });
    times.sort_unstable_by(f64::total_cmp);
    times[1]
}

fn loads(name: &str, bone: &Specimen) {
    let bonded = SolveParams {
        ends: Ends::Bonded,
        ..SolveParams::default()
    };
    let of = |load| SolveParams {
        load,
        ..bonded.clone()
    };
    let tensor = |conditions| SolveParams {
        conditions,
        ..of(Load::Stiffness)
    };
    let solve = |jobs: &[SolveParams]| {
        let family = of_voxels().of_a_family();
        for params in jobs {
            let result = family.solve_specimen(bone, params, &mut |_, _| ());
            drop(result.expect("a mesh that fits"));
        }
    };
    let one = seconds(|| solve(std::slice::from_ref(&bonded)));
    let line = |what: &str, jobs: &[SolveParams]| {
        let all = seconds(|| solve(jobs));
        println!(
            "{name}: {what:<34} {all:7.2} s, {:5.2} times one load",
            all / one
        );
    };
    println!("{name}: one load, ends bonded {one:.2} s");
    line(
        "six unit strains, kinematic",
        &[tensor(Conditions::Kinematic)],
    );
    line("six unit strains, mixed", &[tensor(Conditions::Mixed)]);
    let three = [bonded.clone(), of(Load::ShearX), of(Load::ShearY)];
    line("compression and two shears", &three);
}

fn sequence(name: &str, bone: &Specimen) {
    let grid = bone.bone.grid;
    let grips = Planes::within(&grid, Axis::Z, 0.0).expect("room between the ends");
    let mesh = VoxelMesh::new(grid, bone.bone.as_slice(), |b| *b != 0, grips).expect("few nodes");
    let top = grid.n[2] as u32;
    let mut held = Held::none(mesh.len());
    let mut start = vec![[0.0; 3]; mesh.len()];
    for segment in &mesh.segments {
        for node in segment.nodes() {
            start[node][2] = -0.01 * f64::from(segment.at[2]);
            if [0, top].contains(&segment.at[2]) {
                (0..3).for_each(|c| held.hold(node, c));
            }
        }
    }
    // Bone in a middle block, about 2 % of all, at 0.9 of its modulus of the solve before.
    let [nx, ny, nz] = grid.n;
    let inside = |e: usize| {
        let at = [e % nx, e / nx % ny, e / (nx * ny)];
        (0..3).all(|a| at[a] > grid.n[a] * 36 / 100 && at[a] < grid.n[a] * 64 / 100) && nz > 0
    };
    let step = |s: i32| {
        let factor = |e: usize| if inside(e) { 0.9f32.powi(s) } else { 1.0 };
        Heterogeneous::new(mesh.clone(), 1000.0, 0.3, Integration::Full, factor)
    };
    let steps: Vec<Heterogeneous> = (0..SOLVES).map(step).collect();
    let of = AmgParams {
        cycles: 2,
        ..AmgParams::new(grid.spacing_mm)
    };
    let solve = |steps: &[Heterogeneous]| {
        let amg = Amg::new(&steps[0], &held, &of);
        let (mut u, mut known, mut iterations) = (start.clone(), None, 0);
        for operator in steps {
            let params = CgParams {
                known_eigenvalue: known,
                ..CgParams::default()
            };
            let info =
                minimise_or_fall_back(operator, &held, &amg, &mut u, &params, ENERGY_ALONE, |_| ());
            known = info.eigenvalue.map(|v| 0.9 * v);
            iterations += info.iterations;
        }
        iterations
    };
    let mut counts = [0; 2];
    let one = seconds(|| counts[0] = solve(&steps[..1]));
    let all = seconds(|| counts[1] = solve(&steps));
    println!(
        "{name}: {SOLVES} solves, {} iterations, {all:.2} s: {:.2} times one of {} iterations",
        counts[1],
        all / one,
        counts[0]
    );
}
