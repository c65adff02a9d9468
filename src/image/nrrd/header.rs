//! Owns the text of an NRRD header: its fields by name.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::raw;
use std::io::BufRead;
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

pub struct Header {
    fields: Vec<(String, String)>,
    /// Bytes up to where the data begin, if they are in the same file.
    pub length: u64,
    /// Names of data files, where the header lists them.
    pub listed: Vec<String>,
}

impl Header {
    /// By its name in small letters without blanks.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.fields
            .iter()
            .find(|(k, _)| k == key)
            .map(|(_, v)| v.as_str())
    }

    pub fn words(&self, key: &str) -> Vec<&str> {
        self.get(key)
            .map_or_else(Vec::new, |v| v.split_whitespace().collect())
    }

    /// `"mm" "mm" "s"`: what stands between quotation marks.
    pub fn quoted(&self, key: &str) -> Vec<&str> {
        self.get(key)
            .map_or_else(Vec::new, |v| v.split('"').skip(1).step_by(2).collect())
    }

    pub fn is_text(&self) -> bool {
        let encoding = self.get("encoding").unwrap_or_default().to_lowercase();
        ["txt", "text", "ascii"].contains(&encoding.as_str())
    }

    /// What the definition does not know.
    pub fn notes(&self) -> Vec<String> {
        let known = |key: &str| FIELDS.contains(&key) || MORE_FIELDS.contains(&key);
        self.fields
            .iter()
            .filter(|(key, _)| !known(key))
            .map(|(key, _)| format!("the header's `{key}` is no field of NRRD: it is not used"))
            .collect()
    }
}

/// Reads lines up to the empty one, or up to the end where the data are in other files.
pub fn read(path: &Path) -> Result<Header> {
    let (mut source, _) = raw::open_plain(path)?;
    let mut header = Header {
        fields: Vec::new(),
        length: 0,
        listed: Vec::new(),
    };
    let (mut first, mut in_list) = (true, false);
    let mut line = Vec::new();
    loop {
        line.clear();
        let got = source
            .read_until(b'\n', &mut line)
            .map_err(|e| Error::file(path, format!("its header cannot be read: {e}"), ADVICE))?;
        header.length += got as u64;
        let text = String::from_utf8_lossy(&line);
        let text = text.trim_end();
        if std::mem::take(&mut first) {
            if !text.starts_with("NRRD000") {
                return Err(Error::file(
                    path,
                    "is no NRRD: it does not begin with NRRD000",
                    ADVICE,
                ));
            }
        } else if in_list {
            if !text.is_empty() {
                header.listed.push(text.trim().to_string());
            }
        } else if text.is_empty() {
            return Ok(header);
        } else {
            in_list = field(text, &mut header.fields);
        }
        if got == 0 {
            return Ok(header);
        }
    }
}

/// Keeps a field; true where a list of files follows.
fn field(line: &str, fields: &mut Vec<(String, String)>) -> bool {
    let Some((key, value)) = line.split_once(':') else {
        return false;
    };
    if line.starts_with('#') || value.starts_with('=') {
        return false;
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
    is_list
}
