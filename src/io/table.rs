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
    let mut reader = csv::Reader::from_path(path).map_err(|e| unreadable(path, e, None))?;
    let header = reader
        .headers()
        .map_err(|e| unreadable(path, e, None))?
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
        .map_err(|e| unreadable(path, e, Some(&header)))
}

fn unreadable(path: &Path, e: csv::Error, header: Option<&csv::StringRecord>) -> Error {
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
    .caused_by(e)
}
