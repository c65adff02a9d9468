//! Lattice constants and local references (constants of Schaller et al. 2022, appendix A; the unit square of its figures 4 and 5).

use super::square::{
    FIVE_DIGITS, S2, SIX_DIGITS, assert_near, continuum_square, local_text, simulate,
};
use bonepd_ct::discretisation::plane::family::Stencil;
use bonepd_ct::physics::bond_based::{micromodulus_continuous, micromodulus_discrete};

#[test]
fn a2_lattice_constants_of_the_stencils() {
    // delta/Delta, C_disc/C_cont, E_axis with C_cont, E_axis with C_disc, nu_axis
    let table = [
        (2.01, 0.963238, 1.26021, 1.21388, 0.19074),
        (2.5125, 0.934530, 1.09650, 1.02472, 0.31686),
        (3.01, 0.970386, 1.05384, 1.02263, 0.31825),
        (4.02, 1.054730, 0.97131, 1.02447, 0.31702),
        (5.025, 0.967284, 0.98885, 0.95649, 0.36234),
        (10.05, 0.964611, 1.03619, 0.99952, 0.33365),
    ];
    for (ratio, quotient, axis_cont, axis_disc, poisson) in table {
        let stencil = Stencil::new(0.1, 0.1 * ratio, false).unwrap();
        let cont = micromodulus_continuous(1.0, &stencil);
        let disc = micromodulus_discrete(1.0, &stencil);
        // C_ijkl = C/2 sum L V n_i n_j n_k n_l
        let moment = |k: i32, l: i32| {
            stencil.integrate(|b| {
                0.5 * b.length * (b.xi[0] / b.length).powi(k) * (b.xi[1] / b.length).powi(l)
            })
        };
        let (c11, c12) = (moment(4, 0), moment(2, 2));
        let young = c11 - c12 * c12 / c11;
        assert!((disc / cont - quotient).abs() < SIX_DIGITS);
        assert!((cont * young - axis_cont).abs() < FIVE_DIGITS);
        assert!((disc * young - axis_disc).abs() < FIVE_DIGITS);
        assert!((c12 / c11 - poisson).abs() < FIVE_DIGITS);
    }
}

#[test]
fn a3_local_references() {
    let times = [0.1, 2.0, 4.0, 6.0, 8.0];
    let stvk = [-0.100560, -0.191008, 0.300074, 0.924604, 1.691230];
    for place in ["nodes", "gauss"] {
        let model = format!("density_at = '{place}'");
        assert_near(
            continuum_square(1, S2, false, &model).means(times),
            stvk,
            SIX_DIGITS,
        );
    }
    let circle = [-0.140762, -0.261709, 0.160307, 0.680275, 1.299313];
    let model = "energy = 'isotropic-bonds'";
    assert_near(
        continuum_square(1, S2, false, model).means(times),
        circle,
        SIX_DIGITS,
    );
    let lattice = [-0.245732, 0.185295, 0.716355, 1.348597];
    let model = "energy = 'stencil-bonds'";
    let found = continuum_square(1, S2, false, model).means([2.0, 4.0, 6.0, 8.0]);
    assert_near(found, lattice, SIX_DIGITS);
    // More elements change nothing: the body stays homogeneous.
    let finer = continuum_square(3, S2, false, model).means([2.0, 4.0, 6.0, 8.0]);
    assert_near(finer, found, 1e-8);
}

/// By `reports/remodelling/local_limits.py`. A bar under uniaxial strain of St. Venant-Kirchhoff does not depend on Poisson's ratio, of
/// Neo-Hooke it does.
#[test]
fn local_references_of_neo_hooke() {
    let table = [
        (0.2, [-0.315329, 0.057495, 0.505811, 1.027310]),
        (0.3, [-0.319322, 0.049914, 0.493070, 1.007626]),
    ];
    for (poisson, exact) in table {
        for place in ["nodes", "gauss"] {
            let model =
                format!("energy = 'neo-hooke'\n poisson = {poisson:?}\n density_at = '{place}'");
            let found = continuum_square(1, S2, false, &model).means([2.0, 4.0, 6.0, 8.0]);
            assert_near(found, exact, SIX_DIGITS);
        }
    }
}

#[test]
fn a3_in_compression_the_gap_changes_sign() {
    let steps = S2.map(|u| -u);
    let times = [2.0, 4.0, 6.0, 8.0];
    let stvk = [-0.36381, -0.03742, 0.34152, 0.76621];
    assert_near(
        continuum_square(1, steps, false, "").means(times),
        stvk,
        FIVE_DIGITS,
    );
    let circle = [-0.30022, 0.08498, 0.54987, 1.09191];
    let model = "energy = 'isotropic-bonds'";
    assert_near(
        continuum_square(1, steps, false, model).means(times),
        circle,
        FIVE_DIGITS,
    );
}

/// The local limits of the other stencils, and with the continuum's micromodulus: energies are linear in it.
#[test]
fn a3_limits_of_all_stencils() {
    // delta/Delta, t = 8 with C_disc and with C_cont
    let table = [
        (2.01, 1.736391, 1.840558),
        (2.5125, 1.350345, 1.514776),
        (4.02, 1.350408, 1.228560),
        (5.025, 1.210962, 1.285676),
    ];
    let limit = |ratio: f64, young: f64| {
        let model = "energy = 'stencil-bonds'";
        let text = local_text(1, S2, false, model)
            .replace(
                "horizon_ratio = 3.01",
                &format!("horizon_ratio = {ratio:?}"),
            )
            .replace("young = 1.0", &format!("young = {young:?}"));
        simulate(&text).unwrap().1
    };
    let quotient = |ratio: f64| {
        let stencil = Stencil::new(1.0, ratio, false).unwrap();
        micromodulus_continuous(1.0, &stencil) / micromodulus_discrete(1.0, &stencil)
    };
    for (ratio, discrete, continuous) in table {
        assert_near(limit(ratio, 1.0).means([8.0]), [discrete], SIX_DIGITS);
        assert_near(
            limit(ratio, quotient(ratio)).means([8.0]),
            [continuous],
            SIX_DIGITS,
        );
    }
    let found = limit(3.01, quotient(3.01)).means([2.0, 4.0, 6.0, 8.0]);
    assert_near(found, [-0.222713, 0.221468, 0.768723, 1.420185], SIX_DIGITS);
}

/// What implicit Euler's step costs: St. Venant-Kirchhoff at t = 8 with steps of 0.1 and 0.01 (printed to 5 digits).
#[test]
fn a3_error_of_the_time_step() {
    let text = local_text(1, S2, false, "");
    let found = simulate(&text.replace("step = 0.1", "step = 0.01"))
        .unwrap()
        .1;
    assert_near(found.means([8.0]), [1.69196], FIVE_DIGITS);
}

/// A micromodulus fitted to St. Venant-Kirchhoff at a biaxial strain of 0.163 brings the local limit within 0.06 of it
/// (printed to 3 digits).
#[test]
fn a4_a_micromodulus_fitted_at_finite_strain() {
    let young = (1.0f64 + 0.5 * 0.163).powi(2);
    let text = local_text(1, S2, false, "energy = 'isotropic-bonds'")
        .replace("young = 1.0", &format!("young = {young:?}"));
    let times = [2.0, 4.0, 6.0, 8.0];
    let found = simulate(&text).unwrap().1.means(times);
    assert_near(found, [-0.136, 0.358, 0.966, 1.690], 2e-3);
    let stvk = continuum_square(1, S2, false, "").means(times);
    assert_near(found, stvk, 0.06);
}
