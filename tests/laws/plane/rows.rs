//! The table of models of the plane, remodelling and continuum-molecular.

use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::discretisation::plane::family::{Family, Stencil};
use bonepd_ct::operator::Operator;
use bonepd_ct::operator::nonlinear::Staggered;
use bonepd_ct::operator::reduction::{Reduction, Value};
use bonepd_ct::physics::bond_based;
use bonepd_ct::physics::bond_based::shear::{self, ShearBonds, ShearStep};
use bonepd_ct::physics::bond_based::{BondBased, Material, micromodulus_discrete};
use bonepd_ct::physics::continuum;
use bonepd_ct::physics::continuum::{Continuum, Old};
use bonepd_ct::physics::continuum_molecular::body::{Body, RESIDUAL};
use bonepd_ct::physics::continuum_molecular::bond::{Bond, Moduli, bonds};
use bonepd_ct::physics::continuum_molecular::conductivity::Conductivity;
use bonepd_ct::physics::continuum_molecular::micromoduli::Micromoduli;
use bonepd_ct::physics::continuum_molecular::piezoresistance::Piezoresistance;
use bonepd_ct::physics::continuum_molecular::tensor::PlaneTensor;
use bonepd_ct::physics::continuum_molecular::thermal::ThermalStrain;
use bonepd_ct::physics::growth::Weight;
use bonepd_ct::physics::hyperelastic::Energy;

pub type Apply = Box<dyn Fn(&[f64]) -> Vec<f64>>;
/// Forces under an expansion a11, a22, a12 and a temperature of each point.
pub type Heat = Box<dyn Fn([f64; 3], Vec<f64>) -> Vec<f64>>;

/// One row: the stiffness of a body at rest, its unknowns in a row.
pub struct Model {
    pub name: String,
    pub apply: Apply,
    pub diagonal: Vec<f64>,
    /// What costs nothing: rigid motions, or a constant.
    pub free: Vec<Vec<f64>>,
    /// Where heat strains the body.
    pub heat: Option<Heat>,
    /// Whether bonds resist bending: a rotation that varies in space takes moments.
    pub bends: bool,
}

/// An irregular body of unit spacing: a disc with a hole and a notch.
pub fn points() -> Points {
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

fn body_row<const D: usize>(name: &str, body: Body<D>, bends: bool, free: Vec<Vec<f64>>) -> Model {
    let n = body.sites();
    let mut diagonal = vec![[0.0; D]; n];
    body.diagonal(&mut diagonal);
    let warmed = body.clone();
    let heat: Heat = Box::new(move |expansion, rise| {
        let thermal = ThermalStrain { expansion, rise };
        let all = bonds(&warmed.family.stencil);
        let moduli: Vec<Moduli> = all.iter().map(|b| moduli::<D>(b, 0.0)).collect();
        let forces = thermal.forces(&warmed, &all, &moduli, 1.0);
        forces.into_flattened()
    });
    Model {
        heat: (D > 1).then_some(heat),
        bends,
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

fn moduli<const D: usize>(b: &Bond, bending: f64) -> Moduli {
    let micro = Micromoduli::new(&tensor(), 3.0);
    Moduli {
        axial: micro.axial(b.psi()),
        shear: if D == 3 { micro.shear(b.psi()) } else { 0.0 },
        bending,
    }
}

fn elastic<const D: usize>(bending: f64) -> Body<D> {
    let points = points();
    let stencil = Stencil::new(1.0, 3.0, true).unwrap();
    let blocks = bonds(&stencil)
        .iter()
        .map(|b| b.stiffness(&moduli::<D>(b, bending), 1.0))
        .collect();
    Body::new(Family::new(&points, points.len(), stencil), blocks)
}

/// The same with surfaces corrected and a broken bond, so that bonds differ.
fn broken<const D: usize>(bending: f64) -> Body<D> {
    let mut body = elastic::<D>(bending);
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

/// Its bonds conduct by their strain, which differs from bond to bond.
fn strained_conductor() -> Body<1> {
    let mut body = conductor();
    let all = bonds(&body.family.stencil);
    let law = Piezoresistance { slope: -20.0 };
    let moved: Vec<f64> = noise(2 * points().len(), 0.3)
        .iter()
        .map(|u| 0.01 * u)
        .collect();
    let (moved, _) = moved.as_chunks::<2>();
    let mut factors = Vec::new();
    body.scale_each(|_, p, q, kind| {
        let stretch = all[kind].deformation(&moved[p], &moved[q]).stretch;
        factors.push(law.factor(stretch).unwrap());
        factors[factors.len() - 1]
    });
    assert!(factors.iter().any(|f| *f > 1.1) && factors.iter().any(|f| *f < 0.9));
    body
}

/// Everything is free but densities, which are held, each at its own. `turns` rotations of each point follow its placements, of
/// `cases` load cases.
fn at_rest(points: &Points, cases: usize, turns: usize) -> (Reduction, Vec<f64>, Vec<f64>) {
    let n = points.len();
    let mut roles = vec![Value::Held; n];
    roles.resize(n + cases * (2 + turns) * n, Value::Free);
    let mut given: Vec<f64> = noise(n, 0.6).iter().map(|r| 1.0 + 0.3 * r).collect();
    given.resize(roles.len(), 0.0);
    let mut places = points.positions().into_flattened();
    places.resize((2 + turns) * n, 0.0);
    (Reduction::new(&roles), given, places.repeat(cases))
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
    free: Vec<Vec<f64>>,
) -> Model {
    let mut residual = vec![0.0; places.len()];
    step.residual(places, &mut residual);
    assert!(
        residual.iter().all(|r| r.abs() < 1e-13),
        "{name} is not at rest"
    );
    step.stiffness(places, &mut k);
    let entry = |i: usize| k.row(i).find(|e| e.0 == i).map_or(0.0, |e| e.1);
    Model {
        heat: None,
        bends: false,
        name: name.into(),
        diagonal: (0..places.len()).map(entry).collect(),
        apply: Box::new(move |x| {
            let mut y = vec![0.0; x.len()];
            k.apply(x, &mut y);
            y
        }),
        free,
    }
}

fn motions<const D: usize>(points: &Points) -> Vec<Vec<f64>> {
    (0..3).map(|m| rigid::<D>(points, m)).collect()
}

/// Bonds of two load cases whose points turn: each case moves freely by itself.
fn shear_bonds_row() -> Model {
    let points = points();
    let n = points.len();
    let (map, given, places) = at_rest(&points, 2, 1);
    let stencil = Stencil::new(1.0, 2.01, false).unwrap();
    let model = ShearBonds {
        micromoduli: shear::Micromoduli::discrete(1.0, 0.2, &stencil),
        family: Family::new(&points, n, stencil),
        young: 1.0,
        weight: WEIGHT,
        growth: None,
        shares: None,
        points: n,
        cases: vec![0.3, 0.7],
        turns: true,
    };
    let step = ShearStep {
        model: &model,
        map: &map,
        given: &given,
        old: &[],
        dt: 1.0,
        load: &[],
    };
    let of_case = |case: usize, m: usize| {
        let mut motion = vec![0.0; places.len()];
        let own = &mut motion[3 * n * case..3 * n * (case + 1)];
        own[..2 * n].copy_from_slice(&rigid::<2>(&points, m));
        own[2 * n..].fill(if m == 2 { 1.0 } else { 0.0 });
        motion
    };
    let free = (0..6).map(|k| of_case(k / 3, k % 3)).collect();
    let pattern = model.pattern_from(&map, 0);
    stiffness_row(
        "remodelling, bonds that shear",
        &step,
        pattern,
        &places,
        free,
    )
}

fn bond_based_row() -> Model {
    let points = points();
    let (map, given, places) = at_rest(&points, 1, 0);
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
        motions::<2>(&points),
    )
}

fn continuum_row(energy: Energy, name: &str) -> Model {
    let points = points();
    let (map, given, places) = at_rest(&points, 1, 0);
    let model = Continuum::new(&points, 1.0, energy, WEIGHT, None);
    let step = continuum::Step {
        model: &model,
        map: &map,
        given: &given,
        old: Old::Nodes(&vec![1.0; points.len()]),
        dt: 1.0,
        load: &[],
    };
    let pattern = model.pattern_from(&map, 0);
    stiffness_row(name, &step, pattern, &places, motions::<2>(&points))
}

pub fn models() -> Vec<Model> {
    let points = points();
    let (motions2, motions3) = (|| motions::<2>(&points), || motions::<3>(&points));
    let constant = || vec![vec![1.0; points.len()]];
    vec![
        bond_based_row(),
        shear_bonds_row(),
        continuum_row(Energy::plane_stress(1.0, 0.3), "remodelling, plane stress"),
        continuum_row(
            Energy::isotropic_bonds(1.0),
            "remodelling, continuum of bonds",
        ),
        continuum_row(Energy::neo_hooke(1.0, 0.3), "remodelling, Neo-Hooke"),
        body_row("central bonds", elastic::<2>(0.0), false, motions2()),
        body_row(
            "central bonds, one broken",
            broken::<2>(0.0),
            false,
            motions2(),
        ),
        body_row("bonds with rotation", elastic::<3>(0.0), false, motions3()),
        body_row(
            "bonds with rotation, one broken",
            broken::<3>(0.0),
            false,
            motions3(),
        ),
        body_row("couple stress", elastic::<3>(0.1), true, motions3()),
        body_row(
            "couple stress, one bond broken",
            broken::<3>(0.1),
            true,
            motions3(),
        ),
        body_row("conduction", conductor(), false, constant()),
        body_row(
            "conduction, piezoresistive",
            strained_conductor(),
            false,
            constant(),
        ),
    ]
}

pub fn noise(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| (i as f64 * 0.7 + seed).sin()).collect()
}
