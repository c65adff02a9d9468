//! Owns how the lengths of load steps are chosen, and its words: `adaptive`, `adaptive/2`, or a number of even steps.

use serde::de::{Deserializer, Error, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;

/// How the load on tissue that yields grows to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LoadSteps {
    /// Lengths follow the stress-strain curve; all of them are divided by this number, which is 1 or more.
    Adaptive(u32),
    /// So many of one length, 1 or more.
    Even(u32),
}

impl Default for LoadSteps {
    fn default() -> Self {
        LoadSteps::Adaptive(1)
    }
}

impl LoadSteps {
    /// `adaptive`, `adaptive/N` or a number.
    ///
    /// # Errors
    /// What was expected and found.
    pub fn parse(word: &str) -> Result<LoadSteps, String> {
        let number = |word: &str| word.parse().ok().filter(|n| (1..=MOST).contains(n));
        let steps = match word.strip_prefix("adaptive") {
            None => number(word).map(LoadSteps::Even),
            Some("") => Some(LoadSteps::Adaptive(1)),
            Some(rest) => rest
                .strip_prefix('/')
                .and_then(number)
                .map(LoadSteps::Adaptive),
        };
        steps.ok_or_else(|| {
            format!(
                "expected a number of even load steps from 1 to {MOST}, adaptive, or adaptive/N, found `{word}`"
            )
        })
    }

    /// Steps of half the length.
    pub fn halved(self) -> LoadSteps {
        match self {
            LoadSteps::Adaptive(n) => LoadSteps::Adaptive(2 * n),
            LoadSteps::Even(n) => LoadSteps::Even(2 * n),
        }
    }

    /// Length of a step, over that of one whose number is 1. Comparable among adaptive steps, and among even ones.
    pub fn length(self) -> f64 {
        match self {
            LoadSteps::Adaptive(n) | LoadSteps::Even(n) => 1.0 / f64::from(n),
        }
    }

    /// Whether lengths are comparable.
    pub fn is_of_one_kind(self, other: LoadSteps) -> bool {
        matches!(self, LoadSteps::Even(_)) == matches!(other, LoadSteps::Even(_))
    }
}

/// More even steps are taken for a slip.
const MOST: u32 = 65_535;

impl fmt::Display for LoadSteps {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            LoadSteps::Adaptive(1) => write!(f, "adaptive"),
            LoadSteps::Adaptive(n) => write!(f, "adaptive/{n}"),
            LoadSteps::Even(n) => write!(f, "{n}"),
        }
    }
}

impl Serialize for LoadSteps {
    fn serialize<S: Serializer>(&self, out: S) -> Result<S::Ok, S::Error> {
        match self {
            LoadSteps::Adaptive(_) => out.collect_str(self),
            LoadSteps::Even(n) => out.serialize_u32(*n),
        }
    }
}

impl<'de> Deserialize<'de> for LoadSteps {
    fn deserialize<D: Deserializer<'de>>(input: D) -> Result<Self, D::Error> {
        input.deserialize_any(NumberOrWord)
    }
}

struct NumberOrWord;

impl Visitor<'_> for NumberOrWord {
    type Value = LoadSteps;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a number of load steps, \"adaptive\" or \"adaptive/N\"")
    }

    fn visit_u64<E: Error>(self, v: u64) -> Result<LoadSteps, E> {
        self.visit_str(&v.to_string())
    }

    fn visit_i64<E: Error>(self, v: i64) -> Result<LoadSteps, E> {
        self.visit_str(&v.to_string())
    }

    fn visit_str<E: Error>(self, v: &str) -> Result<LoadSteps, E> {
        LoadSteps::parse(v).map_err(E::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_read_and_said_alike() {
        for word in ["adaptive", "adaptive/2", "10", "1"] {
            assert_eq!(LoadSteps::parse(word).unwrap().to_string(), word);
        }
        for wrong in [
            "0",
            "-3",
            "adaptive/0",
            "adaptive2",
            "even",
            "",
            "2.5",
            "65536",
        ] {
            let said = LoadSteps::parse(wrong).unwrap_err();
            assert!(said.contains(&format!("found `{wrong}`")), "{said}");
        }
    }

    #[test]
    fn a_number_or_a_word_stands_in_files() {
        for (steps, text) in [
            (LoadSteps::Adaptive(1), "\"adaptive\""),
            (LoadSteps::Adaptive(4), "\"adaptive/4\""),
            (LoadSteps::Even(12), "12"),
        ] {
            assert_eq!(serde_json::to_string(&steps).unwrap(), text);
            assert_eq!(serde_json::from_str::<LoadSteps>(text).unwrap(), steps);
        }
        assert!(serde_json::from_str::<LoadSteps>("0").is_err());
    }
}
