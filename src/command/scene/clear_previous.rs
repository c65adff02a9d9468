//! Owns the removal of what an earlier scene left in a folder: fields and maps of times that the next one does not write
//! would stay with its own and be taken for them.

use super::differences::time_of;
use crate::error::{Error, Result};
use std::collections::BTreeSet;
use std::path::Path;

/// Files of every scene, whatever its fields are called.
const ALWAYS: [&str; 7] = [
    "scene.json",
    "history.csv",
    "history.svg",
    "history.png",
    "difference.csv",
    "directions.csv",
    "fields.vtk.series",
];

/// Removes the results of an earlier scene from `out`, and nothing else.
///
/// # Errors
/// A file that cannot be removed.
pub fn clear(out: &Path) -> Result<()> {
    let entries = std::fs::read_dir(out).into_iter().flatten().flatten();
    let names: Vec<String> = entries
        .filter_map(|e| e.file_name().into_string().ok())
        .collect();
    let mut fields = BTreeSet::from(["difference".to_owned()]);
    for name in names.iter().filter(|n| time_of(n).is_some()) {
        if let Ok(mut reader) = csv::Reader::from_path(out.join(name))
            && let Ok(header) = reader.headers()
        {
            fields.extend(header.iter().map(str::to_owned));
        }
    }
    for name in names.iter().filter(|n| is_ours(n, &fields)) {
        let path = out.join(name);
        std::fs::remove_file(&path).map_err(|e| {
            Error::file(
                path,
                format!("is of an earlier scene and cannot be removed: {e}"),
                "remove it by hand, or choose another folder with -o",
            )
            .caused_by(e)
        })?;
    }
    Ok(())
}

fn is_ours(name: &str, fields: &BTreeSet<String>) -> bool {
    let of_a_time = |stem: &str| {
        let split = stem.rsplit_once("_t");
        split.is_some_and(|(field, t)| {
            t.parse::<f64>().is_ok() && (field == "fields" || fields.contains(field))
        })
    };
    if ALWAYS.contains(&name) {
        return true;
    }
    match name.rsplit_once('.') {
        Some((stem, "csv" | "vtk" | "png")) => of_a_time(stem),
        Some((stem, "gif")) => fields.contains(stem),
        _ => false,
    }
}
