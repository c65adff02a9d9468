//! The table of models of the plane, remodelling and continuum-molecular, and the laws every one of them must obey.

use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::discretisation::plane::family::{Family, Stencil};
use bonepd_ct::operator::Operator;
use bonepd_ct::operator::nonlinear::Staggered;
use bonepd_ct::operator::reduction::{Reduction, Value};
use bonepd_ct::physics::bond_based;
use bonepd_ct::physics::bond_based::{BondBased, Material, micromodulus_discrete};
use bonepd_ct::physics::continuum;
use bonepd_ct::physics::continuum::{Continuum, Old};
use bonepd_ct::physics::continuum_molecular::body::{Body, RESIDUAL};
use bonepd_ct::physics::continuum_molecular::bond::{Moduli, bonds};
use bonepd_ct::physics::continuum_molecular::conductivity::Conductivity;
use bonepd_ct::physics::continuum_molecular::micromoduli::Micromoduli;
use bonepd_ct::physics::continuum_molecular::tensor::PlaneTensor;
use bonepd_ct::physics::growth::Weight;
use bonepd_ct::physics::hyperelastic::Energy;

type Apply = Box<dyn Fn(&[f64]) -> Vec<f64>>;

/// One row: the stiffness of a body at rest, its unknowns in a row.
struct Model {
    name: String,
    apply: Apply,
    diagonal: Vec<f64>,
    /// What costs nothing: rigid motions, or a constant.
    free: Vec<Vec<f64>>,
}

/// An irregular body of unit spacing: a disc with a hole and a notch.
fn points() -> Points {
    Points::from_box([-6.0, -6.0], 1.0, [12, 12], |p| {
        p[0].hypot(p[1]) < 5.9 && (p[0] - 2.0).hypot(p[1]) > 1.2 && !(p[0] < -3.0 && p[1] > 0.0)
    })
}

fn tensor() -> PlaneTensor {
    let tensor = PlaneTensor::from_moduli([1.0, 0.8, 0.2, 1.0 / 3.0, 0.1, 1.0 / 6.0]).unwrap();
    tensor.turned(0.3)
}

/// Of each point, under motion `m`: two translations, then a turn about the origin with its rotation, as far as there
/// are unknowns.
fn rigid<const D: usize>(points: &Points, m: usize) -> Vec<f64> {
    let of = |p: [f64; 2]| {
        let all = match m {
            0 => [1.0, 0.0, 0.0],
            1 => [0.0, 1.0, 0.0],
            _ => [-p[1], p[0], 1.0],
        };
        std::array::from_fn::<f64, D, _>(|d| all[d])
    };
    points.positions().into_iter().flat_map(of).collect()
}

fn body_row<const D: usize>(name: &str, body: Body<D>, free: Vec<Vec<f64>>) -> Model {
    let n = body.sites();
    let mut diagonal = vec![[0.0; D]; n];
    body.diagonal(&mut diagonal);
    Model {
        name: name.into(),
        apply: Box::new(move |x| {
            let mut y = vec![[0.0; D]; n];
            body.apply(x.as_chunks().0, &mut y);
            y.into_flattened()
        }),
        diagonal: diagonal.into_flattened(),
        free,
    }
}

fn elastic<const D: usize>() -> Body<D> {
    let points = points();
    let stencil = Stencil::new(1.0, 3.0, true).unwrap();
    let micro = Micromoduli::new(&tensor(), 3.0);
    let of = |b: &bonepd_ct::physics::continuum_molecular::bond::Bond| {
        let psi = b.psi();
        let moduli = Moduli {
            axial: micro.axial(psi),
            shear: if D == 3 { micro.shear(psi) } else { 0.0 },
            bending: if D == 3 { 0.1 } else { 0.0 },
        };
        b.stiffness(&moduli, 1.0)
    };
    let blocks = bonds(&stencil).iter().map(of).collect();
    Body::new(Family::new(&points, points.len(), stencil), blocks)
}

/// The same with surfaces corrected and a broken bond, so that bonds differ.
fn broken<const D: usize>() -> Body<D> {
    let mut body = elastic::<D>();
    body.correct_surfaces(|_| None);
    let there = body.family.range(40).start;
    let (q, _) = body.family.kind(there);
    let mut back = body.family.range(q);
    let back = back.find(|&s| body.family.kind(s).0 == 40).unwrap();
    body.scale([there, back], RESIDUAL);
    body
}

fn conductor() -> Body<1> {
    let points = points();
    let stencil = Stencil::new(1.0, 3.0, true).unwrap();
    let law = Conductivity::principal(2.0, 0.5, 0.4).unwrap();
    let law = law.microconductivity(3.0, 2).unwrap();
    let blocks = bonds(&stencil)
        .iter()
        .map(|b| b.conductance(law.at(b.psi()), 1.0))
        .collect();
    Body::new(Family::new(&points, points.len(), stencil), blocks)
}

/// Placements are free, densities are held at their reference.
fn at_rest(points: &Points) -> (Reduction, Vec<f64>, Vec<f64>) {
    let n = points.len();
    let mut roles = vec![Value::Held; n];
    roles.resize(3 * n, Value::Free);
    let mut given = vec![1.0; n];
    given.resize(3 * n, 0.0);
    let places = points.positions().into_flattened();
    (Reduction::new(&roles), given, places)
}

const WEIGHT: Weight = Weight {
    reference: 1.0,
    exponent: 2.0,
};

fn stiffness_row(
    name: &str,
    step: &impl Staggered,
    mut k: bonepd_ct::operator::sparse::Sparse,
    places: &[f64],
) -> Model {
    let mut residual = vec![0.0; places.len()];
    step.residual(places, &mut residual);
    assert!(
        residual.iter().all(|r| r.abs() < 1e-13),
        "{name} is not at rest"
    );
    step.stiffness(places, &mut k);
    let entry = |i: usize| k.row(i).find(|e| e.0 == i).map_or(0.0, |e| e.1);
    let points = points();
    Model {
        name: name.into(),
        diagonal: (0..places.len()).map(entry).collect(),
        apply: Box::new(move |x| {
            let mut y = vec![0.0; x.len()];
            k.apply(x, &mut y);
            y
        }),
        free: (0..3).map(|m| rigid::<2>(&points, m)).collect(),
    }
}

fn bond_based_row() -> Model {
    let points = points();
    let (map, given, places) = at_rest(&points);
    let stencil = Stencil::new(1.0, 2.01, false).unwrap();
    let material = Material {
        micromodulus: micromodulus_discrete(1.0, &stencil),
        young: 1.0,
        weight: WEIGHT,
        growth: None,
    };
    let model = BondBased::new(&points, points.len(), stencil, material, None);
    let step = bond_based::Step {
        model: &model,
        map: &map,
        given: &given,
        old: &[],
        dt: 1.0,
        load: &[],
    };
    stiffness_row(
        "remodelling, bonds",
        &step,
        model.pattern_from(&map, 0),
        &places,
    )
}

fn continuum_row(energy: Energy, name: &str) -> Model {
    let points = points();
    let (map, given, places) = at_rest(&points);
    let model = Continuum::new(&points, 1.0, energy, WEIGHT, None);
    let step = continuum::Step {
        model: &model,
        map: &map,
        given: &given,
        old: Old::Nodes(&vec![1.0; points.len()]),
        dt: 1.0,
        load: &[],
    };
    stiffness_row(name, &step, model.pattern_from(&map, 0), &places)
}

fn models() -> Vec<Model> {
    let points = points();
    let motions2 = || (0..3).map(|m| rigid::<2>(&points, m)).collect::<Vec<_>>();
    let motions3 = || (0..3).map(|m| rigid::<3>(&points, m)).collect::<Vec<_>>();
    vec![
        bond_based_row(),
        continuum_row(Energy::plane_stress(1.0, 0.3), "remodelling, plane stress"),
        continuum_row(
            Energy::isotropic_bonds(1.0),
            "remodelling, continuum of bonds",
        ),
        body_row("central bonds", elastic::<2>(), motions2()),
        body_row("central bonds, some broken", broken::<2>(), motions2()),
        body_row("bonds with rotation", elastic::<3>(), motions3()),
        body_row(
            "bonds with rotation, some broken",
            broken::<3>(),
            motions3(),
        ),
        body_row("conduction", conductor(), vec![vec![1.0; points.len()]]),
    ]
}

fn noise(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.7 + seed).sin()).collect()
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

#[test]
fn plane_models_are_symmetric_and_positive() {
    for m in models() {
        let n = m.diagonal.len();
        let (x, y) = (noise(n, 0.1), noise(n, 0.9));
        let (ax, ay) = ((m.apply)(&x), (m.apply)(&y));
        let scale = dot(&x, &ax);
        assert!(scale > 0.0 && dot(&y, &ay) > 0.0, "{}", m.name);
        let off = (dot(&y, &ax) - dot(&x, &ay)).abs();
        assert!(off < 1e-13 * scale, "{}: {off:e} of {scale:e}", m.name);
    }
}

/// Free motions take no force, and no forces take part in them: they sum to zero, and so do their moments.
#[test]
fn plane_models_move_freely_and_their_forces_balance() {
    for m in models() {
        let n = m.diagonal.len();
        let forces = (m.apply)(&noise(n, 0.4));
        let scale = forces.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        for (number, motion) in m.free.iter().enumerate() {
            let worst = (m.apply)(motion).iter().fold(0.0f64, |m, f| m.max(f.abs()));
            assert!(
                worst < 1e-12 * scale,
                "{} motion {number}: {worst:e}",
                m.name
            );
            let sum = dot(motion, &forces);
            assert!(
                sum.abs() < 1e-12 * scale * n as f64,
                "{} motion {number}: {sum:e}",
                m.name
            );
        }
        // Another motion is not free: the law above can fail.
        let stretch: Vec<f64> = (0..n).map(|i| (i * i % 17) as f64).collect();
        assert!(
            (m.apply)(&stretch).iter().any(|f| f.abs() > 1e-3 * scale),
            "{}",
            m.name
        );
    }
}

#[test]
fn plane_diagonals_are_those_of_the_operators() {
    for m in models() {
        let n = m.diagonal.len();
        let largest = m.diagonal.iter().fold(0.0f64, |m, d| m.max(d.abs()));
        for i in [0, n / 3, n / 2, n - 1] {
            let mut unit = vec![0.0; n];
            unit[i] = 1.0;
            let off = ((m.apply)(&unit)[i] - m.diagonal[i]).abs();
            assert!(off < 1e-13 * largest, "{} unknown {i}: {off:e}", m.name);
        }
    }
}

#[test]
fn plane_models_do_not_depend_on_the_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let rows = models();
            let of = |m: &Model| (m.apply)(&noise(m.diagonal.len(), 0.2));
            rows.iter().map(of).collect::<Vec<_>>()
        })
    };
    assert_eq!(on(1), on(3));
}
