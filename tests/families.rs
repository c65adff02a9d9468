//! Solves that follow one another: one preconditioner serves them while the operator changes little, and what it has in common under
//! several supports is made once.

use crate::hard::bodies;
use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::SinglePreconditioner;
use bonepd_ct::operator::held::Held;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::physics::material::Law;
use bonepd_ct::pipeline::apparent::{Ends, Load, SolveParams, of_voxels};
use bonepd_ct::solver::amg::supports::Common;
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::cg::fallback::minimise_or_fall_back;
use bonepd_ct::solver::cg::{CgInfo, CgParams, ENERGY_ALONE};
use bonepd_ct::volume::{Specimen, Volume};

const N: usize = 40;
const SOLVES: i32 = 20;

/// Struts of 4 × 4 voxels on a grid of cells of 10.
fn mesh() -> VoxelMesh {
    let grid = Grid::new([N; 3], [0.02; 3]);
    let thin = |v: usize| v % 10 < 4;
    let bone: Vec<bool> = (0..grid.len())
        .map(|i| [i % N, i / N % N, i / (N * N)])
        .map(|p| (0..3).any(|a| thin(p[(a + 1) % 3]) && thin(p[(a + 2) % 3])))
        .collect();
    let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
    VoxelMesh::new(grid, &bone, |b| *b, grips).unwrap()
}

/// Elements of a block, 2 % of all, at 0.9 of their modulus of the solve before.
fn weakened(mesh: &VoxelMesh, solve: i32) -> Heterogeneous {
    let factor = |e: usize| {
        let p = [e % N, e / N % N, e / (N * N)];
        let inside = p[0] < 14 && p[1] < 14 && (14..25).contains(&p[2]);
        if inside { 0.9f32.powi(solve) } else { 1.0 }
    };
    Heterogeneous::new(mesh.clone(), 1000.0, 0.3, Integration::Full, factor)
}

/// Bonded ends that come nearer.
fn supports(mesh: &VoxelMesh) -> (Held, Vec<[f64; 3]>) {
    let mut held = Held::none(mesh.len());
    let mut u = vec![[0.0; 3]; mesh.len()];
    let top = mesh.grid.n[2];
    #[allow(clippy::needless_range_loop)] // The mesh is asked by number too.
    for node in 0..mesh.len() {
        let z = mesh.indices(node)[2] as usize;
        let exists = mesh.around[node] != 0;
        if !exists || z == 0 || z == top {
            (0..3).for_each(|c| held.hold(node, c));
        }
        if exists {
            u[node][2] = -0.008 * z as f64 / top as f64;
        }
    }
    (held, u)
}

fn solved(
    operator: &Heterogeneous,
    held: &Held,
    amg: &Amg<&Heterogeneous>,
    u: &mut [[f64; 3]],
) -> CgInfo {
    let params = CgParams::default();
    minimise_or_fall_back(operator, held, amg, u, &params, ENERGY_ALONE, |_| ())
}

/// A solve may take as many iterations as the first one, twice, before multigrid is made again.
const STALE: usize = 2;

/// Solves one after the other, each from the solution before, with the multigrid of the first until iterations double. `least`: by which
/// factor an element's stiffness falls at most from solve to solve. Returns what each came to, and how often multigrid was made.
fn in_sequence(
    steps: &[Heterogeneous],
    (held, start): (&Held, &[[f64; 3]]),
    least: f64,
    energy_tolerance: f64,
) -> (Vec<CgInfo>, usize) {
    let of = AmgParams {
        cycles: 2,
        ..AmgParams::new(steps[0].mesh().grid.spacing_mm)
    };
    let mut u = start.to_vec();
    let mut amg = Amg::new(&steps[0], held, &of);
    let (mut made, mut fresh, mut known) = (1, None, None);
    let mut infos: Vec<CgInfo> = Vec::new();
    for operator in steps {
        let last = infos.last().map_or(0, |info| info.iterations);
        if fresh.is_some_and(|fresh| last > STALE * fresh) {
            amg = Amg::new(operator, held, &of);
            (made, fresh, known) = (made + 1, None, None);
        }
        let params = CgParams {
            energy_tolerance,
            known_eigenvalue: known,
            ..CgParams::default()
        };
        let info =
            minimise_or_fall_back(operator, held, &amg, &mut u, &params, ENERGY_ALONE, |_| ());
        fresh = fresh.or(Some(info.iterations));
        known = info.eigenvalue.map(|v| least * v);
        infos.push(info);
    }
    (infos, made)
}

/// Twenty solves of one body, a block of which weakens, take less than half of the iterations of as many alone, and each is within what it
/// states.
#[test]
fn a_body_that_weakens_takes_few_iterations_a_solve() {
    let mesh = mesh();
    let steps: Vec<Heterogeneous> = (0..SOLVES).map(|s| weakened(&mesh, s)).collect();
    let (held, start) = supports(&mesh);
    let (found, made) = in_sequence(&steps, (&held, &start), 0.9, 1e-3);
    let all: Vec<usize> = found.iter().map(|info| info.iterations).collect();
    println!("{all:?}, multigrid made {made} times");
    for (operator, info) in steps.iter().zip(&found) {
        let (exact, _) = in_sequence(std::slice::from_ref(operator), (&held, &start), 1.0, 1e-9);
        assert!(info.ended.converged(), "{info:?}");
        let off = info.energy - exact[0].energy;
        assert!(
            off >= -1e-8 * info.energy && off <= info.energy_error,
            "{off} {info:?}"
        );
        assert!(info.energy_error <= 1e-3 * info.energy, "{info:?}");
    }
    // Without what the solve before knew each takes five.
    assert!(
        2 * all.iter().sum::<usize>() < SOLVES as usize * all[0] && made == 1,
        "{all:?}"
    );
}

/// What an earlier solve knows is no bound. Bodies whose soft motions are found late, some elements of which weaken from solve to solve.
#[test]
fn hard_bodies_that_weaken_state_their_error() {
    let made = [
        bodies::cut_wires(37, 1e2),
        bodies::cut_wires(23, 3e3),
        bodies::random_labels(37, 1e3, 0.4, 2),
        bodies::c_frame(27),
        bodies::necks(17, false),
        bodies::diagonal_neck(29),
        bodies::diagonal_neck(139),
        bodies::serpentine(63),
        bodies::sparse(42),
        bodies::broken_foam(65),
        bodies::broken_foam(186),
    ];
    let mut worst: f64 = 0.0;
    for (body, share) in made.iter().flat_map(|body| [(body, 50), (body, 7)]) {
        let grid = body.specimen.bone.grid;
        let bone = body.specimen.bone.as_slice();
        let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
        let mesh = VoxelMesh::new(grid, bone, |b| *b != 0, grips).unwrap();
        let contrast = match &body.params.material {
            Some(material) => match &material.law {
                Law::Labels(labels) => labels[1].young_mpa as f32,
                _ => unreachable!("hard bodies have labels"),
            },
            None => 1.0,
        };
        let grey = body.specimen.grey.as_ref().map(|grey| grey.as_slice());
        let modulus = |e: usize| {
            if grey.is_some_and(|g| g[e] == 2.0) {
                contrast
            } else {
                1.0
            }
        };
        // A share of the elements, scattered, at 0.9 of the solve before.
        let weak = |e: usize| e.wrapping_mul(2_654_435_761) >> 7 & 0xffff < 0x10000 / share;
        let steps: Vec<Heterogeneous> = (0..6)
            .map(|s| {
                let factor = |e: usize| modulus(e) * if weak(e) { 0.9f32.powi(s) } else { 1.0 };
                Heterogeneous::new(mesh.clone(), 1.0, 0.3, Integration::Full, factor)
            })
            .collect();
        let (held, start) = supports(&mesh);
        for tolerance in [1e-2, 1e-3, 1e-4] {
            let (found, _) = in_sequence(&steps, (&held, &start), 0.9, tolerance);
            for (s, (operator, info)) in steps.iter().zip(&found).enumerate() {
                let alone = std::slice::from_ref(operator);
                let (exact, _) = in_sequence(alone, (&held, &start), 1.0, 1e-10);
                let off = (info.energy - exact[0].energy) / info.energy;
                let stated = info.energy_error / info.energy;
                worst = worst.max((off - 1e-8) / stated);
                assert!(info.ended.converged() && stated <= tolerance, "{info:?}");
                assert!(
                    off <= 1.5 * stated + 1e-8,
                    "{} at {tolerance:.0e}, solve {s}: off by {off:.2e}, stated {stated:.2e}, {} iterations",
                    body.name,
                    info.iterations
                );
            }
        }
    }
    println!("true over stated error: {worst:.2} at most");
}

/// Supports of one body of equal elements, each of which leaves every node a free component: aggregates are the same, and so is multigrid.
#[test]
fn multigrid_of_several_supports_is_that_of_each() {
    let mesh = mesh();
    let operator = Hex8::new(mesh.clone(), 1000.0, 0.3, Integration::Full);
    let sliding = |axis: usize, components: &[usize]| {
        let mut held = Held::none(mesh.len());
        for node in 0..mesh.len() {
            let at = mesh.indices(node).map(|i| i as usize);
            // A body that may move without strain has no one solution.
            if mesh.around[node] == 0 || at[2] == 0 {
                (0..3).for_each(|c| held.hold(node, c));
            } else if at[axis] == N {
                components.iter().for_each(|c| held.hold(node, *c));
            }
        }
        held
    };
    let supports = [sliding(2, &[2]), sliding(2, &[0, 1]), sliding(0, &[0])];
    let of = AmgParams::new(mesh.grid.spacing_mm);
    let common = Common::new(&operator, &supports, &of);
    let force: Vec<[f32; 3]> = (0..mesh.len())
        .map(|i| [0, 1, 2].map(|c| ((7 * i + c) % 11) as f32 - 5.0))
        .collect();
    for held in &supports {
        let mut force = force.clone();
        for (node, f) in force.iter_mut().enumerate() {
            (0..3)
                .filter(|&c| held.is_held(node, c))
                .for_each(|c| f[c] = 0.0);
        }
        let [ours, own] = [common.under(held), Amg::new(&operator, held, &of)].map(|amg| {
            let (mut z, mut spare) = (vec![[0.0; 3]; mesh.len()], vec![[0.0; 3]; mesh.len()]);
            amg.apply_single(&force, &mut z, &mut spare);
            z
        });
        let squared = |of: &dyn Fn(usize, usize) -> f32| {
            let all =
                (0..mesh.len()).flat_map(|i| (0..3).map(move |c| f64::from(of(i, c)).powi(2)));
            all.sum::<f64>().sqrt()
        };
        let apart = squared(&|i, c| ours[i][c] - own[i][c]) / squared(&|i, c| own[i][c]);
        // Sums in another order, in single precision.
        assert!(apart < 1e-4, "{apart}");
    }
}

#[test]
fn the_first_preconditioner_serves_twenty_solves_of_a_body_that_weakens() {
    let mesh = mesh();
    let steps: Vec<Heterogeneous> = (0..SOLVES).map(|s| weakened(&mesh, s)).collect();
    let (held, start) = supports(&mesh);
    let of = AmgParams::new(mesh.grid.spacing_mm);
    let first = Amg::new(&steps[0], &held, &of);
    let (mut u, mut iterations, mut afresh) = (start.clone(), 0, 0);
    for operator in &steps {
        let info = solved(operator, &held, &first, &mut u);
        let other = solved(
            operator,
            &held,
            &Amg::new(operator, &held, &of),
            &mut start.clone(),
        );
        assert!(info.ended.converged() && other.ended.converged());
        // Each to 0.1 %, and never below the minimum.
        let both = info.energy_error.max(other.energy_error);
        assert!(
            (info.energy - other.energy).abs() <= both,
            "{info:?} {other:?}"
        );
        iterations += info.iterations;
        afresh += other.iterations;
    }
    println!("{iterations} iterations, {afresh} afresh");
    assert!(iterations <= afresh, "{iterations} {afresh}");
}

/// Loads on the same elements share them and, where the same is held, multigrid. Nothing of it shows in what they come to.
#[test]
fn loads_in_a_family_come_to_what_each_comes_to_alone() {
    let mesh = mesh();
    let bone = (0..mesh.grid.len()).map(|i| [i % N, i / N % N, i / (N * N)]);
    let thin = |v: usize| v % 10 < 4;
    let bone = bone.map(|p| (0..3).any(|a| thin(p[(a + 1) % 3]) && thin(p[(a + 2) % 3])));
    let specimen = Specimen {
        name: "struts".into(),
        bone: Volume::from_vec(mesh.grid, bone.map(u8::from).collect()),
        tv_mm3: mesh.grid.size_mm().iter().product(),
        tv_definition: "box".into(),
        grey: None,
        threshold: None,
    };
    let family = of_voxels().of_a_family();
    let free = SolveParams {
        coarsen: 2,
        ..SolveParams::default()
    };
    let bonded = SolveParams {
        ends: Ends::Bonded,
        ..free.clone()
    };
    let shear = |load| SolveParams {
        load,
        ..bonded.clone()
    };
    let finer = SolveParams {
        coarsen: 1,
        ..free.clone()
    };
    for params in [
        bonded.clone(),
        shear(Load::ShearX),
        shear(Load::BendingY),
        shear(Load::Torsion),
        free,
        finer,
    ] {
        let [ours, alone] = [&family, &of_voxels()].map(|job| {
            let result = job.solve_specimen(&specimen, &params, &mut |_, _| ());
            result.unwrap().modulus().unwrap().0
        });
        assert_eq!(format!("{ours:?}"), format!("{alone:?}"));
        assert!(ours.work.relative_error < 1e-3 && ours.iterations > 0);
    }
}
