//! Heat, strain and current in one scene, against closed forms.

use super::{Kept, PLATE, number, refused, solved, wired_strip};
use bonepd_ct::scene::frame::Summary;

const PINS: &str = "hold = [{ region = { point = [0.5, 0.5] }, component = 'x' },
    { region = { point = [0.5, 0.5] }, component = 'y' },
    { region = { point = [9.5, 0.5] }, component = 'y' }]";

/// The plate with these keys of the scene, and its model.
fn plate(scene: &str, model: &str) -> String {
    format!("{scene}\n{PLATE}[physics.continuum-molecular]\ncorrect_surfaces = false\n{model}")
}

fn worst(kept: &Kept, name: &str) -> f64 {
    kept.scalar(name).iter().fold(0.0, |m, v| m.max(v.abs()))
}

/// A temperature that conduction makes linear strains a free body without stress, as one that is given linear: the reference
/// temperature is the one without strain.
#[test]
fn the_temperature_of_conduction_strains_the_body() {
    let (young, alpha, t0, g) = (1000.0, 1e-5, 30.0, 4.0);
    let elastic = |thermal: &str| {
        format!(
            "elasticity = {{ young = {young}, poisson = 0.2, calibrated = true, thermal = {{ expansion = [{alpha}, {alpha}, 0], {thermal} }} }}"
        )
    };
    let ends = format!(
        "field = {{ polynomial = [[0, 0, {}], [1, 0, {g}]] }}",
        t0 + 20.0
    );
    let conducts = format!(
        "conduction = {{ conductivity = [3, 3, 0], calibrated = true }}
        known = [{{ region = {{ box = [-10, -6, -7, 6] }}, {ends} }}, {{ region = {{ box = [7, -6, 10, 6] }}, {ends} }}]
        {}",
        elastic("reference = 20")
    );
    let (summary, kept) = solved(&plate(PINS, &conducts));
    let (alone, given) = solved(&plate(PINS, &elastic(&format!("rise = [{t0}, {g}, 0]"))));
    let scale = young * alpha * (t0 + 10.0 * g);
    for name in ["stress_xx", "stress_yy", "stress_xy"] {
        assert!(
            worst(&kept, name) < 1e-11 * scale,
            "{name}: {}",
            worst(&kept, name)
        );
    }
    for (p, t) in kept.scalar("temperature").iter().enumerate() {
        let exact = t0 + 20.0 + g * kept.positions[p][0];
        assert!((t - exact).abs() < 1e-11 * 100.0, "{t} {exact}");
    }
    let near = kept
        .vector("displacement")
        .iter()
        .zip(given.vector("displacement"));
    assert!(
        near.flat_map(|(a, b)| [a[0] - b[0], a[1] - b[1]])
            .all(|d| d.abs() < 1e-12)
    );
    // Three columns of 12 points are held at each end. The elastic system is that of the scene without conduction.
    assert_eq!(number(&summary, "temperature_unknowns"), 240.0 - 72.0);
    assert_eq!(summary.unknowns, alone.unknowns);
    assert_eq!(number(&summary, "bond_values"), 0.0);
    assert!(
        alone
            .numbers
            .iter()
            .all(|(n, _)| n != "temperature_unknowns")
    );
}

/// A long free strip with a source of heat, its edges kept at 0: T = q (c² - y²)/2K, and away from the ends
/// σ = E α (mean T - T) along it (Boley and Weiner, Theory of Thermal Stresses, ch. 9). Twelve rows and a horizon of three of them:
/// the surfaces are soft, measured up to 4.5 % of the largest stress.
#[test]
fn a_source_of_heat_stresses_a_strip() {
    let (c, young, alpha, q) = (6.0, 1000.0, 1e-5, 2.0);
    let profile = "field = { polynomial = [[0, 0, 36], [0, 2, -1]] }";
    let at = |region: &str| format!("{{ region = {{ box = [{region}] }}, {profile} }}");
    let known = [
        at("-30, -6, 30, -3"),
        at("-30, 3, 30, 6"),
        at("-30, -3, -26, 3"),
        at("26, -3, 30, 3"),
    ];
    let text = plate(
        &format!("{PINS}\nload = [{{ region = 'all', component = 'temperature', value = {} }}]", q * 720.0),
        &format!(
            "conduction = {{ conductivity = [1, 1, 0], calibrated = true }}
            known = [{}]
            elasticity = {{ young = {young}, poisson = 0.2, calibrated = true, thermal = {{ expansion = [{alpha}, {alpha}, 0] }} }}",
            known.join(", ")
        ),
    )
    .replace("size = [20, 12]", "size = [60, 12]");
    let (_, kept) = solved(&text);
    let scale = young * alpha * c * c;
    let middle = (0..kept.positions.len()).filter(|&p| kept.positions[p][0].abs() < 1.0);
    for p in middle {
        let y = kept.positions[p][1];
        let t = kept.scalar("temperature")[p];
        assert!((t - (c * c - y * y)).abs() < 1e-10 * c * c, "{t} at {y}");
        if y.abs() < 3.0 {
            let exact = young * alpha * (c * c * 2.0 / 3.0 - (c * c - y * y));
            let found = kept.scalar("stress_xx")[p];
            assert!(
                (found - exact).abs() < 0.06 * scale,
                "{found} {exact} at {y}"
            );
        }
    }
}

/// The plate strained alike everywhere, a current along it, its potential read between two inner points.
fn sensed(strain: [f64; 3], slope: f64) -> (Summary, Kept) {
    solved(&plate(
        "hold = [{ region = { edge = 'left' }, component = 'potential' }]
        load = [{ region = { edge = 'right' }, component = 'potential', value = 1 }]",
        &format!(
            "elasticity = {{ young = 1000, poisson = 0.2 }}
            known = [{{ region = 'all', field = {{ strain = {strain:?} }} }}]
            conduction = {{ conductivity = [2, 2, 0], probes = [[4.5, 0.5], [-4.5, 0.5]], piezoresistance = {slope:?} }}"
        ),
    ))
}

/// Equal strain both ways changes all bonds alike: the potential between the probes by 1/(1 + Π e). Along the current alone the
/// conductivity follows Π (3 e11 + e22)/4, in a horizon of three points to some per cent of that.
#[test]
fn strain_changes_what_a_body_conducts() {
    let e = 2e-3;
    for slope in [-40.0, 25.0] {
        let (summary, _) = sensed([e, e, 0.0], slope);
        let exact = 1.0 / (1.0 + slope * e) - 1.0;
        let found = number(&summary, "potential_drop_change");
        assert!((found / exact - 1.0).abs() < 1e-9, "{found} {exact}");
        assert_eq!(number(&summary, "potential_unknowns"), 240.0 - 12.0);
        // One factor for each listed bond, and no others.
        assert_eq!(number(&summary, "bond_values") as usize, 2 * summary.bonds);
        for (strain, share) in [([e, 0.0, 0.0], 0.75), ([0.0, e, 0.0], 0.25)] {
            let (summary, kept) = sensed(strain, slope);
            let exact = 1.0 / (1.0 + slope * share * e) - 1.0;
            let found = number(&summary, "potential_drop_change");
            assert!(
                (found - exact).abs() < 0.05 * (slope * e).abs(),
                "{found} {exact}"
            );
            assert!(worst(&kept, "potential") > 0.0);
        }
    }
}

/// While a strip breaks, its bonds' strain adds to what their loss does: nothing for Π = 0, and before the first break in proportion
/// to the load. Broken bonds conduct nothing, however far they are stretched.
#[test]
fn a_breaking_strip_senses_its_strain() {
    let with = |slope: f64| {
        let text = wired_strip(0.2).replace(
            "exponent = 4,",
            &format!("exponent = 4, piezoresistance = {slope:?},"),
        );
        solved(&text)
    };
    let (plain, kept) = solved(&wired_strip(0.2));
    let bare = kept.column("potential_drop");
    let (_, zero) = with(0.0);
    // Once the strip is through, the current has no path.
    for (a, b) in zero.column("potential_drop").into_iter().zip(&bare) {
        assert!(
            (a / b - 1.0).abs() < 1e-9 || (a.is_nan() && b.is_nan()),
            "{a} {b}"
        );
    }
    let (sensing, kept) = with(-2.0);
    let strained = kept.column("potential_drop");
    assert!((strained[0] / bare[0] - 1.0).abs() < 1e-9);
    let change = |k: usize| strained[k] / bare[k] - 1.0;
    assert!(
        (change(2) / change(1) - 2.0).abs() < 0.02,
        "{} {}",
        change(1),
        change(2)
    );
    assert!(change(1) > 0.0);
    assert_eq!(
        number(&plain, "crack_length"),
        number(&sensing, "crack_length")
    );
}

/// Probes off the body or at one point, and a current into a held edge, would give a change of 0/0.
#[test]
fn a_gauge_that_shows_nothing_is_refused() {
    let gauge = |edge: &str, probes: &str| {
        plate(
            &format!(
                "hold = [{{ region = {{ edge = 'left' }}, component = 'potential' }}]
                load = [{{ region = {{ edge = '{edge}' }}, component = 'potential', value = 1 }}]"
            ),
            &format!(
                "elasticity = {{ young = 1000, poisson = 0.2 }}
                known = [{{ region = 'all', field = {{ strain = [1e-3, 0, 0] }} }}]
                conduction = {{ conductivity = [2, 2, 0], probes = {probes}, piezoresistance = -3 }}"
            ),
        )
    };
    let apart = "[[4.5, 0.5], [-4.5, 0.5]]";
    solved(&gauge("right", apart));
    for (edge, probes, words) in [
        ("left", apart, "the support takes the load"),
        ("right", "[[400, 0.5], [-4.5, 0.5]]", "conduction.probes[0]"),
        ("right", "[[4.5, 0.5], [4.6, 0.4]]", "the same point"),
    ] {
        let error = refused(&gauge(edge, probes));
        assert!(error.contains(words), "{words}: {error}");
    }
}

#[test]
fn couplings_that_are_none_or_two_are_refused() {
    let steel = "elasticity = { young = 1000, poisson = 0.2 }";
    let warm = |more: &str| {
        steel.replace(
            "0.2 }",
            &format!("0.2, thermal = {{ expansion = [1e-5, 1e-5, 0]{more} }} }}"),
        )
    };
    let wires = "hold = [{ region = { edge = 'left' }, component = 'potential' },
        { region = { edge = 'left' }, component = 'x' }, { region = { edge = 'left' }, component = 'y' }]
        load = [{ region = { edge = 'right' }, component = 'potential', value = 1 },
        { region = { edge = 'right' }, component = 'x', value = 100 }]";
    let heat = |more: &str| format!("conduction = {{ conductivity = [1, 1, 0]{more} }}");
    let piezo = heat(", piezoresistance = -3");
    for (model, words) in [
        (format!("{steel}\n{}", heat("")), "do not act on each other"),
        (warm(""), "no conduction to take it from"),
        (
            format!(
                "{}\n{}",
                warm(", rise = [1, 0, 0], reference = 2"),
                heat("")
            ),
            "elasticity.thermal.reference",
        ),
        (
            format!("{}\n{piezo}", warm("")),
            "one conduction for the temperature",
        ),
        (piezo.clone(), "but no elasticity"),
        (
            format!("{steel}\n{}", heat(", piezoresistance = -3, capacity = 1")),
            "a heat capacity with elasticity",
        ),
        (
            format!("{steel}\n{}", heat(", piezoresistance = -1e6")),
            "would conduct",
        ),
    ] {
        let error = refused(&plate(wires, &model));
        assert!(error.contains(words), "{words}: {error}");
    }
}
