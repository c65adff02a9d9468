//! Owns natural vibration: the lowest modes of K v = ω² M v (eq. 91).

use super::Vibration;
use super::equilibrium::factorise;
use super::setup::Setup;
use super::solid::Solid;
use super::steady::{displacement, scalar, summary};
use crate::error::{Error, Result};
use crate::scene::frame::{Frame, Observer, Summary};
use crate::solver::lanczos::{Found, Mode, lowest};

/// Modes, their shapes at every point, and the number of unknowns.
type Shaped<const D: usize> = (Found, Vec<Vec<[f64; D]>>, usize);

/// Frequencies and shapes of the lowest `vibration.modes` modes, rigid ones included. The rotary inertia per volume is
/// that of a cell, ρ Δ²/6 (the text leaves it open; it vanishes with the grid as it must in a Cauchy body).
pub fn modes<const D: usize>(
    solid: &Solid<D>,
    vibration: &Vibration,
    setup: &Setup,
) -> Result<Shaped<D>> {
    let Vibration { density, modes } = *vibration;
    if solid.held.iter().all(Option::is_some) {
        return Err(Error::setting(
            "hold",
            "everything is held, so that nothing vibrates",
            "hold fewer points or components",
        ));
    }
    let cell = density * setup.cell;
    let inertia = cell * setup.cell / 6.0;
    let mass_of = |v: usize| if v % D == 2 { inertia } else { cell };
    // A shift of the order of the lowest mode of a bar as long as the body.
    let (_, n) = setup.points.bounds();
    let length = n[0].max(n[1]) as f64 * setup.points.spacing;
    let stiff =
        solid.moduli.iter().fold(0.0_f64, |m, k| m.max(k.axial)) * setup.horizon().powi(3) / 4.0;
    let shift = 0.1 * stiff / density * (std::f64::consts::PI / length).powi(2);
    let extra: Vec<f64> = (0..solid.held.len()).map(|v| shift * mass_of(v)).collect();
    let mut factorised = factorise(&solid.body, &setup.points, &solid.held, &extra, &[])?;
    let unknowns = factorised.reduction.unknowns();
    let mass: Vec<f64> = (0..unknowns)
        .map(|q| mass_of(factorised.reduction.equation(q)))
        .collect();
    let found = lowest(modes, &mass, shift, |x| factorised.llt.solve(x));
    let still: Vec<Option<f64>> = solid.held.iter().map(|h| h.map(|_| 0.0)).collect();
    let shapes = found
        .modes
        .iter()
        .map(|m| factorised.expand(&m.vector, &still))
        .collect();
    Ok((found, shapes, unknowns))
}

/// ω/2π; a rigid mode's rounding below zero counts as zero.
pub fn frequency(mode: &Mode) -> f64 {
    mode.eigenvalue.max(0.0).sqrt() / (2.0 * std::f64::consts::PI)
}

pub fn run<const D: usize>(
    solid: Solid<D>,
    vibration: &Vibration,
    setup: &Setup,
    observer: &mut dyn Observer,
) -> Result<Summary> {
    observer.start(&setup.points, vibration.modes)?;
    let (found, shapes, unknowns) = modes(&solid, vibration, setup)?;
    let mut numbers = vec![("density".to_owned(), vibration.density)];
    let count = found.modes.len();
    if !found.settled {
        observer.say("the modes did not converge: ask for fewer; those given are approximate");
    }
    if count < vibration.modes {
        observer.say(&format!(
            "{count} modes found of the {} asked for: there are {unknowns} unknowns",
            vibration.modes
        ));
    }
    for (k, (mode, shape)) in found.modes.iter().zip(&shapes).enumerate() {
        let f = frequency(mode);
        let largest = shape.iter().fold(0.0_f64, |m, u| m.max(u[0].hypot(u[1])));
        let size: Vec<f64> = shape.iter().map(|u| u[0].hypot(u[1]) / largest).collect();
        observer.frame(&Frame {
            time: (k + 1) as f64,
            numbers: vec![("frequency".into(), f)],
            fields: vec![
                scalar("magnitude", size),
                displacement(shape, 1.0 / largest),
            ],
        })?;
        numbers.push((format!("frequency_{}", k + 1), f));
    }
    let stored = solid.body.bond_values();
    let mut summary = summary(setup, unknowns, stored, count, numbers);
    summary.converged = found.settled;
    Ok(summary)
}
