//! Owns `history.csv`: a scene's numbers over time, exact to the last bit.

use crate::error::{Error, Result};
use crate::io::atomic;
use crate::scene::frame::Frame;
use std::io::Write;
use std::path::Path;

/// Column `t`, then one for each number of the first frame. Without a frame nothing is written.
pub fn write(path: &Path, frames: &[Frame]) -> Result<()> {
    let Some(first) = frames.first() else {
        return Ok(());
    };
    let names: Vec<&str> = first.numbers.iter().map(|(n, _)| n.as_str()).collect();
    atomic::write_with(path, |out| {
        writeln!(out, "t,{}", names.join(","))?;
        for frame in frames {
            write!(out, "{}", frame.time)?;
            frame
                .numbers
                .iter()
                .try_for_each(|(_, v)| write!(out, ",{v}"))?;
            writeln!(out)?;
        }
        Ok(())
    })
}

/// The first `rows` rows of what [`write()`] left, as frames without fields.
pub fn read(path: &Path, rows: usize) -> Result<Vec<Frame>> {
    let bad = |found: String| {
        Error::file(
            path,
            found,
            "start the scene from the beginning with --force",
        )
    };
    let mut reader =
        csv::Reader::from_path(path).map_err(|e| bad(format!("cannot be read: {e}")))?;
    let header = reader.headers().map_err(|e| bad(e.to_string()))?.clone();
    let mut frames = Vec::new();
    for record in reader.records().take(rows) {
        let record = record.map_err(|e| bad(e.to_string()))?;
        let values: Option<Vec<f64>> = record.iter().map(|v| v.parse().ok()).collect();
        let line = frames.len() + 2;
        let values = values.ok_or_else(|| bad(format!("line {line} is not numbers")))?;
        let named = header.iter().map(str::to_owned).zip(values);
        let mut numbers: Vec<(String, f64)> = named.collect();
        let (_, time) = numbers.remove(0);
        frames.push(Frame {
            time,
            numbers,
            fields: Vec::new(),
        });
    }
    match frames.len() == rows {
        true => Ok(frames),
        false => Err(bad(format!("has {} rows of {rows}", frames.len()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_exactly() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("history.csv");
        let frame = |t: f64| Frame {
            time: t,
            numbers: vec![("a".into(), t / 3.0), ("b.c".into(), -1e-310)],
            fields: Vec::new(),
        };
        let frames = [frame(0.1), frame(0.7), frame(2.0)];
        write(&path, &frames).unwrap();
        let back = read(&path, 2).unwrap();
        assert_eq!(back.len(), 2);
        for (a, b) in back.iter().zip(&frames) {
            assert_eq!((a.time, &a.numbers), (b.time, &b.numbers));
        }
        assert!(
            read(&path, 4)
                .unwrap_err()
                .to_string()
                .contains("3 rows of 4")
        );
    }
}
