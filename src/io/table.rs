//! Owns `results.csv`: any plain record as a row, missing values as `NA`.

use crate::error::{Error, Result};
use crate::io::atomic;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::path::Path;

/// Records as CSV text: a header of field names, then one line per record. `None` is `NA`; numbers read back to the bit.
///
/// # Panics
/// If a record is not a struct of plain values (a bug in the caller).
pub fn to_csv<T: Serialize + Default>(records: &[T]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut line = |cells: Vec<String>| writer.write_record(cells).expect("memory does not fail");
    line(
        fields(&T::default())
            .into_iter()
            .map(|(name, _)| name)
            .collect(),
    );
    for record in records {
        line(
            fields(record)
                .iter()
                .map(|(_, value)| cell(value))
                .collect(),
        );
    }
    let bytes = writer.into_inner().expect("memory does not fail");
    String::from_utf8(bytes).expect("cells are text")
}

fn fields<T: Serialize>(record: &T) -> Vec<(String, Value)> {
    match serde_json::to_value(record) {
        Ok(Value::Object(map)) => map.into_iter().collect(),
        _ => panic!("a record is a struct of plain values"),
    }
}

fn cell(value: &Value) -> String {
    match value {
        Value::Null => "NA".to_owned(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// Writes records whole.
pub fn write<T: Serialize + Default>(path: &Path, records: &[T]) -> Result<()> {
    atomic::write(path, to_csv(records))
}

/// Reads records back. Unknown columns are ignored, missing ones take their default.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    let mut reader = csv::Reader::from_path(path).map_err(|e| unreadable(path, &e, None))?;
    let header = reader
        .headers()
        .map_err(|e| unreadable(path, &e, None))?
        .clone();
    reader
        .records()
        .map(|record| {
            let cells: csv::StringRecord = record?
                .iter()
                .map(|cell| if cell == "NA" { "" } else { cell })
                .collect();
            cells.deserialize(Some(&header))
        })
        .collect::<Result<_, _>>()
        .map_err(|e| unreadable(path, &e, Some(&header)))
}

fn unreadable(path: &Path, e: &csv::Error, header: Option<&csv::StringRecord>) -> Error {
    let column = match e.kind() {
        csv::ErrorKind::Deserialize { err, .. } => err.field(),
        _ => None,
    };
    let column = column.and_then(|i| header?.get(i as usize));
    let place = column.map_or(String::new(), |name| format!(" in column `{name}`"));
    Error::file(
        path,
        format!("expected a table of results, could not read it{place}: {e}"),
        "run `solve` again for this scan, or leave the folder out",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::row::Row;

    /// The contract's columns, in order; more may follow.
    const COLUMNS: &str = "scan,method,structure,boundary,lp_mm,registration,voxel_mm,young_mpa,poisson,load,ends,axis,\
        strain,grip_mm,tv_definition,tv_mm3,bv_tv,sites,dropped_sites,unknowns,iterations,residual,converged,e_app_mpa,\
        e_app_reaction_mpa,e_app_stress_mpa,algebraic_error_mpa,discretization_error_mpa,wall_s,peak_mib";

    fn row() -> Row {
        Row {
            scan: "core, \"left\"".to_owned(),
            lp_mm: 0.1 + 0.2,
            voxel_mm: "0.02".to_owned(),
            residual: Some(1.0 / 3.0 * 1e-12),
            sites: Some(7),
            converged: Some(false),
            ..Row::default()
        }
    }

    #[test]
    fn the_columns_are_the_contracts() {
        assert!(to_csv::<Row>(&[]).starts_with(COLUMNS));
    }

    #[test]
    fn missing_values_are_na() {
        let text = to_csv(&[row()]);
        assert!(
            text.lines().nth(1).unwrap().ends_with(",NA,NA,NA,NA"),
            "{text}"
        );
    }

    #[test]
    fn rows_survive_writing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        write(&path, &[row(), Row::default()]).unwrap();
        assert_eq!(read::<Row>(&path).unwrap(), [row(), Row::default()]);
    }

    #[test]
    fn a_table_of_something_else_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.csv");
        std::fs::write(&path, "scan,lp_mm\na,thick\n").unwrap();
        let words = read::<Row>(&path).unwrap_err().to_string();
        assert!(
            words.contains("results.csv") && words.contains("lp_mm"),
            "{words}"
        );
    }
}
