//! Heap of whole solves beyond the scan, at its highest: bytes per lattice site and per voxel element.
//! Beside it what `--dry-run` predicts. `cargo bench --bench memory`; `BONEPD_BENCH_VOXELS` sets the edge (default 160: about
//! 1e6 sites and elements); words choose cases (`-- plump "sc firm"`).

#![allow(missing_docs, reason = "a bench is no interface")]

mod specimen;

use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::apparent::discretisation::Prepared;
use bonepd_ct::pipeline::apparent::job::Job;
use bonepd_ct::pipeline::apparent::solve_lattice;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::apparent::solved::Solved;
use bonepd_ct::pipeline::apparent::tissue::Tissue;
use bonepd_ct::pipeline::apparent::{of_lattice, of_voxels};
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure};
use bonepd_ct::volume::Specimen;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

static NOW: AtomicUsize = AtomicUsize::new(0);
static HIGHEST: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator, counting.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

impl Counting {
    fn add(bytes: usize) {
        HIGHEST.fetch_max(NOW.fetch_add(bytes, Relaxed) + bytes, Relaxed);
    }
}

// SAFETY: everything is handed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Counting::add(layout.size());
        // SAFETY: the caller keeps the contract of `GlobalAlloc`, which is that of the system's allocator.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Counting::add(layout.size());
        // SAFETY: the caller keeps the contract of `GlobalAlloc`, which is that of the system's allocator.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`, which is that of the system's allocator.
        unsafe { System.dealloc(p, layout) }
    }
    unsafe fn realloc(&self, p: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        Counting::add(size);
        NOW.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller keeps the contract of `GlobalAlloc`, which is that of the system's allocator.
        unsafe { System.realloc(p, layout, size) }
    }
}

/// What `f` yields, and the most bytes alive at a time beyond those before.
fn highest<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = NOW.load(Relaxed);
    HIGHEST.store(before, Relaxed);
    let made = f();
    (made, HIGHEST.load(Relaxed) - before)
}

fn main() {
    let words: Vec<String> = std::env::args()
        .skip(1)
        .filter(|w| !w.starts_with('-'))
        .collect();
    let n = specimen::edge(160);
    for (name, wave, solid) in [("plump", 40.0, 0.25), ("thin", 20.0, 0.12)] {
        let bone = specimen::waves(n, wave, solid);
        let params = SolveParams::default();
        let report = |model: &str, solve: &dyn Fn() -> Solved, predicted: &dyn Fn() -> f64| {
            let named = format!("{name} {model}");
            if !words.iter().all(|w| named.contains(w.as_str())) {
                return;
            }
            let (solved, bytes) = highest(solve);
            println!(
                "{name:<6} {model:<22} {:>9} sites or elements  {:>8.1} MiB  {:>6.1} bytes each, predicted {:>6.1}  {:>3} iterations",
                solved.sites,
                bytes as f64 / f64::from(1 << 20),
                bytes as f64 / solved.sites as f64,
                predicted() / solved.sites as f64,
                solved.iterations
            );
        };
        for (structure, boundary) in [
            (Structure::Sc, Boundary::Floppy),
            (Structure::Sc, Boundary::Firm),
            (Structure::Bcc, Boundary::Floppy),
            (Structure::Bcc, Boundary::Firm),
            (Structure::Fcc, Boundary::Floppy),
            (Structure::Sc, Boundary::Connected),
        ] {
            let lp_mm = match (structure, boundary) {
                (Structure::Bcc, _) => 0.02 * 2f64.cbrt(),
                (_, Boundary::Firm | Boundary::Connected) => 0.03,
                _ => 0.02,
            };
            let case = Case {
                structure,
                lp_mm,
                boundary,
                registration_mm: [0.0; 3],
            };
            report(
                &format!("lattice {} {}", structure.name(), boundary.name()),
                &|| solve_lattice(&bone, &case, &params, |_| ()).expect("a lattice that fits"),
                &|| predicted(&of_lattice(case), &bone, &params),
            );
        }
        report(
            "voxel-fe",
            &|| solve_voxels(&bone, &params, |_| ()).expect("a mesh that fits"),
            &|| predicted(&of_voxels(), &bone, &params),
        );
    }
}

fn predicted(job: &Job, specimen: &Specimen, params: &SolveParams) -> f64 {
    let tissue = &Tissue::of(specimen, params).expect("one solid");
    let prepared = Prepared { specimen, tissue };
    let cost = job
        .counted_cost(prepared, params)
        .expect("a model that fits");
    cost.bytes[1]
}
