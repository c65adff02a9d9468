//! Owns the text of an NRRD header: its fields by name.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::header::{Header, Next};
use std::path::Path;

/// All fields of the definition, without their blanks.
const FIELDS: [&str; 28] = [
    "dimension",
    "type",
    "blocksize",
    "encoding",
    "endian",
    "content",
    "oldmin",
    "oldmax",
    "datafile",
    "lineskip",
    "byteskip",
    "number",
    "sampleunits",
    "min",
    "max",
    "sizes",
    "spacings",
    "thicknesses",
    "axismins",
    "axismaxs",
    "centerings",
    "labels",
    "units",
    "kinds",
    "space",
    "spacedimension",
    "spaceunits",
    "spaceorigin",
];
const MORE_FIELDS: [&str; 2] = ["spacedirections", "measurementframe"];

/// Whether the data are numbers as text.
pub fn is_text(header: &Header) -> bool {
    let encoding = header.get("encoding").unwrap_or_default().to_lowercase();
    ["txt", "text", "ascii"].contains(&encoding.as_str())
}

/// What the definition does not know.
pub fn notes(header: &Header) -> Vec<String> {
    let known = |key: &str| FIELDS.contains(&key) || MORE_FIELDS.contains(&key);
    let unknown = header.fields.iter().filter(|(key, _)| !known(key));
    unknown
        .map(|(key, _)| format!("the header's `{key}` is no field of NRRD: it is not used"))
        .collect()
}

/// Reads lines up to the empty one, or up to the end where the data are in other files. Names are in small letters without blanks.
pub fn read(path: &Path) -> Result<Header> {
    let mut first = true;
    Header::read(path, ADVICE, |line, fields| {
        let line = line.unwrap_or_default();
        if !std::mem::take(&mut first) {
            return Ok(field(line, fields));
        }
        match line.starts_with("NRRD000") {
            true => Ok(Next::Line),
            false => Err(Error::file(
                path,
                "is no NRRD: it does not begin with NRRD000",
                ADVICE,
            )),
        }
    })
}

/// Keeps a field.
fn field(line: &str, fields: &mut Vec<(String, String)>) -> Next {
    if line.is_empty() {
        return Next::Data;
    }
    let Some((key, value)) = line.split_once(':') else {
        return Next::Line;
    };
    if line.starts_with('#') || value.starts_with('=') {
        return Next::Line;
    }
    let mut key: String = key
        .to_lowercase()
        .chars()
        .filter(|c| !c.is_whitespace())
        .collect();
    if key == "centers" {
        key = "centerings".into();
    }
    let value = value.trim();
    let is_list = key == "datafile" && value.split_whitespace().next() == Some("LIST");
    fields.push((key, value.to_string()));
    if is_list { Next::List } else { Next::Line }
}
