//! Bodies that yield against themselves: locking, threads, a history that goes on, hard cases, steps that fail.

use super::bodies::{Body, assert_balanced, asymmetric, frame, mesh, von_mises};
use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::physics::hex8::plastic::points::Points;
use bonepd_ct::physics::hex8::plastic::{PlasticBricks, Tissue};
use bonepd_ct::physics::plasticity::Elastic;
use bonepd_ct::pipeline::apparent::discretisation::steps::{History, Loading, Outcome, Step, load};
use bonepd_ct::solver::amg::{Amg, AmgParams};

/// A bonded block that flows keeps its volume: eight dilatations an element lock it, their mean does not.
#[test]
fn mean_dilatation_does_not_lock() {
    let strain = -0.06;
    let block = Body::block(mesh([5, 5, 4], 0.02, |_| true), strain, true);
    let slope = |is_mean: bool| {
        let (outcome, history) =
            block.load_with(von_mises(68.0, 0.0), &Body::stepping(12), is_mean);
        assert_eq!(outcome, Outcome::Done);
        let stress = |k: usize| block.stress(&history.steps[k], strain);
        (stress(11) - stress(7)) / (4.0 / 12.0 * strain)
    };
    let (mean, full) = (slope(true), slope(false));
    assert!(
        mean > 0.0 && mean < 0.2 * full,
        "slopes at the limit: {mean} and {full} MPa"
    );
}

/// Element by element, all steps of a frame: same bits on any number of threads.
#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let body = Body::block(frame(20), -0.02, true);
    let solved = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| body.load(asymmetric(50.0, 75.0), &Body::stepping(4)))
    };
    let (one, three) = (solved(1), solved(3));
    assert!(one.1.steps[3].yielded_points > 100);
    assert_eq!(one.1, three.1);
    assert_balanced(&one.1.steps);
}

/// Stopped after two steps and gone on with: the same bits.
#[test]
fn a_history_goes_on_to_the_same_last_digit() {
    let body = Body::block(frame(14), -0.02, true);
    let law = von_mises(68.0, 0.0);
    let (_, whole) = body.load(law, &Body::stepping(5));
    let bricks = Hex8::new(
        body.mesh.clone(),
        body.young,
        body.poisson,
        Integration::MeanDilatation,
    );
    let h = body.mesh.grid.spacing_mm;
    let multigrid = Amg::new(&bricks, &body.held, &AmgParams::new(h));
    let elastic = Elastic::of(body.young, body.poisson);
    let loading = Loading {
        held: &body.held,
        elastic: &body.ends,
        external: None,
    };
    let mut history = History::new(body.mesh.len());
    for stop_at in [2, 99] {
        let points = Points::new(h, true);
        let tissue = |_: usize| Tissue { elastic, law };
        let again = PlasticBricks::new(&bricks, &body.mesh, points, tissue);
        let go_on = |history: &History| history.steps.len() != stop_at;
        load(
            again,
            &loading,
            &multigrid,
            &Body::stepping(5),
            &mut history,
            go_on,
        );
    }
    assert_eq!(history, whole);
}

/// The table of `reports/stability.md`: each case reaches the whole load, with energies balanced at every step.
#[test]
fn hard_bodies_reach_the_whole_load_and_balance() {
    let strut = mesh([9, 3, 12], 0.02, |[x, y, z]| {
        y == 1 && (x == z / 2 + 1 || !(2..=9).contains(&z))
    });
    let strut = Body::block(strut, -0.02, true);
    let near = |poisson: f64| Body {
        poisson,
        ..Body::block(frame(14), -0.02, true)
    };
    let block = Body::block(mesh([6, 6, 6], 0.02, |_| true), -0.02, true);
    let (law, how) = (von_mises(68.0, 0.0), Body::stepping(10));
    for (case, (outcome, history)) in [
        ("bent strut one voxel thick", strut.load(law, &how)),
        ("frame, ν 0.49", near(0.49).load(law, &how)),
        ("frame, ν 0.4999", near(0.4999).load(law, &how)),
        ("columns, contrast 1e4", two_phases(&block)),
    ] {
        assert_eq!(outcome, Outcome::Done, "{case}");
        let sum = |of: fn(&Step) -> usize| history.steps.iter().map(of).sum::<usize>();
        let off = |s: &Step| ((s.elastic_nmm + s.dissipated_nmm) / s.work_nmm - 1.0).abs();
        println!(
            "| {case} | {} | {} | {} | {} | {:.1e} |",
            history.steps.len(),
            sum(|s| s.cuts as usize),
            sum(|s| s.newton_iterations),
            sum(|s| s.iterations),
            history.steps.iter().map(off).fold(0.0, f64::max)
        );
        assert_balanced(&history.steps);
    }
}

/// Columns of stiff and of 1e4 times as soft elements.
fn two_phases(body: &Body) -> (Outcome, History) {
    let soft = |e: usize| (e % 6 + e / 6 % 6).is_multiple_of(3);
    let factor = |e: usize| if soft(e) { 1e-4 } else { 1.0 };
    let rule = Integration::MeanDilatation;
    let bricks = Heterogeneous::new(body.mesh.clone(), body.young, body.poisson, rule, factor);
    let law = von_mises(68.0, 0.0);
    let tissue = |node: usize| Tissue {
        elastic: Elastic::of(
            body.young * f64::from(bricks.stiffness_of(node).0),
            body.poisson,
        ),
        law,
    };
    let h = body.mesh.grid.spacing_mm;
    let yielding = PlasticBricks::new(&bricks, &body.mesh, Points::new(h, true), tissue);
    let multigrid = Amg::new(&bricks, &body.held, &AmgParams::new(h));
    let mut history = History::new(body.mesh.len());
    let loading = Loading {
        held: &body.held,
        elastic: &body.ends,
        external: None,
    };
    let how = Body::stepping(6);
    let outcome = load(yielding, &loading, &multigrid, &how, &mut history, |_| true);
    (outcome, history)
}

/// With five iterations a step of the whole load fails; halved, it ends near where small steps do.
#[test]
fn a_step_that_fails_is_halved() {
    let body = Body::block(frame(14), -0.02, true);
    let law = von_mises(68.0, 500.0);
    let mut few = Body::stepping(1);
    few.params.max_iterations = 5;
    let (outcome, cut) = body.load(law, &few);
    assert_eq!(outcome, Outcome::Done);
    assert!(
        cut.steps.iter().map(|s| s.cuts).sum::<u32>() > 0,
        "{:?}",
        cut.steps
    );
    let (_, even) = body.load(law, &Body::stepping(16));
    let last = |h: &History| h.steps.last().unwrap().conjugate_nmm;
    // Flow depends on the path, so steps of unlike length differ by a little.
    let off = last(&cut) / last(&even) - 1.0;
    assert!(off.abs() < 0.02, "{off}");
}

/// Planes that grips lie in exist: the mesh of a block is one piece.
#[test]
fn a_specimen_that_is_split_is_no_body() {
    let grid = Grid::new([4, 4, 6], [0.02; 3]);
    let bone: Vec<u8> = (0..grid.len()).map(|i| u8::from(i / 16 != 3)).collect();
    let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
    assert!(
        VoxelMesh::new(grid, &bone, |b| *b != 0, grips)
            .unwrap()
            .is_empty()
    );
}
