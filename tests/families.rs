//! Solves that follow one another: one preconditioner serves them while the operator changes little.

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::held::Held;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::solver::amg::{Amg, AmgParams};
use bonepd_ct::solver::cg::fallback::minimise_or_fall_back;
use bonepd_ct::solver::cg::{CgInfo, CgParams, ENERGY_ALONE};

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
    #[allow(clippy::needless_range_loop)] // The mesh is asked by number too.
    for node in 0..mesh.len() {
        let z = mesh.indices(node)[2] as usize;
        let exists = mesh.around[node] != 0;
        if !exists || z == 0 || z == N {
            (0..3).for_each(|c| held.hold(node, c));
        }
        if exists {
            u[node][2] = -0.008 * z as f64 / N as f64;
        }
    }
    (held, u)
}

fn solved(
    operator: &Heterogeneous,
    held: &Held,
    amg: &Amg<Heterogeneous>,
    u: &mut [[f64; 3]],
) -> CgInfo {
    let params = CgParams::default();
    minimise_or_fall_back(operator, held, amg, u, &params, ENERGY_ALONE, |_| ())
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
