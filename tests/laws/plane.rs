//! The laws every model of the plane must obey.

mod rows;

use rows::{Model, models, noise, points};

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

/// Forces of any temperature balance. In free expansion, uniform along any axes and linear where it is alike both ways, they are those of
/// the expanded body: it carries nothing, whichever of its bonds are left. (Linear temperatures turn points unalike, which bending resists.)
#[test]
fn heat_strains_a_free_body_without_stress() {
    let points = points();
    let uniform = |_: [f64; 2]| 2.0;
    let linear = |[x, y]: [f64; 2]| 2.0 + 0.5 * x - 0.3 * y;
    // Displacements and rotation under the temperatures 2 and 2 + g x + h y.
    let along_axes = |[x, y]: [f64; 2]| [2.0 * (0.3 * x + 0.1 * y), 2.0 * (0.1 * x - 0.2 * y), 0.0];
    let alike = |[x, y]: [f64; 2]| {
        let (g, h) = (0.5, -0.3);
        [
            0.4 * (2.0 * x + 0.5 * g * (x * x - y * y) + h * x * y),
            0.4 * (2.0 * y + 0.5 * h * (y * y - x * x) + g * x * y),
            0.4 * (g * y - h * x),
        ]
    };
    type Place<T> = fn([f64; 2]) -> T;
    type Case = ([f64; 3], Place<f64>, Place<[f64; 3]>);
    let cases: [Case; 2] = [
        ([0.3, -0.2, 0.1], uniform, along_axes),
        ([0.4, 0.4, 0.0], linear, alike),
    ];
    let (mut rows, at) = (0, points.positions());
    for m in models() {
        let Some(heat) = &m.heat else { continue };
        rows += 1;
        let forces = heat([0.3, -0.2, 0.1], noise(at.len(), 0.7));
        let scale = forces.iter().fold(0.0f64, |m, f| m.max(f.abs()));
        assert!(scale > 0.0, "{}", m.name);
        for motion in &m.free {
            let sum = dot(motion, &forces).abs();
            assert!(
                sum < 1e-12 * scale * forces.len() as f64,
                "{}: {sum:e}",
                m.name
            );
        }
        let values = m.diagonal.len() / at.len();
        let some = if m.bends { 1 } else { 2 };
        for (expansion, temperature, expanded) in cases.into_iter().take(some) {
            let forces = heat(expansion, at.iter().map(|p| temperature(*p)).collect());
            let moved = |p: &[f64; 2]| expanded(*p).into_iter().take(values);
            let taken = (m.apply)(&at.iter().flat_map(moved).collect::<Vec<_>>());
            let off = forces.iter().zip(&taken).map(|(f, t)| (f - t).abs());
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-12 * scale, "{}: {off:e} of {scale:e}", m.name);
        }
    }
    assert_eq!(rows, 6);
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
