//! The table of three-dimensional models, and the laws every one of them must obey. A new physics is one row.

use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::Operator;
use bonepd_ct::operator::held::{Constrained, Held};
use bonepd_ct::par::dot;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::{Integration, stiffness};
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::physics::lattice::connected::ConnectedLattice;
use bonepd_ct::physics::lattice::{Lattice, Moduli};
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure, build, build_connected};
use bonepd_ct::solver::cg::jacobi::Jacobi;
use bonepd_ct::solver::cg::{CgParams, ENERGY_ALONE, minimise};
use bonepd_ct::volume::{Specimen, Volume};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::HashMap;

type Field = Vec<[f64; 3]>;
type Energy = Box<dyn Fn(&[[f64; 3]]) -> f64>;

/// One row: a model on an irregular specimen.
struct Model {
    name: String,
    operator: Box<dyn Operator<3>>,
    positions: Field,
    energy: Energy,
}

/// A 14³ box of voxels with holes, lumps and free corners, and unequal spacing.
pub fn irregular_specimen() -> Specimen {
    let grid = Grid::new([14, 13, 12], [0.021, 0.02, 0.019]);
    let mut random = Pcg64::seed_from_u64(3);
    let solid: Vec<u8> = (0..grid.len())
        .map(|_| u8::from(random.random::<f64>() < 0.8))
        .collect();
    let tv_mm3 = grid.size_mm().iter().product();
    let bone = Volume::from_vec(grid, solid);
    Specimen {
        name: "irregular".into(),
        bone,
        tv_mm3,
        tv_definition: "box".into(),
        grey: None,
    }
}

fn lattice_row(structure: Structure, boundary: Boundary, poisson: f64) -> Model {
    let case = Case {
        structure,
        lp_mm: 0.04,
        boundary,
        registration_mm: [0.0; 3],
    };
    let sites = build(&irregular_specimen(), &case, Axis::Z, 0.0).unwrap();
    assert!(
        sites.len() > 100,
        "{structure:?} {boundary:?}: {} sites",
        sites.len()
    );
    let moduli = Moduli::new(structure, 0.04, 1000.0, poisson).unwrap();
    let positions = sites
        .indices
        .iter()
        .map(|&i| sites.frame.position_mm(i))
        .collect();
    let twin = Lattice::new(sites.clone(), moduli);
    Model {
        name: format!("{} {} ν={poisson}", structure.name(), boundary.name()),
        operator: Box::new(Lattice::new(sites, moduli)),
        positions,
        energy: Box::new(move |u| twin.energy(u)),
    }
}

/// Voxel elements, equal or graded; the energy is summed element by element from the element's matrix.
fn hex8_row(poisson: f64, rule: Integration, graded: bool) -> Model {
    let bone = irregular_specimen().bone;
    let grips = Planes::within(&bone.grid, Axis::Z, 0.0).unwrap();
    let factor = move |e: usize| if graded { 0.5 + (e % 5) as f32 } else { 1.0 };
    let mesh = VoxelMesh::new(bone.grid, bone.as_slice(), |b| *b != 0, grips).unwrap();
    let positions: Field = (0..mesh.len()).map(|i| mesh.position(i)).collect();
    let numbers: HashMap<[u32; 3], usize> = (0..mesh.len())
        .filter(|&i| mesh.around[i] != 0)
        .map(|i| (mesh.indices(i), i))
        .collect();
    let elements: Vec<([usize; 8], f64)> = mesh
        .low_corner_elements()
        .enumerate()
        .filter_map(|(node, element)| {
            let at = mesh.indices(node);
            let corner = |c: usize| numbers[&std::array::from_fn(|a| at[a] + (c as u32 >> a & 1))];
            element.map(|e| (std::array::from_fn(corner), f64::from(factor(e))))
        })
        .collect();
    let k = stiffness(bone.grid.spacing_mm, 1000.0, poisson, rule);
    let energy = move |u: &[[f64; 3]]| {
        let of = |(corners, factor): &([usize; 8], f64)| {
            let u: [f64; 24] = std::array::from_fn(|i| u[corners[i / 3]][i % 3]);
            let forces = k.map(|row| row.iter().zip(&u).map(|(a, b)| a * b).sum::<f64>());
            0.5 * factor * forces.iter().zip(&u).map(|(f, u)| f * u).sum::<f64>()
        };
        elements.iter().map(of).sum()
    };
    let operator: Box<dyn Operator<3>> = if graded {
        Box::new(Graded::new(mesh, 1000.0, poisson, rule, factor))
    } else {
        Box::new(Hex8::new(mesh, 1000.0, poisson, rule))
    };
    Model {
        name: format!("hex8 {rule:?} graded={graded} ν={poisson}"),
        operator,
        positions,
        energy: Box::new(energy),
    }
}

fn models() -> Vec<Model> {
    let mut rows = vec![
        hex8_row(0.3, Integration::Full, false),
        hex8_row(0.3, Integration::Full, true),
        hex8_row(0.49, Integration::MeanDilatation, false),
    ];
    for structure in Structure::ALL {
        for boundary in [Boundary::Floppy, Boundary::Firm, Boundary::Graded] {
            for poisson in [0.25, 0.3] {
                rows.push(lattice_row(structure, boundary, poisson));
            }
        }
    }
    rows.extend([0.0, 0.25, 0.3, 0.45].map(connected_row));
    rows
}

fn connected_row(poisson: f64) -> Model {
    let case = Case {
        structure: Structure::Sc,
        lp_mm: 0.04,
        boundary: Boundary::Graded,
        registration_mm: [0.0; 3],
    };
    let pieces = build_connected(&irregular_specimen(), &case, Axis::Z, 0.0).unwrap();
    assert!(pieces.len() > 100, "{} pieces", pieces.len());
    let moduli = Moduli::new(Structure::Sc, 0.04, 1000.0, poisson).unwrap();
    let positions = pieces
        .indices
        .iter()
        .map(|&i| pieces.frame.position_mm(i))
        .collect();
    let twin = ConnectedLattice::new(pieces.clone(), moduli);
    Model {
        name: format!("sc graded in pieces ν={poisson}"),
        operator: Box::new(ConnectedLattice::new(pieces, moduli)),
        positions,
        energy: Box::new(move |u| twin.energy(u)),
    }
}

fn random_field(n: usize, seed: u64) -> Field {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..n)
        .map(|_| std::array::from_fn(|_| random.random::<f64>() - 0.5))
        .collect()
}

fn applied(operator: &dyn Operator<3>, x: &[[f64; 3]]) -> Field {
    let mut y = vec![[0.0; 3]; operator.sites()];
    operator.apply(x, &mut y);
    y
}

fn largest(v: &[[f64; 3]]) -> f64 {
    v.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()))
}

#[test]
fn operators_are_symmetric() {
    for m in models() {
        let (x, y) = (
            random_field(m.positions.len(), 1),
            random_field(m.positions.len(), 2),
        );
        let (left, right) = (
            dot(&y, &applied(&*m.operator, &x)),
            dot(&x, &applied(&*m.operator, &y)),
        );
        // Measured: at most 1e-15 of the products' scale.
        let scale = dot(&x, &applied(&*m.operator, &x));
        assert!(
            (left - right).abs() < 1e-13 * scale,
            "{}: {left} {right}",
            m.name
        );
    }
}

#[test]
fn rigid_motions_are_force_free() {
    for m in models() {
        let scale = largest(&applied(&*m.operator, &random_field(m.positions.len(), 1)));
        for motion in 0..6 {
            let u: Field = m.positions.iter().map(|&p| rigid(p, motion)).collect();
            let force = largest(&applied(&*m.operator, &u));
            assert!(
                force < 1e-13 * scale,
                "{} motion {motion}: {force} of {scale}",
                m.name
            );
        }
    }
}

/// Translations along x, y, z, then infinitesimal rotations about them.
fn rigid(p: [f64; 3], motion: usize) -> [f64; 3] {
    let mut u = [0.0; 3];
    if motion < 3 {
        u[motion] = 1.0;
    } else {
        let (a, b) = ((motion + 1) % 3, (motion + 2) % 3);
        (u[a], u[b]) = (-p[b], p[a]);
    }
    u
}

#[test]
fn forces_sum_to_zero() {
    for m in models() {
        let force = applied(&*m.operator, &random_field(m.positions.len(), 4));
        for c in 0..3 {
            let sum: f64 = force.iter().map(|f| f[c]).sum();
            assert!(
                sum.abs() < 1e-12 * largest(&force) * (force.len() as f64).sqrt(),
                "{}: {sum}",
                m.name
            );
        }
    }
}

#[test]
fn the_force_is_the_gradient_of_the_energy() {
    for m in models() {
        let u = random_field(m.positions.len(), 5);
        let force = applied(&*m.operator, &u);
        let direction = random_field(m.positions.len(), 6);
        // Quadratic energy: central differences are exact but for rounding.
        let step = 1e-3;
        let moved = |s: f64| -> Field {
            let along = |(u, d): (&[f64; 3], &[f64; 3])| std::array::from_fn(|c| u[c] + s * d[c]);
            u.iter().zip(&direction).map(along).collect()
        };
        let slope = ((m.energy)(&moved(step)) - (m.energy)(&moved(-step))) / (2.0 * step);
        let work = dot(&force, &direction);
        assert!(
            (slope - work).abs() < 1e-9 * (m.energy)(&u),
            "{}: {slope} {work}",
            m.name
        );
    }
}

#[test]
fn the_diagonal_is_that_of_the_operator() {
    for m in models() {
        let n = m.positions.len();
        let mut diagonal = vec![[0.0; 3]; n];
        m.operator.diagonal(&mut diagonal);
        for site in [0, n / 3, n / 2, n - 1] {
            for c in 0..3 {
                let mut unit = vec![[0.0; 3]; n];
                unit[site][c] = 1.0;
                let entry = applied(&*m.operator, &unit)[site][c];
                assert!(
                    (entry - diagonal[site][c]).abs() < 1e-12 * largest(&diagonal),
                    "{} {site} {c}",
                    m.name
                );
            }
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    for m in models() {
        let solved = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let mut u = random_field(m.positions.len(), 7);
                let mut held = Held::none(u.len());
                (0..40).for_each(|s| (0..3).for_each(|c| held.hold(s, c)));
                let operator = Shared(&*m.operator);
                let jacobi = Jacobi::new(&Constrained {
                    inner: &operator,
                    held: &held,
                });
                let params = CgParams {
                    max_iterations: 30,
                    energy_tolerance: 0.0,
                    ..CgParams::default()
                };
                minimise(
                    &operator,
                    &held,
                    &jacobi,
                    &mut u,
                    &params,
                    ENERGY_ALONE,
                    |_| (),
                );
                u
            })
        };
        assert_eq!(solved(1), solved(3), "{}", m.name);
    }
}

/// A borrowed row as an operator of known size.
struct Shared<'a>(&'a dyn Operator<3>);

impl Operator<3> for Shared<'_> {
    fn sites(&self) -> usize {
        self.0.sites()
    }
    fn apply(&self, x: &[[f64; 3]], y: &mut [[f64; 3]]) {
        self.0.apply(x, y);
    }
    fn diagonal(&self, d: &mut [[f64; 3]]) {
        self.0.diagonal(d);
    }
}
