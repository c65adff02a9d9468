//! Owns shares of one: written as a number (0.03) or as a percentage ("3%"), on the command line and in files alike.

use serde::de::{Deserializer, Error, Unexpected, Visitor};
use std::fmt;

/// `0.1%` or `0.001`, as a share of one; of either sign.
///
/// # Errors
/// What was expected and found.
pub fn parse(word: &str) -> Result<f64, String> {
    let trimmed = word.trim();
    let (number, unit) = match trimmed.strip_suffix('%') {
        Some(percent) => (percent.trim(), 0.01),
        None => (trimmed, 1.0),
    };
    match number.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v * unit),
        _ => Err(format!("expected a number or a percentage, found `{word}`")),
    }
}

/// For a field of settings.
///
/// # Errors
/// Neither a number nor a percentage.
pub fn deserialize<'de, D: Deserializer<'de>>(input: D) -> Result<f64, D::Error> {
    input.deserialize_any(Share)
}

/// For a field that may be left out.
///
/// # Errors
/// As [`deserialize`].
pub fn optional<'de, D: Deserializer<'de>>(input: D) -> Result<Option<f64>, D::Error> {
    input.deserialize_any(OptionalShare)
}

struct Share;

impl Visitor<'_> for Share {
    type Value = f64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a number or a percentage, as 0.03 or \"3%\"")
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<f64, E> {
        Ok(v)
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<f64, E> {
        Ok(v as f64)
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<f64, E> {
        Ok(v as f64)
    }

    fn visit_str<E: Error>(self, v: &str) -> Result<f64, E> {
        parse(v).map_err(|_| E::invalid_value(Unexpected::Str(v), &self))
    }
}

struct OptionalShare;

impl<'de> Visitor<'de> for OptionalShare {
    type Value = Option<f64>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        Share.expecting(f)
    }

    fn visit_none<E: Error>(self) -> Result<Self::Value, E> {
        Ok(None)
    }

    fn visit_unit<E: Error>(self) -> Result<Self::Value, E> {
        Ok(None)
    }

    fn visit_some<D: Deserializer<'de>>(self, input: D) -> Result<Self::Value, D::Error> {
        deserialize(input).map(Some)
    }

    fn visit_f64<E: Error>(self, v: f64) -> Result<Self::Value, E> {
        Share.visit_f64(v).map(Some)
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<Self::Value, E> {
        Share.visit_i64(v).map(Some)
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<Self::Value, E> {
        Share.visit_u64(v).map(Some)
    }

    fn visit_str<E: Error>(self, v: &str) -> Result<Self::Value, E> {
        Share.visit_str(v).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_percentage_is_a_share() {
        assert_eq!(parse("0.5%"), Ok(0.005));
        assert_eq!(parse("-1 %"), Ok(-0.01));
        assert_eq!(parse("0.001"), Ok(0.001));
        for bad in ["", "%", "x%", "nan", "1%%"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
