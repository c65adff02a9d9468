//! Hard cases of the planar physics: each ends within its bound or is refused in words.
//! `cargo test --release planar_cases -- --nocapture` prints the table of reports/stability.md.

use super::Kept;
use bonepd_ct::scene::setting::Inputs;
use bonepd_ct::scene::{Scene, run};
use std::path::Path;

enum End {
    /// Relative difference from the known field at most.
    Within(f64),
    /// Words of the refusal.
    Refused(&'static str),
    /// Either: micromoduli are negative in some directions, and whether the body is stable nevertheless is for the solver to find.
    Either(f64, &'static str),
}

/// A rectangle of points, its rim held at a field that is in equilibrium, calibrated: what is left is rounding times the condition.
fn rectangle(size: [u32; 2], ratio: f64, field: &str, physics: &str) -> String {
    let [w, h] = size;
    format!(
        "title = 'hard'
        [geometry.rectangle]
        size = [{w}, {h}]
        [grid]
        spacing = 1
        horizon_ratio = {ratio}
        partial_volumes = true
        [physics.continuum-molecular]
        correct_surfaces = false
        known = [{{ region = {{ outside = [0, 0, {}] }}, field = {{ {field} }} }}]
        {physics}",
        f64::from(w.min(h)) / 2.0 - ratio - 0.5
    )
}

fn elastic(ratio: f64, more: &str) -> String {
    let physics = format!("elasticity = {{ calibrated = true, {more} }}");
    rectangle([24, 24], ratio, "strain = [1, -0.4, 0.3]", &physics)
}

fn heat(ratio: f64, more: &str) -> String {
    let physics = format!("conduction = {{ calibrated = true, {more} }}");
    rectangle(
        [24, 24],
        ratio,
        "polynomial = [[1, 0, 1], [0, 1, -0.5]]",
        &physics,
    )
}

/// One row of points, pulled at its ends.
fn row(poisson: f64) -> String {
    format!(
        "title = 'row'
        hold = [{{ region = {{ edge = 'left' }}, component = 'x' }}, {{ region = {{ edge = 'left' }}, component = 'y' }},
                {{ region = {{ edge = 'right' }}, component = 'x', value = 1 }}, {{ region = {{ edge = 'right' }}, component = 'y' }}]
        [geometry.rectangle]
        size = [20, 1]
        [grid]
        spacing = 1
        horizon_ratio = 3
        [physics.continuum-molecular]
        elasticity = {{ young = 1, poisson = {poisson} }}"
    )
}

fn cases() -> Vec<(String, String, End)> {
    use End::{Either, Refused, Within};
    let mut all = Vec::new();
    let mut add = |what: String, text: String, end| all.push((what, text, end));
    // Bounds: rounding, 1e-16, times the condition of the matrix, some 1e3 for these sizes and more where C66 or C11 goes to infinity.
    for (poisson, plane) in [
        (-0.99, "stress"),
        (0.0, "stress"),
        (1.0 / 3.0, "stress"),
        (0.49, "stress"),
        (0.9, "stress"),
        (0.25, "strain"),
        (0.45, "strain"),
        (0.499, "strain"),
    ] {
        let more = format!("young = 1, poisson = {poisson}, plane = '{plane}'");
        let limit = if plane == "stress" { 1.0 / 3.0 } else { 0.25 };
        // Calibrated, k_t is negative in some directions at the limit already.
        let end = match poisson < limit - 0.01 {
            true => Within(1e-11),
            false => Either(1e-9, "positive definite"),
        };
        let what = format!("nu {poisson:.3}, plane {plane}, m = 3");
        add(what, elastic(3.0, &more), end);
    }
    let isotropic = "young = 1, poisson = 0.2";
    for (ratio, end) in [
        (1.0, Either(1e-11, "directions")),
        (2.0, Within(1e-11)),
        (8.0, Within(1e-11)),
    ] {
        let what = format!("horizon of {ratio} points");
        add(what, elastic(ratio, isotropic), end);
    }
    for stiff in [1e2, 1e4] {
        let more = format!("moduli = [{stiff}, 1, 0.2, 0.4, 0, 0]");
        let what = format!("moduli {stiff:e} : 1, m = 5");
        add(what, elastic(5.0, &more), Either(1e-9, "positive definite"));
        let more = format!("conductivity = [{stiff}, 1, 0], exponent = 2");
        let what = format!("conductivity {stiff:e} : 1, n = 2");
        add(what, heat(3.0, &more), Either(1e-9, "positive definite"));
    }
    // Points in a row may turn against each other and move sideways at no cost.
    for poisson in [0.2, 1.0 / 3.0] {
        let what = format!("one row of points, nu {poisson:.3}");
        add(what, row(poisson), Refused("positive definite"));
    }
    all
}

/// What a run came to: unknowns and the stated difference, or the words of its refusal; and its warnings.
fn come_to(text: &str) -> (Result<(usize, f64), String>, Vec<String>) {
    let mut kept = Kept::default();
    let scene = Scene::parse(text, Path::new("hard.toml"));
    let ran = scene.and_then(|scene| run(&scene, &Inputs::default(), &mut kept));
    let difference =
        |(name, v): &(String, f64)| (name == "relative_difference_from_known_field").then_some(*v);
    let found = ran.map(|summary| {
        let stated = summary.numbers.iter().find_map(difference).unwrap_or(0.0);
        (summary.unknowns, stated)
    });
    (found.map_err(|e| e.to_string()), kept.warnings)
}

#[test]
fn planar_cases() {
    println!(
        "| case | unknowns | ended | difference from the closed form | said |\n|---|---|---|---|---|"
    );
    let mut wrong = Vec::new();
    for (what, text, end) in cases() {
        let (found, warnings) = come_to(&text);
        let said = match warnings.first() {
            Some(words) => words.split(':').next().unwrap_or_default().to_owned(),
            None => String::new(),
        };
        match &found {
            Ok((unknowns, difference)) => {
                println!("| {what} | {unknowns} | solved | {difference:.1e} | {said} |")
            }
            Err(words) => println!(
                "| {what} | – | refused | – | {} |",
                words.lines().next().unwrap_or_default()
            ),
        }
        let is_right = match (&found, end) {
            (Ok((_, difference)), End::Within(bound) | End::Either(bound, _)) => {
                *difference <= bound
            }
            (Err(words), End::Refused(part) | End::Either(_, part)) => words.contains(part),
            _ => false,
        };
        if !is_right {
            wrong.push(format!("{what}: {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
