//! What a modulus is worth when its solve is stopped at a residual: a textbook solver on the real stack, beside the
//! converged value. `cargo test --release stopped -- --ignored --nocapture`

use crate::segment::shared_stack;
use bonepd_ct::grid::Axis;
use bonepd_ct::mask::resample;
use bonepd_ct::operator::Operator;
use bonepd_ct::operator::Preconditioner;
use bonepd_ct::operator::held::{Constrained, Held};
use bonepd_ct::par::dot;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::solve::jacobi::Jacobi;
use bonepd_ct::stage::solve::voxel_fe::solve_voxels;
use bonepd_ct::stage::solve::{Ends, SolveParams};
use bonepd_ct::topology::voxels::{Planes, VoxelMesh};
use bonepd_ct::volume::{Specimen, Volume};
use rayon::prelude::*;

type Field = Vec<[f64; 3]>;

/// The real stack as it is segmented for the reference values.
pub fn stack() -> Option<Specimen> {
    let path = shared_stack()?;
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let flags = ["--spacing", "0.0195", "--gaussian", "1", "--lower", "63"];
    let args = [&["segment", path.to_str().unwrap(), "-o", out], &flags[..]].concat();
    assert_eq!(crate::cli::run(&args).0, 0);
    Some(bonepd_ct::run::segment::load(dir.path()).unwrap())
}

/// Two voxels along every axis become one, bone where at least half of them are.
pub fn halved(specimen: &Specimen) -> Specimen {
    let fractions = resample::coarsen(&specimen.bone, 2);
    let voxels = fractions
        .as_slice()
        .iter()
        .map(|f| u8::from(*f > 0.499))
        .collect();
    Specimen {
        bone: Volume::from_vec(fractions.grid, voxels),
        ..specimen.clone()
    }
}

fn add(y: &mut Field, factor: f64, x: &Field) {
    y.par_iter_mut()
        .with_min_len(4096)
        .zip(x)
        .for_each(|(y, x)| (0..3).for_each(|c| y[c] += factor * x[c]));
}

/// Conjugate gradients with the diagonal, from rest, as every textbook has them; what a stop would have given is
/// printed on the way.
fn textbook(specimen: &Specimen, ends: Ends, most: usize) {
    let grid = specimen.bone.grid;
    let grips = Planes::within(&grid, Axis::Z, 0.0).unwrap();
    let mesh = VoxelMesh::new(grid, specimen.bone.as_slice(), |b| *b != 0, grips).unwrap();
    println!("{} elements, {} nodes", mesh.elements, mesh.nodes());
    let length = grid.size_mm()[2];
    let area = specimen.area_mm2(Axis::Z);
    let mut held = Held::none(mesh.len());
    let mut u = vec![[0.0; 3]; mesh.len()];
    let mut top = vec![false; mesh.len()];
    for i in 0..mesh.len() {
        let z = mesh.indices(i)[2] as usize;
        let exists = mesh.around[i] != 0;
        let end = z == 0 || z == grid.n[2];
        for c in 0..3 {
            if !exists || end && (c == 2 || ends == Ends::Bonded) {
                held.hold(i, c);
            }
        }
        top[i] = exists && z == grid.n[2];
        if top[i] {
            u[i][2] = length; // strain 1
        }
    }
    let op = Hex8::new(mesh, 1000.0, 0.3, Integration::Full);
    let free = Constrained {
        inner: &op,
        held: &held,
    };
    let jacobi = Jacobi::new(&free);
    let n = op.sites();
    let (mut r, mut z, mut q) = (vec![[0.0; 3]; n], vec![[0.0; 3]; n], vec![[0.0; 3]; n]);
    let modulus = |u: &Field, f: &mut Field| {
        op.apply(u, f);
        let reaction: f64 = (0..n).filter(|&i| top[i]).map(|i| f[i][2]).sum();
        (dot(u, f) / (length * area), reaction / area)
    };
    free.apply(&u, &mut r);
    r.iter_mut().for_each(|r| *r = r.map(|v| -v));
    let start = dot(&r, &r).sqrt();
    jacobi.apply(&r, &mut z);
    let start_z = dot(&r, &z).sqrt();
    let mut p = z.clone();
    let mut rz = dot(&r, &z);
    let mut next = 1e-2;
    for k in 1..=most {
        free.apply(&p, &mut q);
        let alpha = rz / dot(&p, &q);
        add(&mut u, alpha, &p);
        add(&mut r, -alpha, &q);
        jacobi.apply(&r, &mut z);
        let new = dot(&r, &z);
        let beta = new / rz;
        rz = new;
        p.par_iter_mut()
            .with_min_len(4096)
            .zip(&z)
            .for_each(|(p, z)| (0..3).for_each(|c| p[c] = z[c] + beta * p[c]));
        let residual = dot(&r, &r).sqrt() / start;
        if residual < next || [1677, 4745].contains(&k) || k % 500 == 0 {
            let (energy, reaction) = modulus(&u, &mut q);
            println!(
                "{k:6} |r|/|r0| {residual:.2e} scaled {:.2e} energy {energy:.4} reaction {reaction:.4} MPa",
                rz.sqrt() / start_z
            );
            if residual < next {
                next /= 10f64.sqrt();
            }
        }
        if residual < 1e-8 {
            break;
        }
    }
}

#[test]
#[ignore = "minutes"]
fn stopped_at_a_residual() {
    let Some(full) = stack() else { return };
    let half = halved(&full);
    for ends in [Ends::Bonded, Ends::Free] {
        let params = SolveParams {
            ends,
            tolerance: 1e-9,
            ..SolveParams::default()
        };
        println!(
            "{ends:?}: {:?}",
            solve_voxels(&half, &params, |_| ()).unwrap().moduli
        );
        textbook(&half, ends, 4000);
    }
}

#[test]
#[ignore = "minutes"]
fn stopped_full() {
    let Some(full) = stack() else { return };
    textbook(&full, Ends::Free, 9000);
}
