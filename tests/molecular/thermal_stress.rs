//! Stress and energy of bodies that are warm: what strains a bond is its deformation less its thermal strain (eq. 176).

use super::{PLATE, number, solved};

const YOUNG: f64 = 1000.0;
const EXPANSION: f64 = 1e-5;
const RISE: f64 = 100.0;

fn warm(hold: &str, poisson: f64) -> (bonepd_ct::scene::frame::Summary, super::Kept) {
    solved(&format!(
        "hold = [{hold}]
        {PLATE}
        [physics.continuum-molecular]
        correct_surfaces = false
        [physics.continuum-molecular.elasticity]
        young = {YOUNG}
        poisson = {poisson}
        calibrated = true
        thermal = {{ expansion = [{EXPANSION}, {EXPANSION}, 0], rise = [{RISE}, 0, 0] }}"
    ))
}

/// A plate free to expand carries nothing, to 1e-12 of E α ΔT; its energy to the square of that.
#[test]
fn a_free_warm_plate_carries_no_stress() {
    let hold = "{ region = { point = [0.5, 0.5] }, component = 'x' },
        { region = { point = [0.5, 0.5] }, component = 'y' },
        { region = { point = [9.5, 0.5] }, component = 'y' }";
    for poisson in [0.2, 0.3] {
        let (summary, kept) = warm(hold, poisson);
        let scale = YOUNG * EXPANSION * RISE;
        for name in ["stress_xx", "stress_yy", "stress_xy", "energy"] {
            let worst = kept
                .scalar(name)
                .iter()
                .fold(0.0_f64, |m, v| m.max(v.abs()));
            assert!(worst < 1e-12 * scale, "{name}: {worst}");
        }
        assert!(number(&summary, "energy") < 1e-12 * scale);
    }
}

/// Held everywhere it carries -E α ΔT/(1 - ν) both ways (plane stress), and that times the strain in energy.
#[test]
fn a_held_warm_plate_carries_all_of_it() {
    let hold = ["x", "y", "rotation"]
        .map(|c| format!("{{ region = 'all', component = '{c}' }}"))
        .join(",");
    for poisson in [0.2, 0.3] {
        let (summary, kept) = warm(&hold, poisson);
        let exact = -YOUNG * EXPANSION * RISE / (1.0 - poisson);
        let inner = |p: &[f64; 2]| p[0].abs() < 6.0 && p[1].abs() < 2.6;
        let inside = (0..kept.positions.len()).filter(|&p| inner(&kept.positions[p]));
        for p in inside {
            for (name, expected) in [
                ("stress_xx", exact),
                ("stress_yy", exact),
                ("stress_xy", 0.0),
                ("energy", -exact * EXPANSION * RISE),
            ] {
                let found = kept.scalar(name)[p];
                assert!(
                    (found - expected).abs() < 1e-12 * exact.abs(),
                    "{name}: {found} {expected}"
                );
            }
        }
        let sum = kept.scalar("energy").iter().sum::<f64>();
        assert!((number(&summary, "energy") / sum - 1.0).abs() < 1e-12);
    }
}
