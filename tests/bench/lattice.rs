//! Speed of lattices, and the pipeline they stand in: operator, multigrid set-up and cycle, whole solves, a scan from
//! file to report; and the operators' share of what memory and arithmetic allow, measured in the same run.
//! `cargo bench --bench lattice`; `BONEPD_BENCH_VOXELS` sets the edge (default 100: about 250 000 sites).

#![allow(missing_docs, reason = "a bench is no interface")]

mod limits;
mod specimen;

use bonepd_ct::cohort::scans::Selection;
use bonepd_ct::cohort::{Resources, cohort};
use bonepd_ct::discretisation::lattice::sites::Sites;
use bonepd_ct::grid::Axis;
use bonepd_ct::machine::session::Session;
use bonepd_ct::operator::held::Held;
use bonepd_ct::operator::{MixedPrecision, Operator, SinglePreconditioner};
use bonepd_ct::physics::lattice::multigrid::Springs;
use bonepd_ct::physics::lattice::{Lattice, Moduli};
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::apparent::solve_lattice;
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure, build};
use bonepd_ct::recipe::Recipe;
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::volume::Specimen;
use criterion::{Criterion, Throughput};
use limits::{Limits, median_s};
use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

const LP_MM: f64 = 0.02;

fn case() -> Case {
    Case {
        structure: Structure::Sc,
        lp_mm: LP_MM,
        boundary: Boundary::Floppy,
        registration_mm: [0.0; 3],
    }
}

fn held(sites: &Sites) -> Held {
    let mut held = Held::none(sites.len());
    for s in (0..sites.len()).filter(|&s| sites.grips.holds(sites.plane(s))) {
        held.hold(s, 2);
    }
    held
}

fn model(sites: &Sites, poisson: f64) -> Lattice {
    Lattice::new(
        sites.clone(),
        Moduli::new(Structure::Sc, LP_MM, 1000.0, poisson).expect("a solid"),
    )
}

fn benches(c: &mut Criterion, name: &str, bone: &Specimen) {
    let sites = build(bone, &case(), Axis::Z, 0.0).expect("a lattice that fits");
    let (quarter, third) = (model(&sites, 0.25), model(&sites, 0.3));
    let held = held(&sites);
    let x = vec![[0.5; 3]; sites.len()];
    let mut y = x.clone();
    let mut group = c.benchmark_group(name);
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(2))
        .throughput(Throughput::Elements(sites.len() as u64));
    group.bench_function("build", |b| {
        b.iter(|| build(bone, &case(), Axis::Z, 0.0).map(|s| s.len()))
    });
    group.bench_function("operator, nu 1/4", |b| {
        b.iter(|| quarter.apply(black_box(&x), &mut y))
    });
    group.bench_function("operator, nu 0.3", |b| {
        b.iter(|| third.apply(black_box(&x), &mut y))
    });
    let x32 = vec![[0.5f32; 3]; sites.len()];
    let (mut y32, mut spare) = (x32.clone(), x32.clone());
    group.bench_function("operator, nu 0.3, single precision", |b| {
        b.iter(|| third.apply_single(black_box(&x32), &mut y32, |_, _| 0.0))
    });
    let springs = Springs::new(&third);
    let params = AmgParams::lattice(LP_MM);
    group.bench_function("multigrid set-up", |b| {
        b.iter(|| Amg::new(&springs, &held, &params).levels())
    });
    let amg = Amg::new(&springs, &held, &params);
    group.bench_function("multigrid cycle", |b| {
        b.iter(|| amg.apply_single(black_box(&x32), &mut y32, &mut spare))
    });
    drop(amg);
    // Thin waves are one site thick, mechanisms that take a thousand iterations: minutes of a bench.
    if name != "thin" {
        group.bench_function("solve to 0.1 %", |b| {
            b.iter(|| {
                let params = SolveParams::default();
                solve_lattice(bone, &case(), &params, |_| ()).map(|s| s.iterations)
            })
        });
    }
    group.finish();
}

/// A scan of the quick start, from file to tables and report.
fn pipeline(c: &mut Criterion) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let recipe = Recipe::read(&root.join("pipelines/quick.toml")).expect("a recipe");
    let scan = [root.join("sample_data/trabecular.nii.gz")];
    let resources = Resources {
        jobs: 1,
        memory_mib: None,
    };
    let session = Session {
        quiet: true,
        force: true,
        ..Session::default()
    };
    let mut group = c.benchmark_group("pipeline");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(5));
    group.bench_function("quick start, one scan", |b| {
        b.iter(|| {
            let out = tempfile::tempdir().expect("room for results");
            let all = Selection::default();
            cohort(&recipe, &scan, out.path(), &all, None, &resources, &session)
                .map(|_| ())
                .expect("results")
        })
    });
    group.finish();
}

/// Floating-point operations of an SC site's springs: per pair three differences, then `d dᵀ` on one lane (axial) or by
/// three diagonals.
const SPRING_FLOPS: f64 = 3.0 * (9.0 + 6.0) + 6.0 * (9.0 + 18.0);
/// Of the volumetric pass: a difference and a product per pair, and the sum and product that return it.
const VOLUMETRIC_FLOPS: f64 = 9.0 * (3.0 + 6.0) + 9.0 * (3.0 + 6.0);

fn roofline(name: &str, bone: &Specimen) {
    let limits = Limits::measure();
    println!(
        "\n{name}: triad {:.1} GB/s, fused multiply-add {:.0} GFLOP/s (f64)",
        limits.triad, limits.fma_f64_256
    );
    let sites = build(bone, &case(), Axis::Z, 0.0).expect("a lattice that fits");
    let n = sites.len() as f64;
    let x = vec![[0.5; 3]; sites.len()];
    let mut y = x.clone();
    let neighbours = sites.neighbours.bytes() as f64 / n;
    // Each array once: displacements in, forces out, neighbours; the volumetric pass writes and reads two sums a site,
    // and reads forces and neighbours again.
    let spring_bytes = 24.0 + 24.0 + neighbours;
    let volumetric_bytes = 32.0 + 48.0 + neighbours;
    let cases = [
        ("operator, nu 1/4", 0.25, spring_bytes, SPRING_FLOPS),
        (
            "operator, nu 0.3",
            0.3,
            spring_bytes + volumetric_bytes,
            SPRING_FLOPS + VOLUMETRIC_FLOPS,
        ),
    ];
    for (operator, poisson, bytes, flops) in cases {
        let model = model(&sites, poisson);
        let time = median_s(|| model.apply(black_box(&x), &mut y)) / n;
        let (least, bound) = limits.least_s(bytes, flops, false);
        println!(
            "  {operator}: {:.1} M sites/s; {bytes:.0} bytes and {flops:.0} flops a site; {:.0} % of the {bound} limit",
            1e-6 / time,
            100.0 * least / time
        );
    }
    println!("  neighbours: {neighbours:.1} bytes a site");
}

fn main() {
    let n = specimen::edge(100);
    let mut criterion = Criterion::default().configure_from_args();
    for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
        let bone = specimen::waves(n, wave, solid);
        benches(&mut criterion, name, &bone);
        roofline(name, &bone);
    }
    pipeline(&mut criterion);
    criterion.final_summary();
}
