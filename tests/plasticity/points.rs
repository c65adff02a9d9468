//! The table of laws of yield, and what every one of them must obey. A new law is one row.

use bonepd_ct::physics::plasticity::{
    DruckerPrager, Elastic, Point, Response, Tensor, VonMises, YieldLaw,
};

const YOUNG: f64 = 10_000.0;

fn elastic() -> Elastic {
    Elastic::of(YOUNG, 0.3)
}

fn von_mises(hardening_mpa: f64) -> YieldLaw {
    YieldLaw::VonMises(VonMises {
        yield_mpa: 68.0,
        hardening_mpa,
    })
}

fn asymmetric(hardening_mpa: f64) -> YieldLaw {
    YieldLaw::Asymmetric(DruckerPrager {
        tension_mpa: 50.0,
        compression_mpa: 75.0,
        hardening_mpa,
    })
}

fn laws() -> [YieldLaw; 4] {
    [
        von_mises(0.0),
        von_mises(500.0),
        asymmetric(0.0),
        asymmetric(500.0),
    ]
}

/// Strains of all kinds, some beyond the tip of a cone, and a state that has flowed.
fn cases() -> Vec<(Tensor, Point)> {
    let flowed = Point {
        plastic_strain: [0.002, -0.001, -0.001, 0.001, 0.0, -0.002],
        hardening: 0.003,
    };
    let strains = [
        [0.01, -0.003, -0.003, 0.0, 0.0, 0.0],
        [-0.02, 0.004, 0.005, 0.01, -0.003, 0.002],
        [0.001, 0.002, -0.003, 0.02, 0.01, -0.01],
        [0.02, 0.021, 0.019, 0.001, 0.0, 0.0005],
        [0.0005, 0.0, 0.0, 0.0, 0.0, 0.0],
    ];
    let each = strains.into_iter();
    each.flat_map(|e| [(e, Point::default()), (e, flowed)])
        .collect()
}

fn tangent(response: &Response) -> [Tensor; 6] {
    response.softening.unwrap_or_default().tangent(&elastic())
}

#[test]
fn the_tangent_is_the_derivative_of_the_stress_and_symmetric() {
    for law in laws() {
        for (strain, before) in cases() {
            let here = tangent(&law.respond(&elastic(), &strain, &before));
            for j in 0..6 {
                let moved = |step: f64| {
                    let mut strain = strain;
                    strain[j] += step;
                    law.respond(&elastic(), &strain, &before).stress
                };
                // Central differences: the step squared times the curvature, some 1e-6 of the modulus.
                let step = 1e-7;
                let (above, below) = (moved(step), moved(-step));
                for i in 0..6 {
                    let slope = (above[i] - below[i]) / (2.0 * step);
                    assert!(
                        (slope - here[i][j]).abs() < 1e-4 * YOUNG,
                        "{law:?} {strain:?} {i} {j}: {slope} {}",
                        here[i][j]
                    );
                    assert!((here[i][j] - here[j][i]).abs() < 1e-12 * YOUNG);
                }
            }
        }
    }
}

/// Stress does no negative work on the plastic strain of a step, and lies on the yield surface.
#[test]
fn flow_dissipates_and_ends_on_the_surface() {
    let mut flowed = 0;
    for law in laws() {
        for (strain, before) in cases() {
            let found = law.respond(&elastic(), &strain, &before);
            let change = |i: usize| found.after.plastic_strain[i] - before.plastic_strain[i];
            let dissipated: f64 = (0..6).map(|i| found.stress[i] * change(i)).sum();
            assert!(dissipated >= 0.0, "{law:?} {strain:?}: {dissipated}");
            if found.softening.is_some() {
                flowed += 1;
                assert!(dissipated > 0.0 && found.after.hardening > before.hardening);
                // The same strain again is elastic from there: nothing is left to flow but rounding.
                let again = law.respond(&elastic(), &strain, &found.after);
                let more = again.after.hardening - found.after.hardening;
                assert!(more < 1e-12, "{law:?} {strain:?}: {more}");
            }
        }
    }
    assert!(flowed > 20, "{flowed}");
}

/// Strains a uniaxial rod in small steps: axial strain is given, lateral stress is none.
fn rod(law: &YieldLaw, ends: &[f64]) -> Vec<f64> {
    let (mut point, mut side, mut axial) = (Point::default(), 0.0, 0.0);
    let mut stresses = Vec::new();
    for &end in ends {
        let steps = 40;
        let start = axial;
        for k in 1..=steps {
            axial = start + (end - start) * f64::from(k) / f64::from(steps);
            let mut found = law.respond(&elastic(), &[axial, side, side, 0.0, 0.0, 0.0], &point);
            for _ in 0..30 {
                let t = tangent(&found);
                side -= found.stress[1] / (t[1][1] + t[1][2]);
                found = law.respond(&elastic(), &[axial, side, side, 0.0, 0.0, 0.0], &point);
            }
            point = found.after;
            stresses.push(found.stress[0]);
        }
    }
    stresses
}

#[test]
fn both_uniaxial_yield_stresses_are_exact() {
    for (law, tension, compression) in [(von_mises(0.0), 68.0, 68.0), (asymmetric(0.0), 50.0, 75.0)]
    {
        for (sign, expected) in [(1.0, tension), (-1.0, compression)] {
            let last = *rod(&law, &[sign * 0.02]).last().unwrap();
            assert!(
                (last - sign * expected).abs() < 1e-6 * expected,
                "{law:?}: {last}"
            );
        }
    }
}

/// Over plastic strain the slope is the hardening modulus, over strain E H / (E + H); of the cone in compression.
#[test]
fn hardening_has_its_slope_and_unloading_is_elastic() {
    for (law, first) in [(von_mises(500.0), 68.0), (asymmetric(500.0), 75.0)] {
        let stresses = rod(&law, &[-0.02, -0.018]);
        let slope = YOUNG * 500.0 / (YOUNG + 500.0);
        let expected = -first - slope * (0.02 - first / YOUNG);
        assert!(
            (stresses[39] - expected).abs() < 1e-6 * first,
            "{law:?}: {}",
            stresses[39]
        );
        let back = (stresses[79] - stresses[39]) / 0.002;
        assert!((back - YOUNG).abs() < 1e-6 * YOUNG, "{law:?}: {back}");
    }
}

#[test]
fn numbers_that_are_no_law_are_refused() {
    let cone = |t, c, h| {
        YieldLaw::Asymmetric(DruckerPrager {
            tension_mpa: t,
            compression_mpa: c,
            hardening_mpa: h,
        })
    };
    for law in [
        von_mises(-1.0),
        YieldLaw::VonMises(VonMises {
            yield_mpa: 0.0,
            hardening_mpa: 0.0,
        }),
        cone(0.0, 5.0, 0.0),
        cone(6.0, 5.0, 0.0),
        cone(3.0, f64::NAN, 0.0),
        cone(3.0, 5.0, f64::INFINITY),
    ] {
        assert!(law.wrong().is_some(), "{law:?}");
    }
    assert!(laws().iter().all(|law| law.wrong().is_none()));
}
