//! Owns what conduction and elastic equilibrium do to each other in one scene: the temperature that strains a body (eq. 176), and the
//! strain that changes what its bonds conduct.

use crate::error::{Error, Result};
use crate::physics::continuum_molecular::body::Body;
use crate::physics::continuum_molecular::piezoresistance::Piezoresistance;
use crate::physics::continuum_molecular::thermal::ThermalStrain;
use crate::scene::continuum_molecular::equilibrium::solve;
use crate::scene::continuum_molecular::path::{CONDUCTED, STEADY, drop};
use crate::scene::continuum_molecular::setup::{Conductor, Setup};
use crate::scene::continuum_molecular::solid::Solid;
use crate::scene::continuum_molecular::steady::{loads, scalar};
use crate::scene::continuum_molecular::{Molecular, Problem, Steady};
use crate::scene::frame::Field;
use crate::scene::setting::Setting;

/// What a coupled scene adds to the numbers and fields of its elastic one.
#[derive(Default)]
pub struct Added {
    pub numbers: Vec<(String, f64)>,
    pub fields: Vec<Field>,
    /// Values stored to tell conducting bonds apart.
    pub bond_values: usize,
}

/// Steady conduction in the unstrained body, and what of it acts on `solid`: its temperature less the reference, where the scene's
/// thermal strain has no `rise` of its own.
///
/// # Errors
/// A temperature that nothing holds in some piece.
pub fn warm<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    solid: &mut Solid<D>,
    conductor: Option<&Conductor>,
) -> Result<Added> {
    let (Problem::Static { thermal, .. }, Some((body, _))) = (&model.problem, conductor) else {
        return Ok(Added::default());
    };
    let Some(thermal) = thermal.filter(|t| t.rise.is_none()) else {
        return Ok(Added::default());
    };
    let (values, unknowns) = conducted(scene, model, setup, body)?;
    let reference = thermal.reference.unwrap_or(0.0);
    solid.thermal = Some(ThermalStrain {
        expansion: thermal.expansion,
        rise: values.iter().map(|t| t - reference).collect(),
    });
    Ok(Added {
        numbers: vec![("temperature_unknowns".into(), unknowns as f64)],
        fields: vec![scalar("temperature", values)],
        bond_values: body.bond_values(),
    })
}

/// The potential in the body strained by `x`, where its bonds are piezoresistive: with probes their difference, and its change
/// relative to that of the unstrained body.
///
/// # Errors
/// Strain beyond the law of the bonds.
pub fn sense<const D: usize>(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    (solid, x): (&Solid<D>, &[[f64; D]]),
    conductor: Option<&Conductor>,
) -> Result<Added> {
    let Problem::Static {
        conduction: Some(steady),
        ..
    } = &model.problem
    else {
        return Ok(Added::default());
    };
    let (Some((body, _)), Some(law)) = (conductor, steady.piezoresistance()) else {
        return Ok(Added::default());
    };
    let strained = strained(law, setup, solid, x, 1.0, body, &[])?;
    let (values, unknowns) = conducted(scene, model, setup, &strained)?;
    let mut numbers = vec![("potential_unknowns".to_owned(), unknowns as f64)];
    if let Some(probes) = steady.probes {
        let here = drop(setup, probes, &values);
        let (at_rest, _) = conducted(scene, model, setup, body)?;
        let before = drop(setup, probes, &at_rest);
        numbers.push(("potential_drop".into(), here));
        numbers.push(("potential_drop_change".into(), here / before - 1.0));
    }
    Ok(Added {
        numbers,
        fields: vec![scalar("potential", values)],
        bond_values: strained.bond_values(),
    })
}

fn conducted(
    scene: &Setting,
    model: &Molecular,
    setup: &Setup,
    body: &Body<1>,
) -> Result<(Vec<f64>, usize)> {
    let held = setup.held(scene, model, CONDUCTED, STEADY, None)?;
    let force = loads(scene, model, setup, CONDUCTED, STEADY)?;
    let (values, unknowns) = solve(body, &setup.points, &held, &force)?;
    Ok((values.iter().map(|v| v[0]).collect(), unknowns))
}

/// The conductor with each intact bond's share changed by its stretch under `scale` times `x`; thermal strain is no stretch. `broken`,
/// by listed bond, may be empty: none is.
///
/// # Errors
/// A stretch at which a bond would conduct nothing or backwards.
pub fn strained<const D: usize>(
    law: Piezoresistance,
    setup: &Setup,
    solid: &Solid<D>,
    x: &[[f64; D]],
    scale: f64,
    conductor: &Body<1>,
    broken: &[bool],
) -> Result<Body<1>> {
    let mut body = conductor.clone();
    let mut worst = None;
    body.scale_each(|slot, p, q, kind| {
        if broken.get(slot) == Some(&true) {
            return 1.0;
        }
        let stretch = scale * solid.strained(x, p, q, &setup.bonds[kind]).stretch;
        law.factor(stretch).unwrap_or_else(|| {
            worst = Some((p, stretch));
            1.0
        })
    });
    let Some((p, stretch)) = worst else {
        return Ok(body);
    };
    let [x, y] = setup.points.position(p);
    Err(Error::setting(
        "conduction.piezoresistance",
        format!(
            "found {}: at [{x}, {y}] a bond stretched by {stretch:.3e} would conduct {:.3} of what it does at rest",
            law.slope,
            1.0 + law.slope * stretch
        ),
        "the linear law ends there: give a smaller number, or load the body less",
    ))
}

impl Steady {
    /// The law of the bonds, where strain changes what they conduct.
    pub fn piezoresistance(&self) -> Option<Piezoresistance> {
        self.piezoresistance.map(|slope| Piezoresistance { slope })
    }
}
