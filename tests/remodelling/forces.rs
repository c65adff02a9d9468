//! Bodies driven by forces, against closed forms.

use super::square::simulate;

/// A bar of ten elements in a row, its ends free to contract, pulled by `force` (N a unit of thickness) over its height.
fn pulled(force: f64, model: &str) -> String {
    format!(
        "title = 'pulled bar'
         geometry.rectangle = {{ size = [1.0, 0.1], nodal = true }}
         [grid]
         spacing = 0.1
         [[hold]]
         region = {{ edge = 'left' }}
         component = 'x'
         [[hold]]
         region = {{ point = [-0.5, -0.05] }}
         component = 'y'
         [[load]]
         region = {{ edge = 'right' }}
         component = 'x'
         value = {{ times = [0, 1, 40], values = [0, {force:?}, {force:?}] }}
         [[probe]]
         name = 'end'
         region = {{ edge = 'right' }}
         [time]
         end = 40.0
         step = 0.5
         [physics.continuum]
         young = 2.0
         poisson = 0.3
         {model}
         "
    )
}

/// A force that a support takes, a place off the body, and a body that turns about its one held point.
#[test]
fn loads_and_supports_that_do_nothing_are_refused() {
    let text = pulled(0.01, "");
    let left = "[[load]]\n         region = { edge = 'left' }";
    for (old, new, words) in [
        (
            "[[load]]\n         region = { edge = 'right' }",
            left,
            "the support takes the force",
        ),
        (
            "[[load]]\n         region = { edge = 'right' }",
            "[[load]]\n         region = { point = [3.0, 0.05] }",
            "the nearest is [0.5000, 0.0500], 2.5000 away",
        ),
        (
            "[[hold]]\n         region = { edge = 'left' }",
            "[[hold]]\n         region = { edge = 'bottom' }",
            "the body can turn",
        ),
        (
            "poisson = 0.3",
            "poisson = 1.2",
            "physics.continuum.poisson",
        ),
        ("young = 2.0", "young = -2.0", "physics.continuum.young"),
    ] {
        assert!(text.contains(old), "{old}");
        let error = simulate(&text.replace(old, new)).map(|_| ()).unwrap_err();
        assert!(error.to_string().contains(words), "{words}: {error}");
    }
}

/// St. Venant-Kirchhoff under uniaxial tension: force = height x E e sqrt(1 + 2 e), with e the Green-Lagrange strain along
/// the bar. All of it counts from the undeformed body.
#[test]
fn a_force_stretches_a_bar_by_the_closed_form() {
    let e: f64 = 0.08;
    let stretch = (1.0 + 2.0 * e).sqrt();
    let (summary, recorder) = simulate(&pulled(0.1 * 2.0 * e * stretch, "")).unwrap();
    assert!(summary.converged, "{summary:?}");
    let moved = recorder.at(40.0, "end.ux");
    assert!((moved - (stretch - 1.0)).abs() < 1e-9, "{moved}");
    // Half the force at t = 0.5.
    let strain = |f: f64| (0..60).fold(f, |e: f64, _| f / (1.0 + 2.0 * e).sqrt());
    let half = (1.0 + 2.0 * strain(0.5 * e * stretch)).sqrt() - 1.0;
    let moved = recorder.at(0.5, "end.ux");
    assert!((moved - half).abs() < 1e-9, "{moved} {half}");
}

/// Under a constant force density settles where (rho/rho*)^(n-m) Psi_0 = Psi*: with n = 2 and m = 3 at
/// rho = rho* Psi_0/Psi*, Psi_0 = E e^2/2, and the strain follows from (rho/rho*)^2 E e sqrt(1 + 2 e) = force/height.
#[test]
fn bone_under_a_constant_force_settles_by_the_closed_form() {
    let (e, stimulus): (f64, f64) = (0.12, 0.01);
    let stretch = (1.0 + 2.0 * e).sqrt();
    let density = 2.0 * e * e / 2.0 / stimulus;
    let force = 0.1 * density * density * 2.0 * e * stretch;
    for more in [
        "",
        "density_at = 'gauss'\n solver = { method = 'reuse', tolerance = 1e-10 }",
    ] {
        let growth = format!("growth = {{ rate = 100, stimulus = {stimulus:?} }}\n {more}");
        let (summary, recorder) = simulate(&pulled(force, &growth)).unwrap();
        assert!(summary.converged, "{summary:?}");
        let found = [recorder.at(40.0, "mean"), recorder.at(40.0, "end.ux")];
        let expected = [density - 1.0, stretch - 1.0];
        let near = found
            .iter()
            .zip(expected)
            .all(|(f, x)| (f - x).abs() < 1e-7);
        assert!(near, "{found:?} {expected:?}");
    }
}
