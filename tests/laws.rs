//! The table of three-dimensional models, and the laws every one of them must obey. A new discretisation is one row. Models of
//! the plane have a table of their own ([`plane`]).

mod plane;

use bonepd_ct::discretisation::tetrahedra::fill::fill;
use bonepd_ct::discretisation::tetrahedra::lattice::{Lattice as Cells, planes};
use bonepd_ct::discretisation::tetrahedra::nodes::TetMesh;
use bonepd_ct::discretisation::tetrahedra::surface::{Bound, Surface};
use bonepd_ct::discretisation::voxels::{Planes, VoxelMesh};
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::operator::coarsen::Coarsen;
use bonepd_ct::operator::held::{Constrained, Held};
use bonepd_ct::operator::nonlinear::Incremental;
use bonepd_ct::operator::{MixedPrecision, Operator};
use bonepd_ct::par::dot;
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::{ElementMatrix, Integration, stiffness};
use bonepd_ct::physics::hex8::heterogeneous::Heterogeneous;
use bonepd_ct::physics::hex8::plastic::points::Points;
use bonepd_ct::physics::hex8::plastic::{PlasticBricks, Tissue};
use bonepd_ct::physics::lattice::connected::{ConnectedLattice, ConnectedSprings};
use bonepd_ct::physics::lattice::multigrid::Springs;
use bonepd_ct::physics::lattice::{Lattice, Moduli};
use bonepd_ct::physics::plasticity::{DruckerPrager, Elastic, VonMises, YieldLaw};
use bonepd_ct::physics::tet10::Tet10;
use bonepd_ct::pipeline::lattice::{
    Boundary, Case, Structure, build_connected, build_of, site_values,
};
use bonepd_ct::solver::cg::jacobi::Jacobi;
use bonepd_ct::solver::cg::{CgParams, ENERGY_ALONE, minimise};
use bonepd_ct::volume::{Specimen, Volume};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::HashMap;
use std::sync::LazyLock;

type Field = Vec<[f64; 3]>;
type Energy = Box<dyn Fn(&[[f64; 3]]) -> f64 + Send + Sync>;
type Single = Box<dyn Fn(&[[f32; 3]]) -> Vec<[f32; 3]> + Send + Sync>;

/// One row: a model on an irregular specimen. Operators live as long as the test program.
struct Model {
    name: String,
    operator: &'static dyn Operator<3>,
    /// `A x` in single precision.
    single: Single,
    /// What multigrid asks for, where the model is what multigrid is built on.
    coarsen: Option<&'static dyn Coarsen>,
    positions: Field,
    energy: Energy,
}

impl Model {
    fn of<O: MixedPrecision>(
        name: String,
        operator: &'static O,
        positions: Field,
        energy: Energy,
    ) -> Self {
        Model {
            name,
            operator,
            single: Box::new(|x| {
                let mut y = vec![[0.0; 3]; x.len()];
                operator.apply_single(x, &mut y, |_, _| 0.0);
                y
            }),
            coarsen: None,
            positions,
            energy,
        }
    }

    /// A model whose rows multigrid reads.
    fn of_rows<O: Coarsen>(
        name: String,
        operator: &'static O,
        positions: Field,
        energy: Energy,
    ) -> Self {
        Model {
            coarsen: Some(operator),
            ..Model::of(name, operator, positions, energy)
        }
    }
}

static MODELS: LazyLock<Vec<Model>> = LazyLock::new(models);

fn leaked<T>(value: T) -> &'static T {
    Box::leak(Box::new(value))
}

/// A box of 14 × 13 × 12 voxels with holes, lumps and free corners, and unequal spacing.
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
        threshold: None,
    }
}

/// How the tissue of a row differs from voxel to voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TissueRow {
    Uniform,
    /// In its modulus.
    Young,
    /// In both moduli: sites have volumetric moduli of their own.
    Both,
}

fn case(structure: Structure, boundary: Boundary) -> Case {
    Case {
        structure,
        lp_mm: 0.04,
        boundary,
        registration_mm: [0.0; 3],
    }
}

fn lattice(case: &Case, poisson: f64, tissue: TissueRow) -> Lattice {
    let specimen = irregular_specimen();
    let voxels = specimen.bone.as_slice().len();
    let factors: Vec<f32> = (0..voxels).map(|v| 0.5 + (v % 7) as f32 / 4.0).collect();
    let of_voxels = (tissue != TissueRow::Uniform).then_some(&factors[..]);
    let sites = build_of(&specimen, of_voxels, case, Axis::Z, 0.0).unwrap();
    assert!(sites.len() > 100, "{case:?}: {} sites", sites.len());
    let moduli = Moduli::new(case.structure, case.lp_mm, 1000.0, poisson).unwrap();
    match tissue {
        TissueRow::Uniform | TissueRow::Young => Lattice::new(sites, moduli),
        TissueRow::Both => {
            let dilatation: Vec<f32> = (0..voxels).map(|v| 0.2 + (v % 5) as f32 / 3.0).collect();
            let of_sites = site_values(&specimen, &dilatation, case, &sites);
            let own = of_sites.into_iter().map(|v| v * moduli.t).collect();
            Lattice::with_volumetric(sites, moduli, own)
        }
    }
}

fn lattice_row(structure: Structure, boundary: Boundary, poisson: f64, tissue: TissueRow) -> Model {
    let lattice = leaked(lattice(&case(structure, boundary), poisson, tissue));
    let sites = &lattice.sites;
    let positions = sites.indices.iter().map(|&i| sites.frame.position_mm(i));
    let name = format!(
        "{} {} ν={poisson} tissue {tissue:?}",
        structure.name(),
        boundary.name()
    );
    let energy = Box::new(|u: &[[f64; 3]]| lattice.energy(u));
    Model::of(name, lattice, positions.collect(), energy)
}

/// The springs of a lattice: its energy without the volumetric term.
fn springs_row(structure: Structure, boundary: Boundary) -> Model {
    let case = case(structure, boundary);
    let whole = leaked(lattice(&case, 0.3, TissueRow::Uniform));
    let moduli = Moduli::new(structure, case.lp_mm, 1000.0, 0.3).unwrap();
    let alone = Lattice::new(whole.sites.clone(), Moduli { t: 0.0, ..moduli });
    let sites = &whole.sites;
    let positions = sites.indices.iter().map(|&i| sites.frame.position_mm(i));
    Model::of_rows(
        format!("springs of {} {}", structure.name(), boundary.name()),
        leaked(Springs::new(whole)),
        positions.collect(),
        Box::new(move |u| alone.energy(u)),
    )
}

fn connected(poisson: f64, volumetric: bool) -> ConnectedLattice {
    let case = case(Structure::Sc, Boundary::Connected);
    let sites = build_connected(&irregular_specimen(), &case, Axis::Z, 0.0).unwrap();
    assert!(sites.len() > 100, "{} components", sites.len());
    let moduli = Moduli::new(Structure::Sc, case.lp_mm, 1000.0, poisson).unwrap();
    let t = if volumetric { moduli.t } else { 0.0 };
    ConnectedLattice::new(sites, Moduli { t, ..moduli })
}

fn connected_positions(lattice: &ConnectedLattice) -> Field {
    let sites = &lattice.sites;
    let positions = sites.indices.iter().map(|&i| sites.frame.position_mm(i));
    positions.collect()
}

fn connected_row(poisson: f64) -> Model {
    let lattice = leaked(connected(poisson, true));
    Model::of(
        format!("sc connected ν={poisson}"),
        lattice,
        connected_positions(lattice),
        Box::new(|u| lattice.energy(u)),
    )
}

fn connected_springs_row() -> Model {
    let (whole, alone) = (leaked(connected(0.3, true)), connected(0.3, false));
    Model::of_rows(
        "springs of sc connected".into(),
        leaked(ConnectedSprings(whole)),
        connected_positions(whole),
        Box::new(move |u| alone.energy(u)),
    )
}

/// Voxel elements made by `build`; their energy is summed element by element from the matrix and the factor of each.
fn element_row<O: Coarsen + 'static>(
    name: &str,
    build: impl Fn(VoxelMesh) -> O,
    element: impl Fn(usize) -> (ElementMatrix, f64) + Send + Sync + 'static,
) -> Model {
    let bone = irregular_specimen().bone;
    let grips = Planes::within(&bone.grid, Axis::Z, 0.0).unwrap();
    let mesh = VoxelMesh::new(bone.grid, bone.as_slice(), |b| *b != 0, grips).unwrap();
    let positions: Field = (0..mesh.len()).map(|i| mesh.position(i)).collect();
    let numbers: HashMap<[u32; 3], usize> = (0..mesh.len())
        .filter(|&i| mesh.around[i] != 0)
        .map(|i| (mesh.indices(i), i))
        .collect();
    let elements: Vec<([usize; 8], usize)> = mesh
        .low_corner_elements()
        .enumerate()
        .filter_map(|(node, element)| {
            let at = mesh.indices(node);
            let corner = |c: usize| numbers[&std::array::from_fn(|a| at[a] + (c as u32 >> a & 1))];
            element.map(|e| (std::array::from_fn(corner), e))
        })
        .collect();
    let energy = move |u: &[[f64; 3]]| {
        let of = |&(corners, e): &([usize; 8], usize)| {
            let (k, factor) = element(e);
            let u: [f64; 24] = std::array::from_fn(|i| u[corners[i / 3]][i % 3]);
            let forces = k.map(|row| row.iter().zip(&u).map(|(a, b)| a * b).sum::<f64>());
            0.5 * factor * forces.iter().zip(&u).map(|(f, u)| f * u).sum::<f64>()
        };
        elements.iter().map(of).sum()
    };
    let operator = leaked(build(mesh));
    Model::of_rows(name.into(), operator, positions, Box::new(energy))
}

fn spacing() -> [f64; 3] {
    irregular_specimen().bone.grid.spacing_mm
}

fn matrix(poisson: f64, rule: Integration) -> ElementMatrix {
    stiffness(spacing(), 1000.0, poisson, rule)
}

/// Elements of one material.
fn hex8_row(poisson: f64, rule: Integration) -> Model {
    let k = matrix(poisson, rule);
    element_row(
        &format!("hex8 {rule:?} ν={poisson}"),
        |mesh| Hex8::new(mesh, 1000.0, poisson, rule),
        move |_| (k, 1.0),
    )
}

/// Elements of as many materials as `kinds`, and a factor each.
fn heterogeneous_row(kinds: &'static [(f64, Integration)]) -> Model {
    let matrices: Vec<ElementMatrix> = kinds.iter().map(|&(nu, rule)| matrix(nu, rule)).collect();
    let factor = |e: usize| 0.5 + (e % 5) as f32;
    let kind = move |e: usize| e % 3 % kinds.len();
    element_row(
        &format!("heterogeneous hex8 {kinds:?}"),
        |mesh| Heterogeneous::of_kinds(mesh, 1000.0, kinds, factor, |e| kind(e) as u8),
        move |e| (matrices[kind(e)], f64::from(factor(e))),
    )
}

/// Smooth elements in the irregular specimen; their energy is summed over the points of a Gauss rule from the shape functions.
fn tet10_row(poisson: f64, mixed: bool) -> Model {
    let bone = irregular_specimen().bone;
    let size = bone.grid.size_mm();
    let values = bone.as_slice().iter().map(|v| f32::from(*v)).collect();
    let surface = Surface::new(vec![Bound {
        values: Volume::from_vec(bone.grid, values),
        level: 0.5,
        sign: 1.0,
    }]);
    let planes = std::array::from_fn(|a| planes(&[0.0, size[a]], 0.03));
    let mesh = TetMesh::of(&fill(&surface, &Cells::new(planes)).unwrap());
    assert!(mesh.elements.len() > 5000, "{}", mesh.elements.len());
    let factor = |e: usize| if mixed { 0.5 + (e % 5) as f32 } else { 1.0 };
    let factors: Vec<f32> = (0..mesh.elements.len()).map(factor).collect();
    let (elements, positions) = (mesh.elements.clone(), mesh.nodes_mm.clone());
    let own = mixed.then(|| factors.clone());
    let operator = leaked(Tet10::new(mesh, 1000.0, poisson, own));
    let nodes = positions.clone();
    let energy = move |u: &[[f64; 3]]| {
        let of = |(ten, factor): (&[u32; 10], &f32)| {
            let at = |v: &[[f64; 3]]| ten.map(|n| v[n as usize]);
            f64::from(*factor) * gauss_energy(at(&nodes), at(u), poisson)
        };
        elements.iter().zip(&factors).map(of).sum()
    };
    let name = format!("tet10 ν={poisson} mixed {mixed}");
    Model::of(name, operator, positions, Box::new(energy))
}

/// Energy of a ten-node element of 1000 MPa by four points, from slopes of shape functions in the reference element.
fn gauss_energy(at: [[f64; 3]; 10], u: [[f64; 3]; 10], poisson: f64) -> f64 {
    let near = 0.585_410_196_624_968_5;
    let far = 0.138_196_601_125_010_5;
    let [lambda, mu] = [
        1000.0 * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson)),
        500.0 / (1.0 + poisson),
    ];
    let point = |k: usize| {
        let l: [f64; 4] = std::array::from_fn(|i| if i == k { near } else { far });
        let of_l = |i: usize| match i {
            0 => [-1.0; 3],
            _ => std::array::from_fn(|a| if a + 1 == i { 1.0 } else { 0.0 }),
        };
        let slopes: [[f64; 3]; 10] = std::array::from_fn(|n| {
            let (p, q) = (
                [0, 1, 2, 3, 0, 1, 2, 0, 1, 2][n],
                [0, 1, 2, 3, 1, 2, 0, 3, 3, 3][n],
            );
            std::array::from_fn(|a| match n {
                0..4 => (4.0 * l[p] - 1.0) * of_l(p)[a],
                _ => 4.0 * (l[p] * of_l(q)[a] + l[q] * of_l(p)[a]),
            })
        });
        let by = |v: &[[f64; 3]; 10]| -> [[f64; 3]; 3] {
            std::array::from_fn(|r| {
                std::array::from_fn(|c| (0..10).map(|n| v[n][r] * slopes[n][c]).sum())
            })
        };
        let (j, g) = (by(&at), by(&u));
        let minor = |r: usize, c: usize| {
            let (p, q, s, t) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
            j[p][s] * j[q][t] - j[p][t] * j[q][s]
        };
        let determinant: f64 = (0..3).map(|c| j[0][c] * minor(0, c)).sum();
        let entry = |r: usize, c: usize| -> f64 {
            (0..3).map(|k| g[r][k] * minor(c, k) / determinant).sum()
        };
        let trace = entry(0, 0) + entry(1, 1) + entry(2, 2);
        let squares: f64 = (0..9)
            .map(|i| (0.5 * (entry(i / 3, i % 3) + entry(i % 3, i / 3))).powi(2))
            .sum();
        determinant / 24.0 * (0.5 * lambda * trace * trace + mu * squares)
    };
    (0..4).map(point).sum()
}

fn von_mises() -> YieldLaw {
    YieldLaw::VonMises(VonMises {
        yield_mpa: 1.0,
        hardening_mpa: 20.0,
    })
}

fn asymmetric() -> YieldLaw {
    YieldLaw::Asymmetric(DruckerPrager {
        tension_mpa: 1.0,
        compression_mpa: 1.5,
        hardening_mpa: 20.0,
    })
}

/// The tangent of elements of which some flow. Its energy is summed point by point from the law's own tangent.
fn yielding_row(law: YieldLaw) -> Model {
    let bone = irregular_specimen().bone;
    let grips = Planes::within(&bone.grid, Axis::Z, 0.0).unwrap();
    let mesh = leaked(VoxelMesh::new(bone.grid, bone.as_slice(), |b| *b != 0, grips).unwrap());
    let positions: Field = (0..mesh.len()).map(|i| mesh.position(i)).collect();
    let bricks = leaked(Hex8::new(
        mesh.clone(),
        1000.0,
        0.3,
        Integration::MeanDilatation,
    ));
    let elastic = Elastic::of(1000.0, 0.3);
    let points = || Points::new(bone.grid.spacing_mm, true);
    let mut body = PlasticBricks::new(bricks, mesh, points(), move |_| Tissue { elastic, law });
    // Strained unevenly, so that elements of one end flow and those of the other do not.
    let strained = |x: &[f64; 3]| [1e-4 * x[0], 2e-3 * x[1] * x[2], 8e-3 * x[2] * x[2] / 0.2];
    let u: Field = positions.iter().map(strained).collect();
    body.forces(&u, &mut vec![[0.0; 3]; u.len()]);
    let tangent = leaked(body.tangent_in::<f64>());
    let numbers: HashMap<[u32; 3], usize> = (0..mesh.len())
        .filter(|&i| mesh.around[i] != 0)
        .map(|i| (mesh.indices(i), i))
        .collect();
    let corners = move |node: usize, u: &[[f64; 3]]| -> [[f64; 3]; 8] {
        let at = mesh.indices(node);
        std::array::from_fn(|c| u[numbers[&std::array::from_fn(|a| at[a] + (c as u32 >> a & 1))]])
    };
    let points = points();
    let here = |strain: &[f64; 6]| law.respond(&elastic, strain, &Default::default()).softening;
    let mut flowing = 0;
    let elements: Vec<(usize, [[[f64; 6]; 6]; 8])> = (0..mesh.len())
        .filter(|&node| mesh.has_element(node))
        .map(|node| {
            let softened = points.strains(&corners(node, &u)).map(|e| here(&e));
            flowing += usize::from(softened.iter().any(Option::is_some));
            (
                node,
                softened.map(|s| s.unwrap_or_default().tangent(&elastic)),
            )
        })
        .collect();
    assert!(
        flowing > 100 && flowing < elements.len() - 100,
        "{flowing} of {}",
        elements.len()
    );
    let energy = move |u: &[[f64; 3]]| {
        let of = |(node, tangents): &(usize, [[[f64; 6]; 6]; 8])| -> f64 {
            let strains = points.strains(&corners(*node, u));
            let twice = strains.iter().zip(tangents).map(|(e, t)| {
                let stress = t.map(|row| row.iter().zip(e).map(|(a, b)| a * b).sum::<f64>());
                stress.iter().zip(e).map(|(s, e)| s * e).sum::<f64>()
            });
            0.5 * points.weight() * twice.sum::<f64>()
        };
        elements.iter().map(of).sum()
    };
    Model::of(
        format!("tangent of {law:?}"),
        tangent,
        positions,
        Box::new(energy),
    )
}

fn models() -> Vec<Model> {
    use Integration::{Full, MeanDilatation};
    let mut rows = vec![
        hex8_row(0.3, Full),
        hex8_row(0.49, MeanDilatation),
        heterogeneous_row(&[(0.3, Full)]),
        heterogeneous_row(&[(0.3, Full), (0.49, MeanDilatation)]),
        connected_springs_row(),
        yielding_row(von_mises()),
        yielding_row(asymmetric()),
    ];
    for structure in Structure::ALL {
        let by_bone = match structure {
            Structure::Sc => None,
            Structure::Bcc | Structure::Fcc => Some(Boundary::Weighted),
        };
        for boundary in [Some(Boundary::Floppy), Some(Boundary::Firm), by_bone] {
            let Some(boundary) = boundary else { continue };
            for poisson in [0.25, 0.3] {
                rows.push(lattice_row(
                    structure,
                    boundary,
                    poisson,
                    TissueRow::Uniform,
                ));
            }
            rows.push(lattice_row(structure, boundary, 0.25, TissueRow::Young));
            rows.push(lattice_row(structure, boundary, 0.3, TissueRow::Young));
            rows.push(lattice_row(structure, boundary, 0.3, TissueRow::Both));
            rows.push(springs_row(structure, boundary));
        }
    }
    rows.extend([0.0, 0.25, 0.3, 0.45].map(connected_row));
    rows.extend([tet10_row(0.3, false), tet10_row(-0.2, true)]);
    rows
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
    for m in &*MODELS {
        let (x, y) = (
            random_field(m.positions.len(), 1),
            random_field(m.positions.len(), 2),
        );
        let (left, right) = (
            dot(&y, &applied(m.operator, &x)),
            dot(&x, &applied(m.operator, &y)),
        );
        // Measured: at most 1e-15 of the products' scale.
        let scale = dot(&x, &applied(m.operator, &x));
        assert!(
            (left - right).abs() < 1e-13 * scale,
            "{}: {left} {right}",
            m.name
        );
    }
}

#[test]
fn rigid_motions_are_force_free() {
    for m in &*MODELS {
        let scale = largest(&applied(m.operator, &random_field(m.positions.len(), 1)));
        for motion in 0..6 {
            let u: Field = m.positions.iter().map(|&p| rigid(p, motion)).collect();
            let force = largest(&applied(m.operator, &u));
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
    for m in &*MODELS {
        let force = applied(m.operator, &random_field(m.positions.len(), 4));
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
    for m in &*MODELS {
        let u = random_field(m.positions.len(), 5);
        let force = applied(m.operator, &u);
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
    for m in &*MODELS {
        let n = m.positions.len();
        let mut diagonal = vec![[0.0; 3]; n];
        m.operator.diagonal(&mut diagonal);
        for site in [0, n / 3, n / 2, n - 1] {
            for c in 0..3 {
                let mut unit = vec![[0.0; 3]; n];
                unit[site][c] = 1.0;
                let entry = applied(m.operator, &unit)[site][c];
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
    for m in &*MODELS {
        let solved = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let mut u = random_field(m.positions.len(), 7);
                let mut held = Held::none(u.len());
                (0..40).for_each(|s| (0..3).for_each(|c| held.hold(s, c)));
                let operator = Shared(m.operator);
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

#[test]
fn energies_are_never_negative() {
    for m in &*MODELS {
        for seed in 10..14 {
            let u = random_field(m.positions.len(), seed);
            let twice = dot(&u, &applied(m.operator, &u));
            let energy = (m.energy)(&u);
            assert!(energy > 0.0, "{}: {energy}", m.name);
            assert!(
                (twice / energy / 2.0 - 1.0).abs() < 1e-10,
                "{}: {twice} {energy}",
                m.name
            );
        }
    }
}

/// Rounded coefficients do not sum to zero; differences of what is equal do, exactly.
#[test]
fn single_precision_is_the_double_rounded_and_a_translation_pulls_at_nothing() {
    for m in &*MODELS {
        let x = random_field(m.positions.len(), 8);
        let exact = applied(m.operator, &x);
        let x32: Vec<[f32; 3]> = x.iter().map(|x| x.map(|v| v as f32)).collect();
        let single = (m.single)(&x32);
        let gaps = single.iter().flatten().zip(exact.iter().flatten());
        let worst = gaps.fold(0.0f64, |m, (s, e)| m.max((f64::from(*s) - e).abs()));
        // Some roundings of 6e-8 over the sums of a row.
        assert!(
            worst < 2e-6 * largest(&exact),
            "{}: {worst:e} of {:e}",
            m.name,
            largest(&exact)
        );
        let moved = (m.single)(&vec![[1.1f32, -0.7, 123.4]; x.len()]);
        assert!(moved.iter().flatten().all(|f| *f == 0.0), "{}", m.name);
    }
}

/// Rows equal columns, and both the operator: what multigrid reads is what conjugate gradients apply.
#[test]
fn rows_of_blocks_are_the_operators_and_symmetric() {
    for m in &*MODELS {
        let Some(rows) = m.coarsen else { continue };
        let n = m.positions.len();
        let x = random_field(n, 9);
        let exact = applied(m.operator, &x);
        let scale = largest(&exact);
        let mut blocks = HashMap::new();
        let mut next = 0;
        rows.each_row(0..n, &mut |site, columns, row| {
            assert_eq!(site, next, "{}", m.name);
            next += 1;
            let reach = rows.reach(site..site + 1);
            let mut sum = [0.0; 3];
            for (&column, block) in columns.iter().zip(row) {
                assert!(reach.contains(&(column as usize)), "{}", m.name);
                blocks.insert((site as u32, column), *block);
                for a in 0..3 {
                    let products = (0..3).map(|b| f64::from(block[a][b]) * x[column as usize][b]);
                    sum[a] += products.sum::<f64>();
                }
            }
            let off = (0..3).fold(0.0f64, |m, a| m.max((sum[a] - exact[site][a]).abs()));
            assert!(
                off < 2e-6 * scale,
                "{} site {site}: {off:e} of {scale:e}",
                m.name
            );
        });
        assert_eq!(next, n, "{}", m.name);
        for ((i, j), block) in &blocks {
            let other = blocks[&(*j, *i)];
            let off = (0..9).map(|k| (block[k / 3][k % 3] - other[k % 3][k / 3]).abs());
            let size = block.iter().flatten().fold(0.0f32, |m, v| m.max(v.abs()));
            let off = off.fold(0.0, f32::max);
            assert!(off <= 1e-6 * size, "{}: {block:?} {other:?}", m.name);
        }
        let third = n / 3..2 * n / 3;
        let mut part = vec![[0.0; 3]; third.len()];
        rows.rows_f64(third.clone(), &x, &mut part);
        assert_eq!(part, exact[third], "{}", m.name);
    }
}

/// `xᵀ A x` is at most the bound times `xᵀ D x`, `D` the blocks of the diagonal.
#[test]
fn eigenvalues_stay_below_their_bound() {
    for m in &*MODELS {
        let Some(rows) = m.coarsen else { continue };
        let n = m.positions.len();
        let mut x = random_field(n, 12);
        let mut ratio = 0.0;
        // Iterations towards the largest eigenvalue of the operator scaled by its plain diagonal.
        let mut diagonal = vec![[0.0; 3]; n];
        m.operator.diagonal(&mut diagonal);
        for _ in 0..50 {
            let y = applied(m.operator, &x);
            let mut own = 0.0;
            rows.each_row(0..n, &mut |site, columns, blocks| {
                let diagonal = columns.iter().position(|c| *c as usize == site);
                let Some(at) = diagonal else { return };
                for k in 0..9 {
                    own += x[site][k / 3] * f64::from(blocks[at][k / 3][k % 3]) * x[site][k % 3];
                }
            });
            ratio = dot(&x, &y) / own;
            let scaled = |(y, d): (&[f64; 3], &[f64; 3])| {
                std::array::from_fn(|c| if d[c] > 0.0 { y[c] / d[c] } else { 0.0 })
            };
            x = y.iter().zip(&diagonal).map(scaled).collect();
            let size = largest(&x).recip();
            x.iter_mut().flatten().for_each(|v| *v *= size);
        }
        let bound = rows.eigenvalue_bound();
        assert!(ratio <= bound, "{}: {ratio} above {bound}", m.name);
        assert!(
            ratio > 0.4 * bound,
            "{}: {ratio}, and {bound} is idle",
            m.name
        );
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
