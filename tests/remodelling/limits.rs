//! What remodelling scenes refuse, and how they stop.

use super::square::{S2, Square, local_text, simulate};

#[test]
fn a7_noise_settles_where_n_is_below_m_and_n_not_below_m_is_refused() {
    let noisy = |exponent: f64| {
        let model = format!("density = {{ exponent = {exponent:?}, noise = 0.01 }}");
        Square {
            steps: [0.0687; 4],
            end: 6.0,
            ..Square::new(20, 3.01)
        }
        .text()
        .replace("young = 1.0", &format!("young = 1.0\n {model}"))
    };
    for exponent in [2.0, 2.5] {
        let (summary, recorder) = simulate(&noisy(exponent)).unwrap();
        assert!(summary.converged);
        // Settled: the last time unit changes nothing.
        for number in ["mean", "min", "max"] {
            let drift = recorder.at(6.0, number) - recorder.at(5.0, number);
            assert!(drift.abs() < 1e-6, "n = {exponent}, {number}: {drift}");
        }
    }
    for exponent in [3.0, 3.5, 4.0] {
        let words = simulate(&noisy(exponent))
            .map(|_| ())
            .unwrap_err()
            .to_string();
        assert!(words.contains("is not below m = 3"), "{words}");
    }
}

/// Absent physics is free: unknowns per point and what is stored.
#[test]
fn unknowns_per_point() {
    let text = Square {
        end: 0.1,
        ..Square::new(10, 3.01)
    }
    .text();
    let (growing, _) = simulate(&text).unwrap();
    // Density and two placements each, less the pinned x.
    assert_eq!(growing.unknowns, 3 * 100 - 1);
    let elastic = text.replace("growth = { rate = 1000, stimulus = 0.01 }", "");
    let (elastic, recorder) = simulate(&elastic).unwrap();
    assert_eq!(elastic.unknowns, 2 * 100 - 1);
    assert_eq!(recorder.at(0.1, "max"), 0.0);
    // The continuum: nine nodes, six of them held along y, one along x; densities at nodes, at Gauss points, or nowhere.
    let local = local_text(2, S2, false, "");
    let at_gauss = local_text(2, S2, false, "density_at = 'gauss'");
    let rigid = local.replace("growth = { rate = 1000, stimulus = 0.01 }", "");
    for (text, unknowns) in [
        (local, 3 * 9 - 7),
        (at_gauss, 2 * 9 - 7),
        (rigid, 2 * 9 - 7),
    ] {
        let text = text.replace("end = 8.0", "end = 0.1");
        assert_eq!(simulate(&text).unwrap().0.unknowns, unknowns);
    }
}

/// Edges that hold a nodal rectangle stay edges, whatever is dropped from it; a hold's edge is the body's, not that of the
/// layers beyond it.
#[test]
fn what_drops_nothing_changes_nothing() {
    let plain = Square {
        end: 2.0,
        ..Square::new(10, 3.01)
    }
    .text()
    .replace("[grid]", "geometry.rectangle.nodal = true\n[grid]");
    let found = |text: &str| {
        let (summary, recorder) = simulate(text).unwrap();
        (summary.unknowns, recorder.means([2.0]))
    };
    let reference = found(&plain);
    for key in ["keep_largest", "prune"] {
        let text = plain.replace("[grid]", &format!("[grid]\n{key} = true"));
        assert_eq!(found(&text), reference, "{key}");
    }
    let held = |region: &str| {
        let text = Square {
            end: 2.0,
            ..Square::new(10, 3.01)
        }
        .text();
        found(&text.replace("{ point = [0, 0] }", region)).0
    };
    assert_eq!(held("{ edge = 'bottom' }"), 3 * 100 - 10);
    assert_eq!(held("{ point = [0.0, 0.56] }"), 3 * 100 - 1);
}

#[test]
fn a_step_too_large_stops_with_the_last_good_state() {
    let mut square = Square {
        end: 2.0,
        ..Square::new(10, 3.01)
    };
    square.steps = [0.06, 0.07, 0.08, 0.09];
    // The second value turns the square inside out.
    let text = square
        .text()
        .replace("until = [2, 4, 6, 8]", "until = [1, 4, 6, 8]")
        .replace("0.07,", "-0.7,");
    let text = text.replace("step = 0.1", "step = 0.1\n smallest_share = 0.125");
    let (summary, recorder) = simulate(&text).unwrap();
    assert!(!summary.converged);
    let words = summary.stopped.unwrap();
    assert!(words.contains("at t = 1.0"), "{words}");
    assert!(
        recorder.lines.iter().any(|l| l.contains("step halved")),
        "{:?}",
        recorder.lines
    );
    let last = recorder.frames.last().unwrap();
    assert!((last.time - 1.0).abs() < 1e-9 && !last.fields.is_empty());
}

/// Edges that move within the first planned step, and few iterations: it has to be halved, and grows back once they rest.
#[test]
fn a_step_that_halves_and_grows_says_so() {
    let square = Square {
        rows: 4,
        model: "solver = { max_iterations = 5 }",
        ..Square::new(10, 3.01)
    };
    let plain = square.text().replace("step = 0.1", "step = 1.0");
    let (from, to) = (
        plain.find("{ until").unwrap(),
        plain.find("[[hold]]").unwrap(),
    );
    let ramp = "{ times = [0, 1, 20], values = [0, 0.05, 0.05] }\n";
    let text = format!("{}{ramp}{}", &plain[..from], &plain[to..]);
    let (summary, recorder) = simulate(&text).unwrap();
    assert!(summary.converged, "{summary:?}");
    let pace = summary.step_statistics.unwrap();
    let said = |what: &str| recorder.lines.iter().filter(|l| l.contains(what)).count();
    assert!(pace.halvings >= 2 && pace.growths >= 2, "{pace:?}");
    assert_eq!(pace.halvings, said("step halved"), "{:?}", recorder.lines);
    assert_eq!(pace.growths, said("step grown"), "{:?}", recorder.lines);
    let least = 0.5f64.powi(pace.halvings as i32);
    assert_eq!([pace.shortest_step, pace.longest_step], [least, 1.0]);
    let words = pace.to_string();
    assert!(
        words.contains("halved 2 times, grown 2 times; steps taken from 2.500e-1 to 1.000e0"),
        "{words}"
    );
}

#[test]
fn a_step_that_never_changed_has_nothing_to_say() {
    let square = Square {
        end: 0.3,
        rows: 4,
        ..Square::new(10, 3.01)
    };
    let pace = simulate(&square.text()).unwrap().0.step_statistics.unwrap();
    assert!(!pace.changed(), "{pace:?}");
}

fn refusal(text: &str) -> String {
    simulate(text).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn what_cannot_work_is_refused_in_words() {
    let text = Square::new(10, 3.01).text();
    let with = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        refusal(&text.replace(from, to))
    };
    let cases = [
        (with("spacing", "spacng"), "did you mean `spacing`"),
        (with("bond-based", "bond-bsed"), "did you mean `bond-based`"),
        (with("young = 1.0", "young = -1.0"), "young"),
        (
            with("young = 1.0", "young = 1.0\n density = { initial = -0.5 }"),
            "must be positive",
        ),
        (
            with("young = 1.0", "young = 1.0\n density = { noise = 1.5 }"),
            "must stay positive",
        ),
        (
            with("component = 'x'", "component = 'z'"),
            "give \"x\" or \"y\"",
        ),
        (
            with("{ point = [0, 0] }", "{ disc = [9, 9, 1] }"),
            "no point of the geometry",
        ),
        (
            with("size = [1.0, 1.0]", "size = [1.03, 1.0]"),
            "whole number of cells",
        ),
        (with("horizon_ratio = 3.01", "horizon = -1.0"), "δ/Δ"),
        (
            with(
                "young = 1.0",
                "young = 1.0\n micromodulus = { finite = -0.1 }",
            ),
            "micromodulus.finite",
        ),
        (
            with(
                "young = 1.0",
                "young = 1.0\n micromodulus = { finite = 0.0 }",
            ),
            "give a positive one",
        ),
        (with("step = 0.1", "step = 0.3"), "whole number of steps"),
        (
            with("edges = ['bottom', 'top']", "edges = ['top', 'top']"),
            "two opposite edges",
        ),
        (
            with("component = 'x'", "component = 'x'\n value = nan"),
            "give finite numbers",
        ),
        (
            with("[time]", "[output]\n every = 0\n [time]"),
            "output.every",
        ),
        (
            with("[time]", "[output]\n range = [1, -1]\n [time]"),
            "the lowest value, then the highest",
        ),
        (
            with("[time]", "[output]\n times = [nan]\n [time]"),
            "output.times",
        ),
        (
            with(
                "[time]",
                "[[probe]]\n name = 'a,b'\n region = 'all'\n [time]",
            ),
            "probe[0].name",
        ),
        (
            with("size = [1.0, 1.0]", "size = [nan, 1.0]"),
            "expected a positive length",
        ),
    ];
    for (words, expected) in cases {
        assert!(words.contains(expected), "{words}");
    }
    // Without the pinned point nothing holds x.
    let (start, end) = (text.find("[[hold]]").unwrap(), text.find("[time]").unwrap());
    let words = refusal(&format!("{}{}", &text[..start], &text[end..]));
    assert!(words.contains("nothing holds the body along x"), "{words}");
    let pieces = text.replace(
        "geometry.rectangle.size = [1.0, 1.0]",
        "geometry.polygon = { corners = [[0, 0], [1, 0], [1, 1], [0, 1]], holes = [[[-0.1, 0.3], [1.1, 0.3], [1.1, 0.7], [-0.1, 0.7]]] }",
    );
    assert!(refusal(&pieces).contains("2 unconnected pieces"));
}
