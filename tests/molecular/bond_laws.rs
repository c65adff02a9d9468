//! Laws by which bonds differ with length and direction: attenuation, cosⁿ in elasticity, fracture of any frequency, and the table of
//! directions.

use super::{Kept, PLATE, number, refused, solved};
use std::f64::consts::PI;

/// Energy density of an extension of 1 inside the plate over the exact one, less 1.
fn bias(model: &str, elasticity: &str) -> f64 {
    let (summary, _) = solved(&format!(
        "title = 'plate'
        [geometry.rectangle]
        size = [24, 24]
        [grid]
        spacing = 1
        horizon_ratio = 8
        partial_volumes = true
        [physics.continuum-molecular]
        correct_surfaces = false
        known = [{{ region = 'all', field = {{ strain = [1, 0.3, 0.2] }} }}]
        {model}
        [physics.continuum-molecular.elasticity]
        {elasticity}"
    ));
    number(&summary, "energy_density_inside") / number(&summary, "energy_density_local") - 1.0
}

const BONE: &str = "moduli = [25000, 16250, 5890, 6650, 0, 0]\nangle_deg = 30\n";

/// Whatever Λ, a body stores its energy: to the stencil's bias of a few per cent, calibrated to rounding.
#[test]
fn attenuated_bonds_store_the_same_energy() {
    for law in ["constant", "conical", "parabolic"] {
        let model = format!("attenuation = '{law}'");
        let plain = bias(&model, BONE);
        assert!(plain.abs() < 0.03 && plain.abs() > 1e-6, "{law}: {plain}");
        let calibrated = bias(&model, &format!("{BONE}calibrated = true"));
        assert!(calibrated.abs() < 1e-12, "{law}: {calibrated}");
    }
    let words = refused(&format!(
        "{PLATE}\n[physics.continuum-molecular]\nattenuation = 'cubic'\nelasticity = {{ young = 1 }}"
    ));
    assert!(words.contains("conical"), "{words}");
}

/// A linear temperature conducts exactly when calibrated. Uncalibrated at m = 3 the conical stencil conducts 0.912017 of K11: half the sum of
/// k Λ n₁² α Δv, made apart from this program.
#[test]
fn attenuated_bonds_conduct_as_much() {
    for (calibrated, share, allowed) in [(true, 1.0, 1e-12), (false, 0.912_017, 1e-6)] {
        let (_, kept) = solved(&format!(
            "{PLATE}
            [physics.continuum-molecular]
            correct_surfaces = false
            attenuation = 'conical'
            known = [{{ region = 'all', field = {{ polynomial = [[1, 0, 1]] }} }}]
            conduction = {{ conductivity = [2, 1, 0], calibrated = {calibrated} }}"
        ));
        for (p, q) in kept.positions.iter().zip(kept.vector("flux")) {
            if p[0].abs() < 6.0 && p[1].abs() < 2.0 {
                assert!((q[0] / -2.0 - share).abs() < allowed, "{calibrated}: {q:?}");
            }
        }
    }
}

/// The cosⁿ law of elastic bonds stores the energy of an orthotropic body, and is refused where it cannot.
#[test]
fn elastic_bonds_may_follow_a_power_of_the_cosine() {
    for n in [4, 8] {
        let found = bias("", &format!("{BONE}exponent = {n}"));
        assert!(found.abs() < 0.03, "n = {n}: {found}");
    }
    let scene = |elasticity: &str| {
        refused(&format!(
            "{PLATE}
            [physics.continuum-molecular.elasticity]
            {elasticity}"
        ))
    };
    let words = scene(&format!("{BONE}exponent = 4\ncalibrated = true"));
    assert!(words.contains("elasticity.calibrated"), "{words}");
    let words = scene("moduli = [1, 0.8, 0.2, 0.35, 0.1, 0.15]\nexponent = 4");
    assert!(words.contains("orthotropic"), "{words}");
    let words = scene(&format!("{BONE}exponent = 2"));
    assert!(words.contains("elasticity.exponent"), "{words}");
}

fn column<'k>(kept: &'k Kept, name: &str) -> &'k [f64] {
    let found = kept.directions.columns.iter().find(|(n, _)| *n == name);
    &found
        .unwrap_or_else(|| panic!("{name}: {:?}", kept.directions))
        .1
}

/// Of an isotropic body k_n and k_t are those of eqs. 71, 72; a crack of any direction has the energy that its law gives it.
#[test]
fn the_table_of_directions_has_the_closed_forms() {
    let (_, kept) = solved(
        "title = 'strip'
        hold = [{ region = { edge = 'left' }, component = 'x' }, { region = { edge = 'left' }, component = 'y' },
                { region = { edge = 'right' }, component = 'x', value = { times = [0, 1], values = [0, 1e-6] } },
                { region = { edge = 'right' }, component = 'potential' }]
        load = [{ region = { edge = 'left' }, component = 'potential', value = 1 }]
        [geometry.rectangle]
        size = [16, 8]
        [grid]
        spacing = 1
        horizon = 3
        [time]
        end = 1
        step = 1
        [physics.continuum-molecular.elasticity]
        young = 1000
        poisson = 0.2
        [physics.continuum-molecular.fracture]
        energy = [1.3, 1]
        exponent = 8
        [physics.continuum-molecular.conduction]
        conductivity = [2, 2, 0]",
    );
    let (c11, c66) = (1000.0 / 0.96, 1000.0 / 2.4);
    for degrees in [0, 45, 200] {
        let k_n = 12.0 * (c11 - c66) / (PI * 27.0);
        let k_t = 12.0 * (3.0 * c66 - c11) / (PI * 27.0);
        assert!((column(&kept, "k_n")[degrees] / k_n - 1.0).abs() < 1e-12);
        assert!((column(&kept, "k_t")[degrees] / k_t - 1.0).abs() < 1e-12);
        // K = (δ²/4) ∫ k n nᵀ dψ of a constant k is π δ² k/4.
        assert!(
            (column(&kept, "k_conduction")[degrees] / (4.0 * 2.0 / (PI * 9.0)) - 1.0).abs() < 1e-12
        );
    }
    let energy = column(&kept, "fracture_energy");
    assert!((energy[0] - 1.3).abs() < 1e-12 && (energy[90] - 1.0).abs() < 1e-12);
    assert!((energy[30] - energy[210]).abs() < 1e-12 && energy[30] < 1.3 && energy[30] > 1.0);
    assert!(column(&kept, "w_c").iter().all(|w| *w > 0.0));
}
