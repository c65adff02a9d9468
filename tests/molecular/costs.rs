//! What a scene leaves out costs nothing: unknowns, and values stored to tell bonds apart.

use super::{PLATE, number, solved, strip_text, wired_strip};

/// The plate with the given physics, without surface correction: unknowns, bond values.
fn cost(physics: &str) -> [usize; 2] {
    let cold = "hold = [{ region = { point = [0.5, 0.5] }, component = 'temperature' }]";
    let hold = if physics.starts_with("conduction") {
        cold
    } else {
        ""
    };
    let (summary, _) = solved(&format!(
        "{hold}
        {PLATE}
        [physics.continuum-molecular]
        correct_surfaces = false
        {physics}"
    ));
    assert_eq!(summary.points, 240);
    [summary.unknowns, number(&summary, "bond_values") as usize]
}

fn elastic(poisson: f64, more: &str) -> String {
    format!(
        "vibration = {{ density = 1, modes = 4 }}
        elasticity = {{ young = 1, poisson = {poisson} {more} }}"
    )
}

/// Unknowns per point: 1 for conduction (one value is held), 2 where Cauchy's relations hold (central bonds), 3 with
/// rotations, and no state of any bond. Couple stresses need rotations even where bonds are central.
#[test]
fn unknowns_per_point_are_those_of_the_physics() {
    let heat = "conduction = { conductivity = [1, 1, 0] }";
    assert_eq!(cost(heat), [240 - 1, 0]);
    assert_eq!(cost(&elastic(1.0 / 3.0, "")), [2 * 240, 0]);
    assert_eq!(cost(&elastic(0.2, "")), [3 * 240, 0]);
    let bent = ", bending = { first = 1, second = 1 }";
    assert_eq!(cost(&elastic(1.0 / 3.0, bent)), [3 * 240, 0]);
}

/// Fracture alone stores a flag per listed bond, and a factor once one is broken; a coupled scene solves for 3 unknowns per
/// point and, in a system of its own, for 1 more.
#[test]
fn only_fracture_stores_the_state_of_bonds() {
    let plain = |text: String| text.replace("thickness = 2", "correct_surfaces = false");
    let (broken, _) = solved(&plain(strip_text("", 0.2)));
    let (whole, _) = solved(&plain(strip_text("", 0.02)));
    let listed = 2 * broken.bonds;
    assert_eq!(number(&whole, "broken_bonds"), 0.0);
    assert_eq!(number(&whole, "bond_values") as usize, listed);
    assert!(number(&broken, "broken_bonds") > 0.0);
    assert_eq!(number(&broken, "bond_values") as usize, 2 * listed);
    // 600 points; x and y are held along the lower edge, y along the upper one.
    assert_eq!(broken.unknowns, 3 * 600 - 2 * 30 - 30);
    assert!(
        broken
            .numbers
            .iter()
            .all(|(n, _)| n != "potential_unknowns")
    );

    let (coupled, _) = solved(&plain(wired_strip(0.2)));
    assert_eq!(coupled.unknowns, broken.unknowns);
    // The potential is held at 2 x 2 points.
    assert_eq!(number(&coupled, "potential_unknowns"), 600.0 - 4.0);
    assert_eq!(number(&coupled, "bond_values") as usize, 3 * listed);

    // The same strip with nothing that breaks.
    let (text, _) = strip_text("", 0.2)
        .split_once("[physics.continuum-molecular.fracture]")
        .map(|(before, _)| (plain(before.to_owned()), ()))
        .unwrap();
    let text = text.replace("[time]\n        end = 0.2\n        step = 0.02", "");
    let (unbreakable, _) = solved(&text);
    assert_eq!(unbreakable.unknowns, broken.unknowns);
    assert_eq!(number(&unbreakable, "bond_values"), 0.0);
}
