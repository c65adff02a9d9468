//! Load steps whose lengths follow the curve: few, near many even ones, the same on any number of threads and after a stop.

use super::bodies::{Body, assert_balanced, asymmetric, frame, mesh, von_mises};
use bonepd_ct::physics::hex8::Hex8;
use bonepd_ct::physics::hex8::element::Integration;
use bonepd_ct::physics::hex8::plastic::points::Points;
use bonepd_ct::physics::hex8::plastic::{PlasticBricks, Tissue};
use bonepd_ct::physics::plasticity::Elastic;
use bonepd_ct::pipeline::apparent::discretisation::steps::length::{Adaptive, Lengths};
use bonepd_ct::pipeline::apparent::discretisation::steps::{
    History, Loading, Outcome, Step, Stepping, load,
};
use bonepd_ct::result::strength::{CurvePoint, strength};
use bonepd_ct::solver::amg::{Amg, AmgParams};

const STRAIN: f64 = -0.02;

/// A body with its elastic displacements under the whole load.
fn elastic(body: Body) -> Body {
    let (_, history) = body.load(von_mises(1e9, 0.0), &Body::stepping(1));
    Body {
        ends: history.u,
        ..body
    }
}

fn adaptive(divided: u32) -> Stepping {
    Stepping {
        lengths: Lengths::Adaptive(Adaptive {
            offset: 0.002 / STRAIN.abs(),
            divided,
        }),
        ..Body::stepping(1)
    }
}

/// Yield stress and largest stress, MPa.
fn stresses(body: &Body, history: &History) -> [f64; 2] {
    let point = |s: &Step| CurvePoint {
        strain: STRAIN * s.load,
        stress_mpa: body.stress(s, STRAIN),
        ..CurvePoint::default()
    };
    let curve: Vec<CurvePoint> = history.steps.iter().map(point).collect();
    let whole = body.load(von_mises(1e9, 0.0), &Body::stepping(1)).1;
    let found = strength(
        &curve,
        body.stress(&whole.steps[0], STRAIN).abs() / STRAIN.abs(),
    );
    [found.yield_stress_mpa, found.max_stress_mpa].map(|stress| stress.unwrap().abs())
}

fn waves() -> Body {
    let inside = |at: [usize; 3]| {
        let [x, y, z] = at.map(|v| 0.5 * v as f64 + 0.3);
        (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos()).abs() < 0.6
    };
    Body::block(mesh([12; 3], 0.02, inside), STRAIN, true)
}

fn strut() -> Body {
    let inside = |[x, y, z]: [usize; 3]| (z / 2 + 1..z / 2 + 4).contains(&x) && y > 0;
    Body::block(mesh([9, 4, 10], 0.02, inside), STRAIN, true)
}

/// Half as many steps as ten even ones come as near to forty even ones: within 0.3 % in both stresses.
#[test]
fn few_steps_that_follow_the_curve_are_near_many_even_ones() {
    for (name, body) in [
        ("frame", Body::block(frame(14), STRAIN, true)),
        ("waves", waves()),
        ("strut", strut()),
    ] {
        let (body, law) = (elastic(body), von_mises(68.0, 0.0));
        let (_, even) = body.load(law, &Body::stepping(40));
        let (_, ten) = body.load(law, &Body::stepping(10));
        let (outcome, own) = body.load(law, &adaptive(1));
        assert_eq!(outcome, Outcome::Done, "{name}");
        assert_balanced(&own.steps);
        assert!(own.steps.len() < 9, "{name}: {:?}", own.steps);
        let [truth, ten, found] = [&even, &ten, &own].map(|h| stresses(&body, h));
        for stress in 0..2 {
            let off = [ten, found].map(|s| s[stress] / truth[stress] - 1.0);
            println!(
                "{name}: {} steps, ten even and adaptive off by {off:?}",
                own.steps.len()
            );
            assert!(off[1].abs() < 3e-3, "{name}: {off:?}");
        }
        // The first step ends where flow begins: the curve is straight until there.
        let first = own.steps[0];
        assert!(first.load > 0.1, "{name}: {first:?}");
        let slope = |s: &Step| s.conjugate_nmm / s.load;
        assert!(
            slope(&first) > 0.98 * slope(&even.steps[0]),
            "{name}: {first:?}"
        );
        // Lengths that are divided take more steps.
        assert!(
            body.load(law, &adaptive(2)).1.steps.len() > own.steps.len(),
            "{name}"
        );
    }
}

/// Stopped after every step and gone on with, on one thread and on three: the same bits.
#[test]
fn steps_that_follow_the_curve_go_on_to_the_same_last_digit() {
    let body = elastic(Body::block(frame(14), STRAIN, true));
    let law = von_mises(68.0, 0.0);
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let whole = pool(3).unwrap().install(|| body.load(law, &adaptive(1)).1);
    let stopped = pool(1).unwrap().install(|| {
        let rule = Integration::MeanDilatation;
        let bricks = Hex8::new(body.mesh.clone(), body.young, body.poisson, rule);
        let h = body.mesh.grid.spacing_mm;
        let multigrid = Amg::new(&bricks, &body.held, &AmgParams::new(h));
        let elastic = Elastic::of(body.young, body.poisson);
        let loading = Loading {
            held: &body.held,
            elastic: &body.ends,
            external: None,
        };
        let mut history = History::new(body.mesh.len());
        for _ in 0..whole.steps.len() {
            let tissue = |_: usize| Tissue { elastic, law };
            let again = PlasticBricks::new(&bricks, &body.mesh, Points::new(h, true), tissue);
            load(
                again,
                &loading,
                &multigrid,
                &adaptive(1),
                &mut history,
                |_| false,
            );
        }
        history
    });
    assert_eq!(stopped, whole);
}

#[test]
fn a_share_of_a_strain_is_where_flow_begins() {
    let elastic = Elastic::of(10_000.0, 0.3);
    let strain = [-0.02, 0.004, 0.001, 0.003, -0.002, 0.005];
    for law in [von_mises(68.0, 100.0), asymmetric(50.0, 75.0)] {
        let share = law.share_that_yields(&elastic, &strain);
        let flows = |more: f64| law.yields(&elastic, &strain.map(|e| more * share * e));
        assert!(flows(1.0 + 1e-9) && !flows(1.0 - 1e-9), "{law:?}: {share}");
    }
    // Equal pressure from all sides never reaches the cone.
    let squeezed = [-0.02, -0.02, -0.02, 0.0, 0.0, 0.0];
    let share = asymmetric(50.0, 75.0).share_that_yields(&elastic, &squeezed);
    assert_eq!(share, f64::INFINITY);
}
