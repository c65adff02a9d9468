//! Owns the tables of a scan's page on failure, sections and tissue.

use crate::record::results;
use crate::report::cells::{Table, records};
use crate::result::details::Details;
use crate::result::settings::{Load, Sed, Settings};
use serde::Serialize;
use std::path::Path;

/// A line with the load that it is of.
#[derive(Serialize)]
struct Shown<'a, T> {
    /// Lattice parameter or element.
    lp_mm: f64,
    load: Load,
    young_mpa: f64,
    sed: Option<Sed>,
    #[serde(flatten)]
    says: &'a T,
}

/// Captions and tables of the solves in `dir`, as far as there are some.
pub(super) fn tables(dir: &Path) -> Vec<(String, Table)> {
    let all = results::details(dir);
    let found = [
        (
            "What has flowed of each tissue at the end of the load",
            table(&all, |d| &d.yielded),
        ),
        (
            "Failure by Pistoia's criterion at several critical volumes",
            table(&all, |d| &d.failure),
        ),
        (
            "What each tissue carries at both ends and in the middle",
            table(&all, |d| &d.sections),
        ),
        (
            "Strains and stresses by tissue, over its elements",
            table(&all, |d| &d.tissue),
        ),
        (
            "Forces and moments that the supports put on both ends",
            table(&all, |d| &d.ends),
        ),
    ];
    let filled = found
        .into_iter()
        .filter(|(_, table)| !table.body.is_empty());
    filled
        .map(|(caption, table)| (caption.to_owned(), table))
        .collect()
}

fn table<T: Serialize>(all: &[(Settings, Details)], lines: impl Fn(&Details) -> &[T]) -> Table {
    let shown = all.iter().flat_map(|(key, details)| {
        lines(details).iter().map(move |says| Shown {
            lp_mm: (key.lp_mm * 1e5).round() / 1e5,
            load: key.load,
            young_mpa: key.young_mpa,
            sed: key.sed,
            says,
        })
    });
    records(&shown.collect::<Vec<_>>())
}
