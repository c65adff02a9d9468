//! Owns supports and loads by label as settings: which label of an image is held, moved or pushed, and their words.

use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::str::FromStr;

/// `LABEL[:xyz]`: nodes of this label keep these components at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct HeldLabel {
    /// Value of the label image.
    pub label: i32,
    /// Which of x, y, z are held.
    pub components: [bool; 3],
}

/// `LABEL:ux,uy,uz`: nodes of this label are displaced by so many mm; a component written as `-` is left free.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct MovedLabel {
    /// Value of the label image.
    pub label: i32,
    /// Displacement in mm; None: free.
    pub by_mm: [Option<f64>; 3],
}

/// `LABEL:fx,fy,fz`: this total force in N acts on the nodes of the label, spread evenly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct PushedLabel {
    /// Value of the label image.
    pub label: i32,
    /// Total force in N.
    pub force_n: [f64; 3],
}

const AXES: [char; 3] = ['x', 'y', 'z'];

fn label(word: &str, whole: &str) -> Result<i32, String> {
    let parsed = word.trim().parse().ok().filter(|label| *label != 0);
    parsed.ok_or_else(|| {
        format!("expected a label, a whole number other than 0, before the colon, found `{whole}`")
    })
}

/// Three parts behind the colon.
fn three<'a>(word: &'a str, form: &str) -> Result<(i32, [&'a str; 3]), String> {
    let wrong = || format!("expected {form}, found `{word}`");
    let (name, rest) = word.split_once(':').ok_or_else(wrong)?;
    let parts: Vec<&str> = rest.split(',').map(str::trim).collect();
    let parts = parts.try_into().map_err(|_| wrong())?;
    Ok((label(name, word)?, parts))
}

fn number(part: &str, whole: &str) -> Result<f64, String> {
    let parsed = part.parse().ok().filter(|v: &f64| v.is_finite());
    parsed.ok_or_else(|| format!("expected a number, found `{part}` in `{whole}`"))
}

impl FromStr for HeldLabel {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let (name, axes) = word.split_once(':').unwrap_or((word, "xyz"));
        let known = !axes.is_empty() && axes.chars().all(|c| AXES.contains(&c));
        if !known {
            return Err(format!(
                "expected LABEL or LABEL: and some of x, y, z, as 2 or 2:xy, found `{word}`"
            ));
        }
        Ok(HeldLabel {
            label: label(name, word)?,
            components: AXES.map(|axis| axes.contains(axis)),
        })
    }
}

impl FromStr for MovedLabel {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let form = "LABEL:ux,uy,uz in mm, as 3:0,0,-0.1 (- leaves a component free)";
        let (label, parts) = three(word, form)?;
        let mut by_mm = [None; 3];
        for (by, part) in by_mm.iter_mut().zip(parts) {
            *by = match part {
                "-" => None,
                _ => Some(number(part, word)?),
            };
        }
        match by_mm.iter().all(Option::is_none) {
            true => Err(format!(
                "no component of `{word}` is moved: expected {form}"
            )),
            false => Ok(MovedLabel { label, by_mm }),
        }
    }
}

impl FromStr for PushedLabel {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let form = "LABEL:fx,fy,fz in N, as 3:0,0,-10";
        let (label, parts) = three(word, form)?;
        let mut force_n = [0.0; 3];
        for (f, part) in force_n.iter_mut().zip(parts) {
            *f = number(part, word)?;
        }
        match force_n.iter().all(|f| *f == 0.0) {
            true => Err(format!("`{word}` is no force: expected {form}")),
            false => Ok(PushedLabel { label, force_n }),
        }
    }
}

impl Display for HeldLabel {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let axes = AXES.iter().zip(self.components).filter(|(_, held)| *held);
        let axes: String = axes.map(|(axis, _)| *axis).collect();
        write!(f, "{}:{axes}", self.label)
    }
}

impl Display for MovedLabel {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let parts = self
            .by_mm
            .map(|by| by.map_or("-".to_owned(), |v| v.to_string()));
        write!(f, "{}:{}", self.label, parts.join(","))
    }
}

impl Display for PushedLabel {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let [x, y, z] = self.force_n;
        write!(f, "{}:{x},{y},{z}", self.label)
    }
}

/// Reads and writes a setting as its words.
macro_rules! as_words {
    ($($kind:ty),+) => {$(
        impl TryFrom<String> for $kind {
            type Error = String;

            fn try_from(word: String) -> Result<Self, String> {
                word.parse()
            }
        }

        impl From<$kind> for String {
            fn from(value: $kind) -> String {
                value.to_string()
            }
        }
    )+};
}

as_words!(HeldLabel, MovedLabel, PushedLabel);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_and_said_alike() {
        assert_eq!("2".parse::<HeldLabel>().unwrap().to_string(), "2:xyz");
        for word in ["2:xyz", "7:z", "-3:xy"] {
            assert_eq!(word.parse::<HeldLabel>().unwrap().to_string(), word);
        }
        for word in ["3:0,0,-0.1", "3:-,-,0.25"] {
            assert_eq!(word.parse::<MovedLabel>().unwrap().to_string(), word);
        }
        let pushed: PushedLabel = "4: 0, 1e3,-10".parse().unwrap();
        assert_eq!((pushed.label, pushed.force_n), (4, [0.0, 1000.0, -10.0]));
    }

    #[test]
    fn what_is_no_support_is_refused_in_words() {
        for (said, found) in [
            ("some of x, y, z", "2:w".parse::<HeldLabel>().err()),
            ("some of x, y, z", "2:".parse::<HeldLabel>().err()),
            ("other than 0", "0".parse::<HeldLabel>().err()),
            ("LABEL:ux,uy,uz", "3:0,0".parse::<MovedLabel>().err()),
            ("LABEL:ux,uy,uz", "3".parse::<MovedLabel>().err()),
            ("a number", "3:0,0,inf".parse::<MovedLabel>().err()),
            ("no component", "3:-,-,-".parse::<MovedLabel>().err()),
            ("is no force", "3:0,0,0".parse::<PushedLabel>().err()),
            ("a number", "3:0,0,-".parse::<PushedLabel>().err()),
        ] {
            let found = found.unwrap();
            assert!(found.contains(said), "{said}: {found}");
        }
    }
}
