//! Owns the report's settings and its numbers: rows of solved scans in, tables and curves out.

use serde::{Deserialize, Serialize};

/// Settings of `report`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReportParams {
    pub title: String,
}

impl Default for ReportParams {
    fn default() -> Self {
        ReportParams {
            title: "Apparent stiffness of trabecular bone".to_owned(),
        }
    }
}
