//! Bonds that resist shear, forces on bonds, and load cases. References are those of `reports/remodelling/local_limits.py` (one point),
//! which meets those of spec A3 to all digits at ν = 1/3.

use super::square::{S2, SIX_DIGITS, Square, assert_near, local_text, simulate};
use super::tangent::tangent_errors;
use bonepd_ct::discretisation::plane::Points;
use bonepd_ct::discretisation::plane::family::{Family, Stencil};
use bonepd_ct::operator::reduction::{Reduction, Value};
use bonepd_ct::physics::bond_based::shear::{Micromoduli, ShearBonds, ShearStep};
use bonepd_ct::physics::growth::{Growth, Weight};
use bonepd_ct::scene::frame::Values;

/// Two cases of 20 points away from symmetry, densities unlike: all four blocks, and with points that do not turn.
#[test]
fn the_tangent_is_exact_for_bonds_that_shear() {
    let points = Points::from_box([0.0; 2], 0.2, [5, 4], |_| true);
    let n = points.len();
    let stencil = Stencil::new(0.2, 0.402, true).unwrap();
    for (turns, poisson) in [(true, 0.1), (false, 1.0 / 3.0)] {
        let model = ShearBonds {
            micromoduli: Micromoduli::discrete(1.0, poisson, &stencil),
            family: Family::new(&points, n, stencil.clone()),
            young: 1.0,
            weight: Weight {
                reference: 1.1,
                exponent: 2.0,
            },
            growth: Some(Growth {
                reference: 1.1,
                rate: 1000.0,
                stimulus: 0.01,
                exponent: 3.0,
                floor: f64::NEG_INFINITY,
            }),
            shares: None,
            points: n,
            cases: vec![0.3, 0.7],
            turns,
        };
        let stride = if turns { 3 * n } else { 2 * n };
        let mut roles = vec![Value::Free; n + 2 * stride];
        roles[n] = Value::Held;
        let map = Reduction::new(&roles);
        let wobble = |k: usize| ((k * 7919 % 101) as f64 / 101.0 - 0.5) * 0.06;
        let rest = |v: usize| match v.checked_sub(n) {
            None => 1.0,
            Some(v) if v % stride >= 2 * n => 0.02,
            Some(v) => {
                let (p, axis) = (v % stride / 2, v % 2);
                let grown = [[0.97, 1.12], [1.09, 0.95]][v / stride][axis];
                points.position(p)[axis] * grown
            }
        };
        let given: Vec<f64> = (0..map.values())
            .map(|v| {
                if map.unknown(v).is_none() {
                    rest(v)
                } else {
                    0.0
                }
            })
            .collect();
        let q: Vec<f64> = (0..map.unknowns())
            .map(|k| rest(map.equation(k)) + 0.2 * wobble(k))
            .collect();
        let old: Vec<f64> = (0..n).map(|k| 1.0 + wobble(k + 3)).collect();
        let load: Vec<f64> = (0..map.values()).map(|k| 0.01 * wobble(k)).collect();
        let step = ShearStep {
            model: &model,
            map: &map,
            given: &given,
            old: &old,
            dt: 0.1,
            load: &load,
        };
        let errors = tangent_errors(&step, model.pattern_from(&map, 0), &q);
        // Central differences of step 1e-6 leave some 1e-9.
        assert!(errors.iter().all(|e| *e < 1e-7), "{errors:?}");
    }
}

const TIMES: [f64; 4] = [2.0, 4.0, 6.0, 8.0];

/// ν, the limit in a full circle, and along the stencil of δ/Δ = 3.01.
const LIMITS: [(f64, [f64; 4], [f64; 4]); 2] = [
    (
        0.2,
        [-0.274804, 0.135143, 0.637484, 1.232476],
        [-0.267624, 0.146298, 0.653460, 1.254099],
    ),
    (
        0.3,
        [-0.265229, 0.153539, 0.668758, 1.281314],
        [-0.251916, 0.174316, 0.698685, 1.322084],
    ),
];

#[test]
fn local_limits_of_bonds_that_shear() {
    for (poisson, circle, stencil) in LIMITS {
        for (law, exact) in [("isotropic-bonds", circle), ("stencil-bonds", stencil)] {
            let model = format!("energy = '{law}'\n poisson = {poisson:?}");
            let found = simulate(&local_text(1, S2, false, &model)).unwrap().1;
            assert_near(found.means(TIMES), exact, SIX_DIGITS);
        }
    }
}

/// With δ/Δ fixed, the square tends to the limit of its stencil in first order of δ, as at ν = 1/3.
#[test]
fn peridynamics_tends_to_the_limit_of_its_poissons_ratio() {
    for (poisson, _, [.., limit]) in LIMITS {
        let at = |n: usize| {
            let square = Square {
                rows: 4,
                ..Square::new(n, 3.01)
            };
            let text = square.text().replace(
                "young = 1.0",
                &format!("young = 1.0\n poisson = {poisson:?}"),
            );
            let (summary, recorder) = simulate(&text).unwrap();
            // Density, two placements and a rotation, less the pinned x.
            assert_eq!(summary.unknowns, 4 * 4 * n - 1);
            recorder.at(8.0, "mean") - limit
        };
        let (coarse, fine) = (at(20), at(40));
        // At ν = 1/3: -0.0681 and -0.0340.
        assert!(
            coarse < -0.02 && (coarse / fine - 2.0).abs() < 0.03,
            "{poisson}: {coarse} {fine}"
        );
    }
}

/// A bar of height 1 and length 3, `n` points high, pulled by a force, without growth unless `model` has it.
pub fn bar(n: usize, force: f64, model: &str) -> String {
    let h = 1.0 / n as f64;
    format!(
        "title = 'pulled bar'
         geometry.rectangle.size = [3.0, 1.0]
         [grid]
         spacing = {h:?}
         horizon_ratio = 3.01
         [[hold]]
         region = {{ box = [-1.5, -0.5, {left:?}, 0.5] }}
         component = 'x'
         [[hold]]
         region = {{ point = [-1.5, 0.0] }}
         component = 'y'
         [[load]]
         region = {{ box = [{right:?}, -0.5, 1.5, 0.5] }}
         component = 'x'
         value = {{ times = [0, 1], values = [0, {force:?}] }}
         [[probe]]
         name = 'a'
         region = {{ box = [{a0:?}, -0.5, {a1:?}, 0.5] }}
         [[probe]]
         name = 'b'
         region = {{ box = [{b0:?}, -0.5, {b1:?}, 0.5] }}
         [[probe]]
         name = 'end'
         region = {{ box = [{right:?}, -0.5, 1.5, 0.5] }}
         [time]
         end = 1.0
         step = 0.5
         [physics.bond-based]
         young = 1.0
         {model}",
        left = -1.5 + 1.01 * h,
        right = 1.5 - 1.01 * h,
        a0 = -0.5 - 1.01 * h,
        a1 = -0.5 + 0.01 * h,
        b0 = 0.5 - 0.01 * h,
        b1 = 0.5 + 1.01 * h,
    )
}

/// A force strains a bar by force/(E height), E the stencil's along its axis (1.010229 at ν = 0.2, 1.022628 at 1/3, by the prototype):
/// to first order in δ, as its edges are soft.
#[test]
fn a_force_stretches_a_bar_of_bonds() {
    let force = 1e-5;
    for (model, young) in [("poisson = 0.2", 1.010229), ("", 1.022628)] {
        let error = |n: usize| {
            let (summary, recorder) = simulate(&bar(n, force, model)).unwrap();
            assert!(summary.converged, "{summary:?}");
            let strain =
                (recorder.at(1.0, "b.ux") - recorder.at(1.0, "a.ux")) / (1.0 + 1.0 / n as f64);
            strain * young / force - 1.0
        };
        let (coarse, fine) = (error(10), error(20));
        assert!(
            coarse > 0.02 && coarse < 0.3 && (coarse / fine - 2.0).abs() < 0.3,
            "{model}: {coarse} {fine}"
        );
    }
}

/// Where growth has settled, Ψ = Ψ* (ρ/ρ*)³ at every point; and the energy in all is half the work of a force at small strain
/// (Clapeyron), to the strain, some 2e-3.
#[test]
fn bone_under_a_force_settles_where_energy_is_half_the_work() {
    let force = 1e-3;
    for more in [
        "poisson = 0.2",
        "poisson = 0.2\n solver = { method = 'reuse', tolerance = 1e-9 }",
        "",
    ] {
        let model = format!("{more}\n growth = {{ rate = 1e6, stimulus = 5e-7 }}");
        let text = bar(6, force, &model).replace("end = 1.0\n", "end = 60.0\n");
        let (summary, recorder) = simulate(&text).unwrap();
        assert!(summary.converged, "{summary:?}");
        let Values::Scalar(change) = &recorder.frames.last().unwrap().fields[0].values else {
            panic!("densities are scalars");
        };
        let energy: f64 = change.iter().map(|c| 5e-7 * (1.0 + c).powi(3) / 36.0).sum();
        let work = 0.5 * force * recorder.at(60.0, "end.ux");
        assert!(
            (energy / work - 1.0).abs() < 0.01,
            "{more}: {energy} {work}"
        );
    }
}

fn last_change(text: &str) -> Vec<f64> {
    let (summary, recorder) = simulate(text).unwrap();
    assert!(summary.converged, "{summary:?}");
    match &recorder.frames.last().unwrap().fields[0].values {
        Values::Scalar(change) => change.clone(),
        Values::Vector(_) => panic!("densities are scalars"),
    }
}

/// Two cases alike are one. A case at rest of weight 3 takes three quarters of the stimulus: Ψ/4 - Ψ* is a quarter of the rate at four
/// times Ψ*.
#[test]
fn load_cases_weigh_energies() {
    let (force, growth) = (1e-3, "growth = { rate = 1e5, stimulus = 5e-7 }");
    for poisson in ["poisson = 0.2", ""] {
        let one = last_change(&bar(6, force, &format!("{poisson}\n {growth}")));
        let cases = |weights: [f64; 2]| {
            format!(
                "{poisson}\n cases = [{{ name = 'a', weight = {:?} }}, {{ name = 'b', weight = {:?} }}]",
                weights[0], weights[1]
            )
        };
        let both = last_change(&bar(6, force, &format!("{}\n {growth}", cases([2.0, 5.0]))));
        let near = |x: &[f64], y: &[f64]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-8);
        assert!(near(&one, &both), "{poisson}");
        let idle = "[[load]]\n region = { point = [0, 0] }\n component = 'x'\n case = 'b'\n value = 0\n [[probe]]\n name = 'a'";
        let text = bar(6, force, &format!("{}\n {growth}", cases([1.0, 3.0])))
            .replace(
                "component = 'x'\n         value = { times",
                "component = 'x'\n case = 'a'\n value = { times",
            )
            .replacen("[[probe]]\n         name = 'a'", idle, 1);
        assert!(text.contains("case = 'a'") && text.contains("case = 'b'"));
        let slow = "growth = { rate = 2.5e4, stimulus = 2e-6 }";
        let alone = last_change(&bar(6, force, &format!("{poisson}\n {slow}")));
        assert!(near(&alone, &last_change(&text)), "{poisson}");
        assert!(!near(&alone, &one));
    }
}

/// Neo-Hooke and St. Venant-Kirchhoff have the same limit of small strain; at the strains of the square they differ.
#[test]
fn neo_hooke_meets_st_venant_kirchhoff_at_small_strain() {
    let at = |steps: [f64; 4], law: &str| {
        let text = local_text(1, steps, false, law).replace(
            "stimulus = 0.01",
            &format!("stimulus = {:e}", 0.01 * (steps[0] / 0.06).powi(2)),
        );
        simulate(&text.replace(
            "rate = 1000",
            &format!("rate = {:e}", 1000.0 * (0.06 / steps[0]).powi(2)),
        ))
        .unwrap()
        .1
        .means(TIMES)
    };
    let (neo, law) = ("energy = 'neo-hooke'\n poisson = 0.2", "poisson = 0.2");
    let small = S2.map(|u| 1e-3 * u);
    assert_near(at(small, neo), at(small, law), 2e-3);
    let far = at(S2, neo)[3] - at(S2, law)[3];
    assert!(far.abs() > 0.1, "{far}");
}

#[test]
fn what_bonds_cannot_do_is_refused_in_words() {
    for (model, words) in [
        ("poisson = 0.4", "to 1/3"),
        ("poisson = nan", "physics.bond-based.poisson"),
        (
            "poisson = 0.2\n micromodulus = { finite = 0.1 }",
            "micromodulus.finite",
        ),
        ("cases = [{ name = 'a', weight = 0 }]", "cases[0].weight"),
        (
            "cases = [{ name = 'a', weight = 1 }, { name = 'a', weight = 1 }]",
            "a name of its own",
        ),
    ] {
        let error = simulate(&bar(6, 1e-3, model))
            .map(|_| ())
            .unwrap_err()
            .to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let unnamed = bar(6, 1e-3, "").replace("value = { times", "case = 'b'\n value = { times");
    let named = bar(6, 1e-3, "cases = [{ name = 'a', weight = 1 }]")
        .replace("value = { times", "case = 'b'\n value = { times");
    for (text, words) in [
        (unnamed, "has load cases"),
        (named, "no [[load]] belongs to case"),
    ] {
        let error = simulate(&text).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{words}: {error}");
    }
    let bonds = simulate(&local_text(
        1,
        S2,
        false,
        "energy = 'stencil-bonds'\n poisson = 0.4",
    ));
    assert!(
        bonds
            .map(|_| ())
            .unwrap_err()
            .to_string()
            .contains("which no bonds have")
    );
}
