//! Speed of voxel finite elements: operator in both precisions, multigrid's set-up and cycle, whole solves, each
//! beside a triad of the same run; and the operators' share of what memory and arithmetic allow, measured with them.
//! `cargo bench --bench voxel_fe`; `BONEPD_BENCH_VOXELS` sets the edge (default 100).

#![allow(missing_docs, reason = "a bench is no interface")]

mod limits;
mod specimen;

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::Axis;
use bonepd_ct::operator::coarsen::Coarsen;
use bonepd_ct::operator::held::Held;
use bonepd_ct::operator::{Operator, SinglePreconditioner};
use bonepd_ct::par::CHUNK;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::volume::Specimen;
use criterion::{Criterion, Throughput};
use limits::{Limits, median_s};
use rayon::prelude::*;
use std::hint::black_box;

fn model(specimen: &Specimen) -> (Hex8, Held) {
    let grid = specimen.bone.grid;
    let grips = Planes::within(&grid, Axis::Z, 0.0).expect("room between the ends");
    let mesh = VoxelMesh::new(grid, specimen.bone.as_slice(), |b| *b != 0, grips)
        .expect("few enough nodes");
    let mut held = Held::none(mesh.len());
    for segment in &mesh.segments {
        let z = segment.at[2] as usize;
        if z <= grips.low || z >= grips.high {
            segment.nodes().for_each(|node| held.hold(node, 2));
        }
    }
    (Hex8::new(mesh, 1000.0, 0.3, Integration::Full), held)
}

fn benches(c: &mut Criterion) {
    let n = specimen::edge(100);
    for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
        let bone = specimen::waves(n, wave, solid);
        let (op, held) = model(&bone);
        let nodes = op.sites();
        let x = vec![[0.5; 3]; nodes];
        let mut y = vec![[0.0; 3]; nodes];
        let (x32, mut y32) = (vec![[0.5f32; 3]; nodes], vec![[0f32; 3]; nodes]);
        let mut group = c.benchmark_group(name);
        group
            .sample_size(10)
            .throughput(Throughput::Elements(nodes as u64));
        group.bench_function("triad", |b| b.iter(|| triad(black_box(&x), &mut y)));
        group.bench_function("operator f64", |b| {
            b.iter(|| op.apply(black_box(&x), &mut y))
        });
        group.bench_function("operator f32", |b| {
            b.iter(|| rows_f32(&op, black_box(&x32), &mut y32))
        });
        let params = AmgParams::new(bone.bone.grid.spacing_mm);
        group.bench_function("set-up", |b| b.iter(|| Amg::new(&op, &held, &params)));
        let amg = Amg::new(&op, &held, &params);
        let mut spare = x32.clone();
        group.bench_function("cycle", |b| {
            b.iter(|| amg.apply_single(black_box(&x32), &mut y32, &mut spare))
        });
        drop(amg);
        group.bench_function("solve to 0.1 %", |b| {
            b.iter(|| solve_voxels(&bone, &SolveParams::default(), |_| ()).map(|s| s.iterations))
        });
        group.finish();
        roofline(name, &bone);
    }
}

/// Floating-point operations a node, as `physics::hex8::kernel` counts them.
const FLOPS: f64 = 567.0;

fn roofline(name: &str, bone: &Specimen) {
    let limits = Limits::measure();
    println!(
        "\n{name}: triad {:.1} GB/s, fused multiply-add {:.0} GFLOP/s (f64; {:.0} on 256 bits)",
        limits.triad, limits.fma_f64, limits.fma_f64_256
    );
    let (op, _) = model(bone);
    let nodes = op.mesh.around.iter().filter(|a| **a != 0).count() as f64;
    let (x, mut y) = (vec![[0.5; 3]; op.sites()], vec![[0.0; 3]; op.sites()]);
    let (x32, mut y32) = (vec![[0.5f32; 3]; op.sites()], vec![[0f32; 3]; op.sites()]);
    let double = median_s(|| op.apply(black_box(&x), &mut y));
    let single = median_s(|| rows_f32(&op, black_box(&x32), &mut y32));
    // Displacements in, forces out, a byte for the elements around.
    for (precision, time, bytes) in [("f64", double, 49.0), ("f32", single, 25.0)] {
        let (least, bound) = limits.least_s(bytes, FLOPS, precision == "f32");
        let lanes = if precision == "f32" { 2.0 } else { 1.0 };
        let peak_256 = 1e9 * lanes * limits.fma_f64_256;
        println!(
            "  operator {precision}: {:.1} M nodes/s; {bytes} bytes and {FLOPS} flops a node; {:.0} % of the {bound} limit, {:.0} % of 256-bit arithmetic",
            1e-6 * nodes / time,
            100.0 * least * nodes / time,
            100.0 * FLOPS * nodes / time / peak_256
        );
    }
}

fn rows_f32(op: &Hex8, x: &[[f32; 3]], y: &mut [[f32; 3]]) {
    y.par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(c, y)| op.rows_f32(c * CHUNK..c * CHUNK + y.len(), x, y));
}

fn triad(x: &[[f64; 3]], y: &mut [[f64; 3]]) {
    y.par_chunks_mut(CHUNK)
        .zip(x.par_chunks(CHUNK))
        .for_each(|(y, x)| {
            for (y, x) in y.as_flattened_mut().iter_mut().zip(x.as_flattened()) {
                *y = 0.5 * *y + x;
            }
        });
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    benches(&mut criterion);
    criterion.final_summary();
}
