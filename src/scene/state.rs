//! Owns a scene's state between two steps as plain named numbers: what a stopped scene resumes from.

use crate::error::{Error, Result};
use std::collections::BTreeMap;

/// Arrays by name; a single number is an array of one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State(BTreeMap<String, Vec<f64>>);

impl State {
    pub fn put(&mut self, name: &str, values: impl Into<Vec<f64>>) {
        self.0.insert(name.to_owned(), values.into());
    }

    /// All arrays in order of their names.
    pub fn arrays(&self) -> impl ExactSizeIterator<Item = (&str, &[f64])> {
        self.0.iter().map(|(n, v)| (n.as_str(), v.as_slice()))
    }

    pub fn find(&self, name: &str) -> Option<&[f64]> {
        self.0.get(name).map(Vec::as_slice)
    }

    /// Array `name` of `len` numbers; refused where there is no such array.
    pub fn array(&self, name: &str, len: usize) -> Result<&[f64]> {
        let found = self.find(name).filter(|v| v.len() == len);
        found.ok_or_else(|| {
            Error::specimen(
                format!("the kept state of this scene has no {len} numbers \"{name}\""),
                "start from the beginning with --force",
            )
        })
    }

    pub fn number(&self, name: &str) -> Result<f64> {
        Ok(self.array(name, 1)?[0])
    }
}
