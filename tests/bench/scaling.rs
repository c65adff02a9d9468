//! What more threads can do for voxel FE: time of each part of a solve on one thread and on several, the serial share that follows,
//! and Amdahl's figures for 8 and 16 threads; and the memory of each part.
//! `cargo bench --bench scaling`; `BONEPD_BENCH_VOXELS` sets the edge (default 160: about 1e6 elements). The machine must do nothing else.

#![allow(missing_docs, reason = "a bench is no interface")]

mod specimen;

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::Axis;
use bonepd_ct::operator::coarsen::Coarsen;
use bonepd_ct::operator::held::Held;
use bonepd_ct::operator::{Operator, SinglePreconditioner};
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::volume::Specimen;
use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use std::time::Instant;

const RUNS: usize = 5;

/// Parts of a solve, with how often six iterations take each.
const PARTS: [(&str, f64); 5] = [
    ("mesh", 1.0),
    ("multigrid's set-up", 1.0),
    ("product, single", 6.0),
    ("product, double", 2.0),
    ("cycle", 7.0),
];

fn main() {
    let n = specimen::edge(160);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
        let bone = specimen::waves(n, wave, solid);
        let [one, all] = [1, cores].map(|threads| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a pool of threads").install(|| times(&bone))
        });
        report(name, cores, one, all);
        memory(&bone);
    }
}

/// Median seconds of each of [`PARTS`].
fn times(bone: &Specimen) -> [f64; 5] {
    let mesh = || mesh(bone);
    let (op, held) = model(mesh());
    let params = AmgParams {
        cycles: 2,
        ..AmgParams::new(bone.bone.grid.spacing_mm)
    };
    let amg = Amg::new(&op, &held, &params);
    let (x, mut y) = (vec![[0.5; 3]; op.sites()], vec![[0.0; 3]; op.sites()]);
    let x32 = vec![[0.5f32; 3]; op.sites()];
    let (mut y32, mut spare) = (x32.clone(), x32.clone());
    [
        median(|| drop(mesh())),
        median(|| drop(Amg::new(&op, &held, &params))),
        median(|| {
            let chunks = y32.par_chunks_mut(op.chunk()).enumerate();
            chunks.for_each(|(c, y)| {
                let start = c * op.chunk();
                op.rows_f32(start..start + y.len(), &x32, y);
            });
        }),
        median(|| op.apply(&x, &mut y)),
        median(|| amg.apply_single(&x32, &mut y32, &mut spare)),
    ]
}

fn median(mut f: impl FnMut()) -> f64 {
    let mut seconds = [0.0; RUNS].map(|_: f64| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64()
    });
    seconds.sort_unstable_by(f64::total_cmp);
    seconds[RUNS / 2]
}

fn mesh(bone: &Specimen) -> VoxelMesh {
    let grid = bone.bone.grid;
    let grips = Planes::within(&grid, Axis::Z, 0.0).expect("room between the ends");
    VoxelMesh::new(grid, bone.bone.as_slice(), |b| *b != 0, grips).expect("few enough nodes")
}

fn model(mesh: VoxelMesh) -> (Hex8, Held) {
    let mut held = Held::none(mesh.len());
    let top = mesh.grid.n[2];
    for segment in &mesh.segments {
        if [0, top].contains(&(segment.at[2] as usize)) {
            segment.nodes().for_each(|node| held.hold(node, 2));
        }
    }
    (Hex8::new(mesh, 1000.0, 0.3, Integration::Full), held)
}

/// The serial share of a part that takes `one` seconds on one thread and `all` on so many.
fn serial(one: f64, all: f64, threads: usize) -> f64 {
    let p = threads as f64;
    ((all / one - 1.0 / p) / (1.0 - 1.0 / p)).clamp(0.0, 1.0)
}

fn amdahl(serial: f64, threads: f64) -> f64 {
    1.0 / (serial + (1.0 - serial) / threads)
}

fn report(name: &str, threads: usize, one: [f64; 5], all: [f64; 5]) {
    println!("\n{name}: seconds on 1 and on {threads} threads");
    let line = |part: &str, [one, all]: [f64; 2]| {
        if threads == 1 {
            return println!("  {part:<20} {one:8.4}");
        }
        let share = serial(one, all, threads);
        println!(
            "  {part:<20} {one:8.4} {all:8.4}  {:5.2} times, serial share {:4.1} %, {:4.1} times on 8, {:4.1} on 16",
            one / all,
            100.0 * share,
            amdahl(share, 8.0),
            amdahl(share, 16.0)
        );
    };
    let mut sum = [0.0; 2];
    for (k, (part, times)) in PARTS.into_iter().enumerate() {
        line(part, [one[k], all[k]]);
        sum = [sum[0] + times * one[k], sum[1] + times * all[k]];
    }
    line("six iterations", sum);
}

/// Bytes per element of what stays during a solve.
fn memory(bone: &Specimen) {
    let (op, held) = model(mesh(bone));
    let params = AmgParams {
        cycles: 2,
        ..AmgParams::new(bone.bone.grid.spacing_mm)
    };
    let [fine, coarse] = Amg::new(&op, &held, &params).bytes();
    let elements = op.mesh.around.iter().filter(|a| **a >> 7 == 1).count() as f64;
    let nodes = op.sites() as f64;
    println!(
        "  {elements} elements, {:.2} nodes an element. Bytes an element: vectors {:.0}, multigrid's finest level {:.0}, assembled levels {:.0}",
        nodes / elements,
        72.0 * nodes / elements,
        fine as f64 / elements,
        coarse as f64 / elements
    );
}
