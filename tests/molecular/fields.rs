//! Flux and stress, which follow from the solution, against closed forms.

use super::{PLATE, disc, solved};

/// Root mean square error of the flux (eq. 170) over that of the flux -D grad T of the cubic, where r < 0.95.
fn flux_error(calibrated: bool) -> f64 {
    let (_, kept) = disc(100.0, 5.0, 34, true, 0.05, calibrated);
    let (mut error, mut size) = (0.0, 0.0);
    for ([x, y], q) in kept.positions.iter().zip(kept.vector("flux")) {
        if x.hypot(*y) >= 0.95 {
            continue;
        }
        let g = [
            0.6 * x * x - 2.0 * x * y + y * y,
            -x * x + 2.0 * x * y + y * y,
        ];
        let exact = [-(5.0 * g[0] + 2.0 * g[1]), -(2.0 * g[0] + g[1])];
        error += (q[0] - exact[0]).powi(2) + (q[1] - exact[1]).powi(2);
        size += exact[0].powi(2) + exact[1].powi(2);
    }
    (error / size).sqrt()
}

/// One-sided sums are exact for linear fields only; without calibration the stencil's own conductivity adds to that.
#[test]
fn the_flux_of_the_disc_is_that_of_its_closed_form() {
    let (calibrated, plain) = (flux_error(true), flux_error(false));
    assert!(
        (calibrated - 3.2473e-3).abs() < 1e-6 && (plain - 7.1749e-2).abs() < 1e-5,
        "{calibrated} {plain}"
    );
}

/// A linear temperature through full families: q = -D grad T to rounding.
#[test]
fn the_flux_of_a_linear_field_is_exact() {
    let (_, kept) = solved(&format!(
        "{PLATE}
        [physics.continuum-molecular]
        known = [{{ region = 'all', field = {{ polynomial = [[1, 0, 0.7], [0, 1, -0.3]] }} }}]
        [physics.continuum-molecular.conduction]
        conductivity = [5, 1, 2]
        exponent = 4
        calibrated = true"
    ));
    let exact = [-(5.0 * 0.7 - 2.0 * 0.3), -(2.0 * 0.7 - 0.3)];
    for (p, q) in kept.positions.iter().zip(kept.vector("flux")) {
        if p[0].abs() < 6.0 && p[1].abs() < 2.0 {
            assert!(
                (q[0] - exact[0]).hypot(q[1] - exact[1]) < 1e-12,
                "{q:?} {exact:?}"
            );
        }
    }
}

/// Homogeneous strain through full families: the stress (eqs. 83, 84) is C : ε to rounding, fully anisotropic.
#[test]
fn the_stress_of_a_homogeneous_strain_is_exact() {
    let c = [1.0, 0.8, 0.2, 0.35, 0.1, 0.15];
    let (e11, e22, shear) = (2e-3, -1e-3, 5e-4);
    let (_, kept) = solved(&format!(
        "{PLATE}
        [physics.continuum-molecular]
        known = [{{ region = 'all', field = {{ strain = [{e11}, {e22}, {shear}] }} }}]
        [physics.continuum-molecular.elasticity]
        moduli = {c:?}
        calibrated = true"
    ));
    let [c11, c22, c12, c66, c16, c26] = c;
    for (name, exact) in [
        ("stress_xx", c11 * e11 + c12 * e22 + c16 * shear),
        ("stress_yy", c12 * e11 + c22 * e22 + c26 * shear),
        ("stress_xy", c16 * e11 + c26 * e22 + c66 * shear),
    ] {
        for (p, s) in kept.positions.iter().zip(kept.scalar(name)) {
            if p[0].abs() < 6.0 && p[1].abs() < 2.0 {
                assert!((s - exact).abs() < 1e-15, "{name}: {s} {exact}");
            }
        }
    }
}
