//! Bodies of voxel elements that yield, against closed forms and against themselves.

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::held::Held;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::physics::hex8::plastic::points::Points;
use bonepd_ct::physics::hex8::plastic::{PlasticBricks, Tissue};
use bonepd_ct::physics::plasticity::{DruckerPrager, Elastic, VonMises, YieldLaw};
use bonepd_ct::pipeline::apparent::discretisation::steps::{
    History, Loading, Outcome, Step, Stepping, load,
};
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::load_step::StepParams;

type Field = Vec<[f64; 3]>;

/// A meshed body with its supports and its load.
pub struct Body {
    pub mesh: VoxelMesh,
    pub held: Held,
    /// Displacements of the supports, and a first guess, under the whole load.
    ends: Field,
    forces: Option<Field>,
    pub young: f64,
    pub poisson: f64,
}

fn mesh(n: [usize; 3], h: f64, inside: impl Fn([usize; 3]) -> bool) -> VoxelMesh {
    let grid = Grid::new(n, [h; 3]);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let bone: Vec<u8> = (0..grid.len()).map(|i| u8::from(inside(at(i)))).collect();
    VoxelMesh::at_faces(grid, &bone, |b| *b != 0).unwrap()
}

impl Body {
    /// Supports are `hold`, by node indices and component.
    fn new(mesh: VoxelMesh, hold: impl Fn([usize; 3], usize) -> bool) -> Body {
        let mut held = Held::none(mesh.len());
        for node in 0..mesh.len() {
            let at = mesh.indices(node).map(|v| v as usize);
            for c in 0..3 {
                if mesh.around[node] == 0 || hold(at, c) {
                    held.hold(node, c);
                }
            }
        }
        Body {
            ends: vec![[0.0; 3]; mesh.len()],
            mesh,
            held,
            forces: None,
            young: 10_000.0,
            poisson: 0.3,
        }
    }

    /// A block compressed along z by `strain`; its ends slide, or are bonded.
    pub fn block(mesh: VoxelMesh, strain: f64, bonded: bool) -> Body {
        let n = mesh.grid.n;
        let mut body = Body::new(mesh, |at, c| {
            let end = at[2] == 0 || at[2] == n[2];
            match bonded {
                true => end,
                // Sliding ends, and planes of symmetry at x = 0 and y = 0.
                false => (c == 2 && end) || (c < 2 && at[c] == 0),
            }
        });
        for node in 0..body.mesh.len() {
            body.ends[node][2] = strain * body.mesh.position(node)[2];
        }
        body
    }

    pub fn stepping(steps: usize) -> Stepping {
        Stepping {
            steps,
            halvings: 6,
            params: StepParams {
                tolerance: 1e-10,
                max_iterations: 25,
                max_cg_iterations: 2000,
            },
        }
    }

    fn load(&self, law: YieldLaw, how: &Stepping) -> (Outcome, History) {
        self.load_with(law, how, true)
    }

    /// `is_mean` chooses mean dilatation; full integration otherwise.
    pub fn load_with(&self, law: YieldLaw, how: &Stepping, is_mean: bool) -> (Outcome, History) {
        let rule = match is_mean {
            true => Integration::MeanDilatation,
            false => Integration::Full,
        };
        let bricks = Hex8::new(self.mesh.clone(), self.young, self.poisson, rule);
        let tissue = Tissue {
            elastic: Elastic::of(self.young, self.poisson),
            law,
        };
        let h = self.mesh.grid.spacing_mm;
        let body = PlasticBricks::new(&bricks, &self.mesh, Points::new(h, is_mean), |_| tissue);
        let multigrid = Amg::new(&bricks, &self.held, &AmgParams::new(h));
        let mut history = History::new(self.mesh.len());
        let loading = Loading {
            held: &self.held,
            elastic: &self.ends,
            external: self.forces.as_deref(),
        };
        let outcome = load(body, &loading, &multigrid, how, &mut history, |_| true);
        (outcome, history)
    }

    /// Apparent stress of a block under `strain` at the end of a step.
    fn stress(&self, step: &Step, strain: f64) -> f64 {
        let [x, y, z] = self.mesh.grid.size_mm();
        step.conjugate_nmm / (strain * x * y * z)
    }
}

pub fn von_mises(yield_mpa: f64, hardening_mpa: f64) -> YieldLaw {
    YieldLaw::VonMises(VonMises {
        yield_mpa,
        hardening_mpa,
    })
}

fn asymmetric(tension_mpa: f64, compression_mpa: f64) -> YieldLaw {
    YieldLaw::Asymmetric(DruckerPrager {
        tension_mpa,
        compression_mpa,
        hardening_mpa: 0.0,
    })
}

/// Struts of two voxels on a grid of cells of six.
pub fn frame(n: usize) -> VoxelMesh {
    mesh([n; 3], 0.02, |p| {
        let thin = p.map(|v| v % 6 < 2);
        (0..3).filter(|a| thin[*a]).count() >= 2
    })
}

fn assert_balanced(steps: &[Step]) {
    for s in steps {
        let off = (s.elastic_nmm + s.dissipated_nmm) / s.work_nmm - 1.0;
        assert!(off.abs() < 1e-6, "{s:?}: off by {off:e}");
    }
    let growing = steps
        .windows(2)
        .all(|w| w[1].dissipated_nmm >= w[0].dissipated_nmm);
    assert!(growing, "{steps:?}");
}

#[test]
fn a_bar_flows_at_its_yield_stress() {
    for (strain, law, expected) in [
        (-0.02, von_mises(68.0, 0.0), 68.0),
        (0.02, asymmetric(50.0, 75.0), 50.0),
        (-0.02, asymmetric(50.0, 75.0), 75.0),
    ] {
        let bar = Body::block(mesh([4, 3, 5], 0.02, |_| true), strain, false);
        let (outcome, history) = bar.load(law, &Body::stepping(8));
        assert_eq!(outcome, Outcome::Done);
        let last = bar.stress(history.steps.last().unwrap(), strain).abs();
        assert!((last / expected - 1.0).abs() < 1e-6, "{law:?}: {last}");
        assert_balanced(&history.steps);
    }
}

/// Sides held: yield where the difference of the stresses is σ_y, then the slope is the bulk modulus.
#[test]
fn a_confined_bar_goes_on_with_its_bulk_modulus() {
    let n = [4, 4, 4];
    let strain = -0.03;
    let mut bar = Body::new(mesh(n, 0.02, |_| true), |at, c| at[c] == 0 || at[c] == n[c]);
    for node in 0..bar.mesh.len() {
        bar.ends[node][2] = strain * bar.mesh.position(node)[2];
    }
    let (_, history) = bar.load(von_mises(68.0, 0.0), &Body::stepping(6));
    let elastic = Elastic::of(bar.young, bar.poisson);
    let last = bar.stress(history.steps.last().unwrap(), strain);
    let expected = elastic.bulk_mpa * strain - 2.0 / 3.0 * 68.0;
    assert!((last / expected - 1.0).abs() < 1e-6, "{last} {expected}");
    assert_balanced(&history.steps);
}

#[test]
fn a_hardening_bar_has_the_slope_of_its_tissue() {
    let strain = 0.02;
    let bar = Body::block(mesh([3, 3, 4], 0.02, |_| true), strain, false);
    let (_, history) = bar.load(von_mises(68.0, 500.0), &Body::stepping(10));
    let stress = |k: usize| bar.stress(&history.steps[k], strain);
    let slope = (stress(9) - stress(5)) / (0.4 * strain);
    assert!(
        (slope / (1e4 * 500.0 / 10_500.0) - 1.0).abs() < 1e-5,
        "{slope}"
    );
}

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

/// One strut of one voxel, bent by its bonded ends; near-incompressible tissue; one element 1e4 times as soft in two.
#[test]
fn hard_bodies_reach_the_whole_load_and_balance() {
    let strut = mesh([9, 3, 12], 0.02, |[x, y, z]| {
        y == 1 && (x == z / 2 + 1 || z < 2 || z > 9)
    });
    let body = Body::block(strut, -0.02, true);
    let (outcome, history) = body.load(von_mises(68.0, 0.0), &Body::stepping(10));
    assert_eq!(outcome, Outcome::Done);
    assert_balanced(&history.steps);
    let near = Body {
        poisson: 0.49,
        ..Body::block(frame(14), -0.02, true)
    };
    let (outcome, history) = near.load(von_mises(68.0, 0.0), &Body::stepping(10));
    assert_eq!(outcome, Outcome::Done);
    assert_balanced(&history.steps);
    let stiff = Body::block(mesh([6, 6, 6], 0.02, |_| true), -0.02, true);
    let (outcome, history) = two_phases(&stiff);
    assert_eq!(outcome, Outcome::Done);
    assert_balanced(&history.steps);
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

/// The cantilever of Faim's manual: 100 × 0.5 × 10 mm, perfect at 120 MPa, F_y = 10 N.
fn cantilever(force_n: f64) -> (Outcome, History, Body) {
    let n = [200, 1, 20];
    let mut body = Body::new(mesh(n, 0.5, |_| true), |at, c| {
        at[0] == 0 && (c != 1 || at[2] == 0 && at[1] == 0)
    });
    (body.young, body.poisson) = (200_000.0, 0.3);
    let mut forces = vec![[0.0; 3]; body.mesh.len()];
    for (node, f) in forces.iter_mut().enumerate() {
        let at = body.mesh.indices(node);
        if body.mesh.around[node] != 0 && at[0] == 200 {
            let inner = at[2] != 0 && at[2] != 20;
            f[2] = force_n / 40.0 * if inner { 1.0 } else { 0.5 };
        }
    }
    body.forces = Some(forces);
    let mut how = Body::stepping(14);
    // Slender: the preconditioner's energy of a residual is a fifth of the true one or less.
    how.params.tolerance = 1e-14;
    let (outcome, history) = body.load(von_mises(120.0, 0.0), &how);
    (outcome, history, body)
}

fn tip_mm(body: &Body, history: &History) -> f64 {
    let face = |node: &usize| body.mesh.around[*node] != 0 && body.mesh.indices(*node)[0] == 200;
    let nodes: Vec<usize> = (0..body.mesh.len()).filter(face).collect();
    nodes.iter().map(|node| history.u[*node][2]).sum::<f64>() / nodes.len() as f64
}

/// Beam theory, or Faim's own value, whichever is nearer: within 1 %.
#[test]
fn a_cantilever_bends_as_beam_theory_says() {
    for (force_n, theory, faim) in [(10.0, 0.4, 0.4020), (14.0, 0.6188, 0.6149)] {
        let (outcome, history, body) = cantilever(force_n);
        assert_eq!(outcome, Outcome::Done, "{force_n} N");
        let tip = tip_mm(&body, &history);
        println!("{force_n} N: tip {tip} mm");
        let off = [theory, faim].map(|e: f64| (tip / e - 1.0).abs());
        assert!(off[0].min(off[1]) < 0.01, "{force_n} N: {tip} mm");
        assert_balanced(&history.steps);
    }
}

/// 15 N is the collapse load `σ_y b h² / (4 L)` itself: the tip moves without bound, by beam theory 0.889 mm when the hinge has
/// formed. Any value that a program prints there is that of its last step and mesh (Faim: 0.756 mm); steps end below or far beyond
/// the deflection at 14 N.
#[test]
fn a_cantilever_at_its_collapse_load_is_said_to_collapse() {
    let (outcome, history, body) = cantilever(15.3);
    let last = history.steps.last().unwrap();
    let tip = tip_mm(&body, &history);
    println!(
        "15.3 N: {outcome:?} at {:.3} N, tip {tip} mm, {} steps",
        15.3 * last.load,
        history.steps.len()
    );
    assert_eq!(outcome, Outcome::Stopped);
    assert!(
        (14.5..15.3).contains(&(15.3 * last.load)),
        "{}",
        15.3 * last.load
    );
    assert!(tip > 0.65, "{tip}");
}

/// A thick sphere of perfect tissue under inner pressure (Hill 1950, ch. V): with the plastic front at `c` the pressure is
/// `2 σ_y (ln(c/a) + (1 − c³/b³)/3)` and the outer surface moves by `σ_y (1 − ν) c³ / (E b²)`. One eighth, 16 voxels of wall.
#[test]
fn a_thick_sphere_under_pressure_flows_as_the_closed_form_says() {
    let (n, a, b, c, flow) = (32, 16.0, 32.0, 24.0, 68.0);
    let radius = |p: [usize; 3]| {
        p.map(|v| (v as f64 + 0.5).powi(2))
            .iter()
            .sum::<f64>()
            .sqrt()
    };
    let inside = |p: [usize; 3]| radius(p) > a && radius(p) < b;
    let mut body = Body::new(mesh([n; 3], 1.0, inside), |at, axis| at[axis] == 0);
    let pressure = 2.0 * flow * ((c / a as f64).ln() + (1.0 - (c / b as f64).powi(3)) / 3.0);
    body.forces = Some(inner_pressure(&body.mesh, pressure, |p| radius(p) <= a));
    let (outcome, history) = body.load(von_mises(flow, 0.0), &Body::stepping(6));
    assert_eq!(outcome, Outcome::Done);
    // Beyond the front: at the outer surface this is the closed form above.
    let nu = body.poisson;
    let expected = |r: f64| {
        let swell = 2.0 * (1.0 - 2.0 * nu) * r / (3.0 * b.powi(3));
        flow * c.powi(3) / body.young * (swell + (1.0 + nu) / (3.0 * r * r))
    };
    assert!(
        (expected(b) / (flow * (1.0 - nu) * c.powi(3) / (body.young * b * b)) - 1.0).abs() < 1e-12
    );
    // Nodes of the outer staircase, each at its own radius.
    let (mut sum, mut count) = (0.0, 0.0);
    for node in 0..body.mesh.len() {
        let x = body.mesh.position(node);
        let r = x.iter().map(|v| v * v).sum::<f64>().sqrt();
        if body.mesh.around[node] != 0 && r > b - 1.0 {
            sum += (0..3).map(|i| history.u[node][i] * x[i] / r).sum::<f64>() / expected(r);
            count += 1.0;
        }
    }
    let off = sum / count - 1.0;
    println!("outer displacement off by {off}");
    assert!(off.abs() < 0.05, "outer displacement off by {off}");
    assert_balanced(&history.steps);
}

/// Pressure on the faces of elements that border the cavity, a quarter to each of a face's corners.
fn inner_pressure(mesh: &VoxelMesh, pressure: f64, cavity: impl Fn([usize; 3]) -> bool) -> Field {
    let mut forces = vec![[0.0; 3]; mesh.len()];
    let numbers: std::collections::HashMap<[u32; 3], usize> = (0..mesh.len())
        .filter(|&i| mesh.around[i] != 0)
        .map(|i| (mesh.indices(i), i))
        .collect();
    for (node, element) in mesh.low_corner_elements().enumerate() {
        if element.is_none() {
            continue;
        }
        let at = mesh.indices(node).map(|v| v as usize);
        for axis in 0..3 {
            let mut below = at;
            if at[axis] == 0 {
                continue;
            }
            below[axis] -= 1;
            if !cavity(below) {
                continue;
            }
            for k in 0..4 {
                let (p, q) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut corner = at.map(|v| v as u32);
                corner[p] += k & 1;
                corner[q] += k >> 1;
                forces[numbers[&corner]][axis] += 0.25 * pressure;
            }
        }
    }
    forces
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
