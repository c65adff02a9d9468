//! Scenes at the edge of what is possible: everything held, windows without points, cracks through
//! points.

use super::{number, refused, solved, strip_text, wired_strip};

const HELD: &str = "{ region = 'all', component = 'x' }, { region = 'all', component = 'y' },
    { region = 'all', component = 'rotation' }";

fn held(hold: &str, physics: &str) -> String {
    format!(
        "title = 'held'
        hold = [{hold}]
        [geometry.rectangle]
        size = [8, 6]
        [grid]
        spacing = 1
        horizon_ratio = 3
        {physics}"
    )
}

const TIME: &str = "[time]\nend = 1\nstep = 0.5\n";

const ELASTIC: &str = "[physics.continuum-molecular.elasticity]\nyoung = 1\npoisson = 0.2\n";

#[test]
fn a_body_held_everywhere_is_a_scene_like_any_other() {
    let vibration = "[physics.continuum-molecular.vibration]\ndensity = 1\nmodes = 2\n";
    let words = refused(&held(HELD, &format!("{ELASTIC}{vibration}")));
    assert!(words.contains("everything is held"), "{words}");

    let heat = "[physics.continuum-molecular.conduction]\nconductivity = [5, 1, 2]\ncapacity = 1\n";
    let (summary, kept) = solved(&held(
        "{ region = 'all', component = 'temperature', value = 3 }",
        &format!("{TIME}{heat}"),
    ));
    assert_eq!(summary.unknowns, 0);
    assert!(kept.scalar("temperature").iter().all(|t| *t == 3.0));

    let fracture = "[physics.continuum-molecular.fracture]\nenergy = [1, 1]\n";
    let words = refused(&held(HELD, &format!("{TIME}{ELASTIC}{fracture}")));
    assert!(words.contains("unbreakable"), "{words}");

    let potential = "hold = [{ region = 'all', component = 'potential', value = 1 },";
    let (summary, _) = solved(&wired_strip(0.04).replace("hold = [", potential));
    assert_eq!(number(&summary, "potential_unknowns"), 0.0);
}

#[test]
fn a_window_needs_points() {
    let words = refused(&(strip_text("", 0.2) + "\nwindow_points = 0"));
    assert!(words.contains("fracture.window_points"), "{words}");
    let (summary, _) = solved(&(strip_text("", 0.2) + "\nwindow_points = 1"));
    assert!(number(&summary, "broken_bonds") > 0.0);
}

/// A crack along a lattice direction, typed to the last digit: bonds that touch it by rounding.
#[test]
fn a_crack_through_lattice_points_breaks_on() {
    let (summary, _) = solved(
        "title = 'asymmetric'
        hold = [{ region = { edge = 'bottom' }, component = 'y' }, { region = { edge = 'bottom' }, component = 'x' },
                { region = { edge = 'top' }, component = 'y', value = { times = [0, 1], values = [0, 1] } }]
        [geometry.rectangle]
        size = [6, 6]
        [grid]
        spacing = 0.3
        horizon_ratio = 5
        partial_volumes = true
        [time]
        end = 0.05
        step = 0.05
        [physics.continuum-molecular]
        cracks = [[-2.55, -1.6500000000000001, 0.1499999999999999, 0.1499999999999999]]
        [physics.continuum-molecular.elasticity]
        young = 1000
        poisson = 0.3333333333333333
        [physics.continuum-molecular.fracture]
        energy = [0.05, 0.05]",
    );
    assert!(number(&summary, "broken_bonds") > 0.0, "{summary:?}");
}
