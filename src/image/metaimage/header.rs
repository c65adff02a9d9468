//! Owns the text of a MetaImage header: its keys and values.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::raw;
use std::io::BufRead;
use std::path::Path;

pub struct Header {
    fields: Vec<(String, String)>,
    /// Bytes up to and including the line that names the data.
    pub length: u64,
    /// Lines after it, where it says LIST.
    pub listed: Vec<String>,
}

impl Header {
    pub fn get(&self, key: &str) -> Option<&str> {
        self.fields
            .iter()
            .find(|(k, _)| k.eq_ignore_ascii_case(key))
            .map(|(_, v)| v.as_str())
    }

    pub fn is_true(&self, key: &str) -> bool {
        self.get(key)
            .is_some_and(|v| v.eq_ignore_ascii_case("true") || v == "1")
    }

    pub fn is_false(&self, key: &str) -> bool {
        self.get(key)
            .is_some_and(|v| v.eq_ignore_ascii_case("false") || v == "0")
    }

    /// None where a word is no number.
    pub fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        self.get(key)?
            .split_whitespace()
            .map(|w| w.parse().ok())
            .collect()
    }

    pub fn starts_with(&self, key: &str) -> bool {
        self.fields.iter().any(|(k, _)| k.starts_with(key))
    }
}

/// Reads lines up to the one that names the data.
pub fn read(path: &Path) -> Result<Header> {
    let (mut source, _) = raw::open_plain(path)?;
    let mut header = Header {
        fields: Vec::new(),
        length: 0,
        listed: Vec::new(),
    };
    let mut line = Vec::new();
    let mut list = false;
    loop {
        line.clear();
        let got = source
            .read_until(b'\n', &mut line)
            .map_err(|e| Error::file(path, format!("its header cannot be read: {e}"), ADVICE))?;
        if got == 0 && list {
            return Ok(header);
        }
        let text = String::from_utf8_lossy(&line);
        let text = text.trim();
        if list {
            header
                .listed
                .extend((!text.is_empty()).then(|| text.to_string()));
            continue;
        }
        header.length += got as u64;
        if text.is_empty() && got > 0 || text.starts_with('#') {
            continue;
        }
        let Some((key, value)) = text.split_once(['=', ':']) else {
            return Err(Error::file(
                path,
                "is no MetaImage: its header does not name ElementDataFile",
                ADVICE,
            ));
        };
        let (key, value) = (key.trim(), value.trim());
        let last = key.eq_ignore_ascii_case("ElementDataFile");
        header.fields.push((key.into(), value.into()));
        if last && value.split_whitespace().next() != Some("LIST") {
            return Ok(header);
        }
        list = last;
    }
}
