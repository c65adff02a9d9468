//! Owns the errors that were asked for, by the condition under which.

use crate::result::condition::Condition;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Relative errors asked for (0.1 is 10 %), by the condition in words.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Targets(BTreeMap<String, f64>);

impl Targets {
    /// The error asked for under a condition; None where none was.
    pub fn of(&self, condition: &Condition) -> Option<f64> {
        self.0.get(&condition.in_words()).copied()
    }

    /// Notes the error asked for under a condition.
    pub fn set(&mut self, condition: &Condition, target: f64) {
        self.set_in_words(condition.in_words(), target);
    }

    /// Of a condition as [`Condition::in_words`] has it.
    pub fn set_in_words(&mut self, condition: String, target: f64) {
        self.0.insert(condition, target);
    }
}
