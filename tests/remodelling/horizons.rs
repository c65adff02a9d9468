//! Peridynamics on the unit square at fixed ratio and at fixed horizon (figures 4 and 5 of Schaller et al. 2022).

use super::square::{
    CONTINUOUS, S1, S2, SIX_DIGITS, Square, assert_near, continuum_square, local_text, simulate,
};

#[test]
fn a4_fixed_ratio() {
    let times = [0.1, 1.0, 2.0, 4.0, 6.0, 8.0];
    let disc = [
        -0.144619, -0.267143, -0.267200, 0.151335, 0.666871, 1.280507,
    ];
    let square = Square::new(20, 3.01);
    assert_near(square.run().means(times), disc, SIX_DIGITS);
    let cont = [
        -0.131664, -0.244776, -0.244837, 0.186471, 0.717730, 1.350028,
    ];
    let found = Square {
        model: CONTINUOUS,
        rows: 4,
        ..square
    }
    .run()
    .means(times);
    assert_near(found, cont, SIX_DIGITS);
    let cont = [
        -0.144968, -0.266905, -0.266962, 0.151472, 0.666734, 1.279865,
    ];
    let found = Square {
        model: CONTINUOUS,
        rows: 4,
        ..Square::new(10, 3.01)
    }
    .run()
    .means(times);
    assert_near(found, cont, SIX_DIGITS);
    let disc = [
        -0.138066, -0.256407, -0.256466, 0.168315, 0.691613, 1.314552,
    ];
    let found = Square {
        rows: 4,
        ..Square::new(40, 3.01)
    }
    .run();
    assert_near(found.means(times), disc, SIX_DIGITS);
}

#[test]
fn a4_range_of_densities() {
    let found = Square {
        rows: 4,
        ..Square::new(20, 3.01)
    }
    .run();
    let range = [found.at(8.0, "min"), found.at(8.0, "max")].map(|v| v + 1.0);
    assert_near(range, [1.921276, 2.348588], SIX_DIGITS);
}

/// All rows of the square move alike under affine layers, so a strip of it has the same densities.
#[test]
fn a_strip_of_the_square_is_the_square() {
    let times = [2.0, 4.0];
    let whole = Square {
        end: 4.0,
        ..Square::new(10, 3.01)
    };
    let strip = Square {
        end: 4.0,
        rows: 3,
        ..Square::new(10, 3.01)
    };
    assert_near(strip.run().means(times), whole.run().means(times), 1e-9);
}

/// Schedule S1. First order in delta towards the lattice's local limit: the error halves with delta.
#[test]
fn a4_first_order_in_delta() {
    let times = [2.0, 4.0, 6.0, 8.0];
    let strip = |n| {
        Square {
            steps: S1,
            rows: 4,
            ..Square::new(n, 3.01)
        }
        .run()
        .means(times)
    };
    let found = [10, 20, 40].map(strip);
    assert_near(
        found[0],
        [-0.686140, 0.273539, 1.901382, 4.179093],
        SIX_DIGITS,
    );
    assert_near(
        found[1],
        [-0.676759, 0.312335, 1.990899, 4.337729],
        SIX_DIGITS,
    );
    assert_near(
        found[2],
        [-0.672068, 0.331732, 2.035655, 4.417042],
        SIX_DIGITS,
    );
    let limit = continuum_square(1, S1, false, "energy = 'stencil-bonds'").means(times);
    assert_near(limit, [-0.667378, 0.351129, 2.080410, 4.496355], SIX_DIGITS);
    for k in 0..4 {
        let error = found.map(|f| (f[k] - limit[k]).abs());
        // Least squares of log2(error) over log2(delta): three points one octave apart.
        let rate = 0.5 * (error[0] / error[2]).log2();
        // Measured 1.000 to 1.002.
        assert!((rate - 1.0).abs() < 0.01, "rate {rate} at t = {}", times[k]);
    }
    let circle = continuum_square(1, S1, false, "energy = 'isotropic-bonds'").means(times);
    assert_near(
        circle,
        [-0.674494, 0.322677, 2.016057, 4.383770],
        SIX_DIGITS,
    );
    // The gap to St. Venant-Kirchhoff stays: it is constitutive.
    let stvk = continuum_square(1, S1, false, "").means(times);
    assert_near(stvk, [-0.653888, 0.492966, 2.602380, 5.741504], SIX_DIGITS);
    assert!(stvk[3] - limit[3] > 1.2);
}

#[test]
fn a5_fixed_horizon() {
    let times = [2.0, 4.0, 6.0, 8.0];
    let cases = [
        (
            20,
            2.01,
            [-0.123177, 0.374219, 0.984688, 1.708421],
            [-0.089712, 0.426664, 1.060393, 1.811534],
        ),
        (
            25,
            2.5125,
            [-0.260857, 0.161208, 0.680970, 1.299454],
            [-0.209076, 0.242556, 0.798705, 1.460340],
        ),
        (
            30,
            3.015,
            [-0.260044, 0.162655, 0.683365, 1.303204],
            [-0.241250, 0.192186, 0.726114, 1.361639],
        ),
        (
            40,
            4.02,
            [-0.260139, 0.162365, 0.682697, 1.301899],
            [-0.298530, 0.102051, 0.595395, 1.182559],
        ),
        (
            50,
            5.025,
            [-0.308506, 0.087489, 0.575894, 1.158010],
            [-0.285118, 0.124270, 0.629187, 1.230939],
        ),
    ];
    for (n, ratio, disc, cont) in cases {
        let strip = || Square {
            rows: 6,
            ..Square::new(n, ratio)
        };
        assert_near(strip().run().means(times), disc, SIX_DIGITS);
        let found = Square {
            model: CONTINUOUS,
            ..strip()
        }
        .run()
        .means(times);
        assert_near(found, cont, SIX_DIGITS);
    }
}

/// A horizon that does not divide the unit square: the nearest whole number of cells.
#[test]
fn a5_fixed_horizon_on_nearly_unit_squares() {
    let cases = [
        (
            13,
            2.01,
            [-0.127910, 0.366719, 0.973746, 1.693360],
            [-0.094627, 0.418878, 1.049034, 1.795905],
        ),
        (
            27,
            4.02,
            [-0.267577, 0.150640, 0.665669, 1.278543],
            [-0.305582, 0.090934, 0.579250, 1.160410],
        ),
    ];
    for (n, ratio, disc, cont) in cases {
        for (model, reference) in [("", disc), (CONTINUOUS, cont)] {
            let mut square = Square {
                rows: 6,
                model,
                ..Square::new(n, ratio)
            };
            square.delta = 0.1505 / ratio;
            let side = n as f64 * square.delta;
            square.steps = S2.map(|u| u * side);
            let found = square.run().means([2.0, 4.0, 6.0, 8.0]);
            assert_near(found, reference, SIX_DIGITS);
        }
    }
}

/// Shares of the neighbours' volumes (Hu's rule) in a scene: first order in delta too, towards the local limit of that stencil.
#[test]
fn partial_volumes_have_a_local_limit_of_their_own() {
    let times = [2.0, 4.0, 6.0, 8.0];
    let shared = |text: String| {
        text.replace(
            "horizon_ratio = 3.01",
            "horizon_ratio = 3.01\n partial_volumes = true",
        )
    };
    let strip = |n| {
        let square = Square {
            rows: 4,
            ..Square::new(n, 3.01)
        };
        simulate(&shared(square.text())).unwrap().1.means(times)
    };
    let found = [10, 20, 40].map(strip);
    let text = local_text(1, S2, false, "energy = 'stencil-bonds'");
    let limit = simulate(&shared(text.clone())).unwrap().1.means(times);
    let whole = simulate(&text).unwrap().1.means(times);
    for k in 0..4 {
        assert!((limit[k] - whole[k]).abs() > 1e-3, "{limit:?} {whole:?}");
        let error = found.map(|f| (f[k] - limit[k]).abs());
        let rate = 0.5 * (error[0] / error[2]).log2();
        assert!((rate - 1.0).abs() < 0.01, "{rate}: {error:?}");
    }
}

/// The paper's steps take Newton's method two or three iterations each, six at most.
#[test]
fn the_papers_steps_take_few_iterations() {
    for (steps, most) in [(S2, 3.0), (S1, 4.0)] {
        let square = Square {
            steps,
            rows: 4,
            model: "solver = { max_iterations = 6 }",
            ..Square::new(20, 3.01)
        };
        let (summary, recorder) = simulate(&square.text()).unwrap();
        assert!(
            summary.converged && !summary.step_statistics.unwrap().changed(),
            "{:?}",
            recorder.lines
        );
        assert_eq!(summary.steps, 80);
        let iterations = summary
            .numbers
            .iter()
            .find(|(n, _)| n == "iterations")
            .unwrap()
            .1;
        assert!(iterations <= most * 80.0, "{iterations}");
    }
}

/// Steps that grow as densities settle: few, and near what short ones find.
#[test]
fn long_steps_stay_near_short_ones() {
    let square = Square {
        steps: [0.06; 4],
        rows: 4,
        ..Square::new(10, 3.01)
    };
    let short = square.run();
    let text = square
        .text()
        .replace("step = 0.1", "step = 0.1\n tolerance = 1e-4");
    let (summary, long) = simulate(&text).unwrap();
    assert!(summary.converged && summary.steps < 40, "{}", summary.steps);
    // The last output is the end itself.
    assert_near(long.means([8.0]), short.means([8.0]), 2e-4);
    assert_eq!(long.frames.last().unwrap().time, 8.0);
}
