//! Owns how the answer of a scan was found, as the column `method` of `answers.csv` says it.

use crate::result::row::Row;
use crate::result::settings::{BoundaryRule, Method};
use serde::de::IntoDeserializer;
use serde::de::value::Error;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A method, of lattices with how they meet the surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FoundBy {
    /// The method of the row.
    pub method: Method,
    /// None for a single solve by elements.
    pub boundary: Option<BoundaryRule>,
}

/// How the word of a limit ends.
const LIMIT: &str = "-extrapolated";

impl FoundBy {
    /// How a row was found.
    pub fn of(row: &Row) -> FoundBy {
        FoundBy {
            method: row.key.method,
            boundary: row.key.boundary,
        }
    }

    /// As a reader says it.
    pub fn in_words(self) -> &'static str {
        match (self.boundary, self.method) {
            (Some(BoundaryRule::Ffb), _) => "FFB mean",
            (Some(BoundaryRule::Graded), _) => "connected or weighted lattice",
            (Some(BoundaryRule::Floppy), _) => "floppy lattice",
            (Some(BoundaryRule::Firm), _) => "firm lattice",
            (Some(BoundaryRule::Extrapolated), Method::Lattice) => {
                "connected or weighted lattices, extrapolated"
            }
            (Some(BoundaryRule::Extrapolated), _) => "voxel FE, extrapolated",
            (None, Method::VoxelFe) => "voxel FE",
            (None, Method::GeometryFe) => "geometry-based FE",
            (None, method) => method.name(),
        }
    }
}

impl fmt::Display for FoundBy {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match (self.boundary, self.method) {
            (Some(BoundaryRule::Extrapolated), Method::Lattice) => {
                write!(f, "{}{LIMIT}", BoundaryRule::Graded.name())
            }
            (Some(BoundaryRule::Extrapolated), method) => write!(f, "{}{LIMIT}", method.name()),
            (Some(boundary), _) => f.write_str(boundary.name()),
            (None, method) => f.write_str(method.name()),
        }
    }
}

fn method(word: &str) -> Result<Method, Error> {
    Method::deserialize(word.into_deserializer())
}

impl From<FoundBy> for String {
    fn from(found: FoundBy) -> String {
        found.to_string()
    }
}

impl TryFrom<String> for FoundBy {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        let of_limit = word.strip_suffix(LIMIT);
        let stem = of_limit.unwrap_or(&word).to_owned();
        let boundary = BoundaryRule::try_from(stem.clone());
        let method = match boundary {
            Ok(_) => Method::Lattice,
            Err(_) => method(&stem).map_err(|e| e.to_string())?,
        };
        Ok(FoundBy {
            method,
            boundary: match of_limit {
                Some(_) => Some(BoundaryRule::Extrapolated),
                None => boundary.ok(),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_as_they_are_written() {
        for word in [
            "floppy",
            "firm",
            "ffb",
            "graded",
            "voxel-fe",
            "geometry-fe",
            "graded-extrapolated",
            "voxel-fe-extrapolated",
        ] {
            let found = FoundBy::try_from(word.to_owned()).unwrap();
            assert_eq!(found.to_string(), word);
            assert_ne!(found.in_words(), "");
        }
        let words = FoundBy::try_from("by-eye".to_owned()).unwrap_err();
        assert!(words.contains("by-eye"), "{words}");
    }
}
