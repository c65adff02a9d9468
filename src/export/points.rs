//! Owns files of values at the points of a plane grid: CSV, and legacy VTK files (binary) with a series file for
//! ParaView.

use crate::discretisation::plane::Points;
use crate::error::{Error, Result};
use crate::io::atomic;
use crate::scene::frame::{Field, Values};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Columns `x`, `y`, then one a scalar and two a vector.
pub fn write_csv(path: &Path, points: &Points, fields: &[Field]) -> Result<()> {
    let mut header = vec!["x".to_owned(), "y".to_owned()];
    for field in fields {
        match &field.values {
            Values::Scalar(_) => header.push(field.name.to_owned()),
            Values::Vector(_) => header.extend(["x", "y"].map(|a| format!("{}_{a}", field.name))),
        }
    }
    atomic::write_with(path, |out| {
        writeln!(out, "{}", header.join(","))?;
        for p in 0..points.len() {
            let [x, y] = points.position(p);
            write!(out, "{x},{y}")?;
            for field in fields {
                match &field.values {
                    Values::Scalar(v) => write!(out, ",{}", v[p])?,
                    Values::Vector(v) => write!(out, ",{},{}", v[p][0], v[p][1])?,
                }
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

/// Positions and one named column of a file that [`write_csv`] wrote.
pub fn read_column(path: &Path, name: &str) -> Result<Vec<([f64; 2], f64)>> {
    read_rows(
        path,
        name,
        "name the output folder of another scene with the same points",
    )
}

/// Positions of such a file.
pub fn read_positions(path: &Path) -> Result<Vec<[f64; 2]>> {
    let rows = read_column(path, "y")?;
    Ok(rows.into_iter().map(|(position, _)| position).collect())
}

fn read_rows(path: &Path, name: &str, advice: &str) -> Result<Vec<([f64; 2], f64)>> {
    let bad = |found: String| Error::file(path, found, advice);
    let mut reader =
        csv::Reader::from_path(path).map_err(|e| bad(format!("cannot be read: {e}")))?;
    let header = reader.headers().map_err(|e| bad(e.to_string()))?.clone();
    let place = |what: &str| {
        header
            .iter()
            .position(|h| h == what)
            .ok_or_else(|| bad(format!("has no column \"{what}\"")))
    };
    let columns = [place("x")?, place("y")?, place(name)?];
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| bad(e.to_string()))?;
        let number = |c: usize| record.get(c).and_then(|v| v.parse::<f64>().ok());
        let [Some(x), Some(y), Some(v)] = columns.map(number) else {
            return Err(bad(format!("line {} is not numbers", rows.len() + 2)));
        };
        rows.push(([x, y], v));
    }
    Ok(rows)
}

/// The corners of a polygon: columns `x` and `y`.
pub fn read_corners(path: &Path) -> Result<Vec<[f64; 2]>> {
    let rows = read_rows(
        path,
        "y",
        "give the corners of an outline as a CSV file with columns x,y",
    )?;
    Ok(rows.into_iter().map(|(corner, _)| corner).collect())
}

/// A legacy VTK file of vertices with point data.
pub fn write_vtk(path: &Path, points: &Points, fields: &[Field], time: f64) -> Result<()> {
    atomic::write_with(path, |out| {
        let n = points.len();
        writeln!(
            out,
            "# vtk DataFile Version 3.0\nt = {time}\nBINARY\nDATASET POLYDATA\nPOINTS {n} float"
        )?;
        for p in 0..n {
            let [x, y] = points.position(p);
            floats(out, [x, y, 0.0])?;
        }
        writeln!(out, "\nVERTICES {n} {}", 2 * n)?;
        for p in 0..n as i32 {
            out.write_all(&1i32.to_be_bytes())?;
            out.write_all(&p.to_be_bytes())?;
        }
        writeln!(out, "\nPOINT_DATA {n}")?;
        for field in fields {
            match &field.values {
                Values::Scalar(v) => {
                    writeln!(out, "SCALARS {} float 1\nLOOKUP_TABLE default", field.name)?;
                    v.iter().try_for_each(|&v| floats(out, [v]))?;
                }
                Values::Vector(v) => {
                    writeln!(out, "VECTORS {} float", field.name)?;
                    v.iter().try_for_each(|v| floats(out, [v[0], v[1], 0.0]))?;
                }
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

fn floats<const N: usize>(out: &mut impl Write, values: [f64; N]) -> std::io::Result<()> {
    values
        .iter()
        .try_for_each(|&v| out.write_all(&(v as f32).to_be_bytes()))
}

/// ParaView's list of files and their times.
pub fn write_series(path: &Path, files: &[(PathBuf, f64)]) -> Result<()> {
    let entry = |(file, time): &(PathBuf, f64)| {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        serde_json::json!({ "name": name, "time": time })
    };
    let entries: Vec<_> = files.iter().map(entry).collect();
    let series = serde_json::json!({ "file-series-version": "1.0", "files": entries });
    atomic::write(path, format!("{series:#}\n"))
}
