//! Owns the refusal of numbers that are none, and of signs and exponents that cannot be.

use crate::error::{Error, Result};
use crate::scene::continuum_molecular::{KnownField, Molecular, Problem};
use crate::scene::setting::Setting;
use serde::Serialize;
use toml::Value;

/// Keys of regions: they may reach to infinity.
const REGIONS: [&str; 3] = ["region", "stop", "unbreakable"];

/// # Errors
/// Any number of the scene that is not finite, and those of the model that must be positive or whole.
pub fn check(scene: &Setting, model: &Molecular) -> Result<()> {
    finite(&table(scene)?, "", false)?;
    finite(&table(model)?, "physics.continuum-molecular", false)?;
    for (key, value) in positive(model) {
        if value <= 0.0 {
            let found = format!("found {value}");
            return Err(Error::setting(key, found, "give a positive number"));
        }
    }
    if matches!(&model.problem, Problem::Vibration { vibration, .. } if vibration.modes == 0) {
        let advice = "give at least one mode";
        return Err(Error::setting("vibration.modes", "found 0", advice));
    }
    let mut known = model.known.iter().enumerate();
    known.try_for_each(|(k, known)| exponents(k, &known.field))
}

fn table(settings: &impl Serialize) -> Result<Value> {
    Value::try_from(settings).map_err(|e| {
        Error::specimen(format!("the scene has no table: {e}"), "correct it").caused_by(e)
    })
}

/// Goes through a table; `region` says whether infinities will do.
fn finite(value: &Value, key: &str, region: bool) -> Result<()> {
    match value {
        Value::Float(v) if v.is_nan() || (v.is_infinite() && !region) => Err(Error::setting(
            key,
            format!("found {v}"),
            "give finite numbers",
        )),
        Value::Array(values) => {
            let mut values = values.iter().enumerate();
            values.try_for_each(|(k, v)| finite(v, &format!("{key}[{k}]"), region))
        }
        Value::Table(table) => table.iter().try_for_each(|(name, v)| {
            let below = match key {
                "" => name.clone(),
                _ => format!("{key}.{name}"),
            };
            finite(v, &below, region || REGIONS.contains(&name.as_str()))
        }),
        _ => Ok(()),
    }
}

fn positive(model: &Molecular) -> Vec<(&'static str, f64)> {
    let mut numbers = vec![("thickness", model.thickness)];
    if let Some(bending) = model.problem.elasticity().and_then(|e| e.bending) {
        numbers.push(("elasticity.bending.first", bending.first));
        numbers.push(("elasticity.bending.second", bending.second));
    }
    match &model.problem {
        Problem::Transient(transient) => numbers.push(("conduction.capacity", transient.capacity)),
        Problem::Vibration { vibration, .. } => {
            numbers.push(("vibration.density", vibration.density));
        }
        _ => {}
    }
    numbers
}

/// # Errors
/// Exponents other than whole numbers from 0 on: left of an axis the field would be no number.
fn exponents(k: usize, field: &KnownField) -> Result<()> {
    let KnownField::Polynomial(terms) = field else {
        return Ok(());
    };
    let mut exponents = terms.iter().flat_map(|[a, b, _]| [a, b]);
    match exponents.find(|e| e.fract() != 0.0 || **e < 0.0) {
        None => Ok(()),
        Some(wrong) => Err(Error::setting(
            format!("known[{k}].field.polynomial"),
            format!("found an exponent of {wrong}"),
            "give rows [a, b, c] of c x^a y^b with whole a and b from 0 on",
        )),
    }
}
