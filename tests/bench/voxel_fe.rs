//! Speed of voxel finite elements: operator in both precisions, multigrid's set-up and cycle, whole solves, each
//! beside a triad of the same run. `cargo bench --bench voxel_fe`; `BONEPD_BENCH_VOXELS` sets the edge (default 100).

use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::coarsen::Coarsen;
use bonepd_ct::operator::held::Held;
use bonepd_ct::operator::{Operator, SinglePreconditioner};
use bonepd_ct::par::CHUNK;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::solve::amg::{Amg, AmgParams};
use bonepd_ct::stage::solve::SolveParams;
use bonepd_ct::stage::solve::voxel_fe::solve_voxels;
use bonepd_ct::topology::voxels::{Planes, VoxelMesh};
use bonepd_ct::volume::{Specimen, Volume};
use criterion::{Criterion, Throughput};
use rayon::prelude::*;
use std::hint::black_box;

/// Bone where a sum of waves is large: `solid` of 1 is full. Plump at 0.25 with 8-voxel waves, thin at 0.12.
fn phantom(n: usize, wave: f64, solid: f64) -> Specimen {
    let grid = Grid::new([n; 3], [0.02; 3]);
    let k = std::f64::consts::TAU / wave;
    let level = |i: usize| {
        let [x, y, z] = [i % n, i / n % n, i / (n * n)].map(|v| k * v as f64);
        (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()).abs()
    };
    let mut sorted: Vec<f64> = (0..grid.len()).step_by(7).map(level).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let cut = sorted[((sorted.len() - 1) as f64 * solid) as usize];
    let voxels = (0..grid.len()).map(|i| u8::from(level(i) <= cut)).collect();
    Specimen {
        name: "phantom".into(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, voxels),
        tv_definition: "box".into(),
        grey: None,
    }
}

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
    let n = std::env::var("BONEPD_BENCH_VOXELS").map_or(100, |v| v.parse().unwrap_or(100));
    for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
        let specimen = phantom(n, wave, solid);
        let (op, held) = model(&specimen);
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
            b.iter(|| {
                let x = black_box(&x32);
                y32.par_chunks_mut(CHUNK)
                    .enumerate()
                    .for_each(|(c, y)| op.rows_f32(c * CHUNK..c * CHUNK + y.len(), x, y));
            })
        });
        let params = AmgParams::new(specimen.bone.grid.spacing_mm);
        group.bench_function("set-up", |b| b.iter(|| Amg::new(&op, &held, &params)));
        let amg = Amg::new(&op, &held, &params);
        let mut spare = x32.clone();
        group.bench_function("cycle", |b| {
            b.iter(|| amg.apply_single(black_box(&x32), &mut y32, &mut spare))
        });
        drop(amg);
        group.bench_function("solve to 0.1 %", |b| {
            b.iter(|| {
                solve_voxels(&specimen, &SolveParams::default(), |_| ()).map(|s| s.iterations)
            })
        });
        group.finish();
    }
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
