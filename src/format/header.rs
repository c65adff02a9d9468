//! Owns headers of text: lines with a name and a value, perhaps a list of files, then the data.

use crate::error::{Error, Result};
use crate::format::raw;
use std::io::BufRead;
use std::path::Path;

/// A header's fields and what follows them.
#[derive(Debug, Default)]
pub struct Header {
    /// Names and values in their order.
    pub fields: Vec<(String, String)>,
    /// Bytes up to where the data begin, if they are in the same file.
    pub length: u64,
    /// Names of data files, where the header lists them.
    pub listed: Vec<String>,
}

/// What comes after a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// A line of the header.
    Line,
    /// Names of files to the end.
    List,
    Data,
}

impl Header {
    /// Reads lines until `take` says that the data come next. It is given each line without the blanks at its end, None at the end of
    /// the file, and puts what it finds among the fields.
    pub fn read(
        path: &Path,
        advice: &str,
        mut take: impl FnMut(Option<&str>, &mut Vec<(String, String)>) -> Result<Next>,
    ) -> Result<Header> {
        let (mut source, _) = raw::open_plain(path)?;
        let mut header = Header::default();
        let mut next = Next::Line;
        let mut line = Vec::new();
        while next != Next::Data {
            line.clear();
            let got = source.read_until(b'\n', &mut line).map_err(|e| {
                Error::file(path, format!("its header cannot be read: {e}"), advice)
            })?;
            header.length += got as u64;
            let text = String::from_utf8_lossy(&line);
            let text = (got > 0).then(|| text.trim_end());
            next = match (next, text) {
                (Next::List, None) => Next::Data,
                (Next::List, Some(name)) => {
                    let name = Some(name.trim()).filter(|name| !name.is_empty());
                    header.listed.extend(name.map(str::to_owned));
                    Next::List
                }
                (_, text) => take(text, &mut header.fields)?,
            };
        }
        Ok(header)
    }

    /// The first value of that name, in letters of either case.
    pub fn get(&self, key: &str) -> Option<&str> {
        let mut fields = self.fields.iter();
        let field = fields.find(|(k, _)| k.eq_ignore_ascii_case(key));
        field.map(|(_, value)| value.as_str())
    }

    /// A value's words; none where it is missing.
    pub fn words(&self, key: &str) -> Vec<&str> {
        self.get(key)
            .map_or_else(Vec::new, |v| v.split_whitespace().collect())
    }

    /// `"mm" "mm" "s"`: what stands between quotation marks.
    pub fn quoted(&self, key: &str) -> Vec<&str> {
        self.get(key)
            .map_or_else(Vec::new, |v| v.split('"').skip(1).step_by(2).collect())
    }

    /// None where the value is missing or a word is no number.
    pub fn numbers(&self, key: &str) -> Option<Vec<f64>> {
        let words = self.get(key)?.split_whitespace();
        words.map(|w| w.parse().ok()).collect()
    }

    pub fn is_true(&self, key: &str) -> bool {
        self.get(key)
            .is_some_and(|v| v.eq_ignore_ascii_case("true") || v == "1")
    }

    pub fn is_false(&self, key: &str) -> bool {
        self.get(key)
            .is_some_and(|v| v.eq_ignore_ascii_case("false") || v == "0")
    }
}
