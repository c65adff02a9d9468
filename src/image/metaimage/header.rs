//! Owns the text of a MetaImage header: its keys and values.

use super::ADVICE;
use crate::error::{Error, Result};
use crate::format::header::{Header, Next};
use std::path::Path;

/// Reads lines up to the one that names the data.
pub fn read(path: &Path) -> Result<Header> {
    Header::read(path, ADVICE, |line, fields| {
        let text = line.map(str::trim);
        if text.is_some_and(|text| text.is_empty() || text.starts_with('#')) {
            return Ok(Next::Line);
        }
        let Some((key, value)) = text.and_then(|text| text.split_once(['=', ':'])) else {
            return Err(Error::file(
                path,
                "is no MetaImage: its header does not name ElementDataFile",
                ADVICE,
            ));
        };
        let (key, value) = (key.trim(), value.trim());
        fields.push((key.into(), value.into()));
        Ok(match value.split_whitespace().next() {
            _ if !key.eq_ignore_ascii_case("ElementDataFile") => Next::Line,
            Some("LIST") => Next::List,
            _ => Next::Data,
        })
    })
}
