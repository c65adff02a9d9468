//! Owns `report` on disk: rows of any number of solved scans in; tables, plots and pages out.

use crate::error::{Error, Result};
use crate::io::{atomic, markdown, plot, table};
use crate::measure::row::Row;
use crate::run::session::Session;
use crate::stage::report::{Report, ReportParams, report as assemble};
use std::path::{Path, PathBuf};

/// Reads `results.csv` of each folder (a solved scan, or the output of a run) and writes the report into `out`. Returns
/// the files written.
pub fn report(dirs: &[PathBuf], out: &Path, session: &Session) -> Result<Vec<PathBuf>> {
    let mut rows: Vec<Row> = Vec::new();
    for dir in dirs {
        rows.extend(table::read(&results_file(dir)?)?);
    }
    session.detail(format!("{} rows from {} folders", rows.len(), dirs.len()));
    write(&rows, &ReportParams::default(), out, session)
}

fn results_file(dir: &Path) -> Result<PathBuf> {
    let file = dir.join("results.csv");
    match file.is_file() {
        true => Ok(file),
        false => Err(Error::file(
            dir,
            "expected a folder with results.csv, found none",
            "name folders that `solve` or `run` has written to",
        )),
    }
}

/// Writes the report of `rows` into `out`.
pub fn write(
    rows: &[Row],
    params: &ReportParams,
    out: &Path,
    session: &Session,
) -> Result<Vec<PathBuf>> {
    let files = render(&assemble(rows, params), session)?;
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| out.join(name)).collect();
    if session.dry_run {
        session.say(format!(
            "would write {} files into {}",
            paths.len(),
            out.display()
        ));
        return Ok(paths);
    }
    for ((_, bytes), path) in files.iter().zip(&paths) {
        atomic::write(path, bytes)?;
    }
    session.say(format!("{}: {} files", out.display(), paths.len()));
    Ok(paths)
}

/// Name and content of every file of a report.
fn render(report: &Report, session: &Session) -> Result<Vec<(String, Vec<u8>)>> {
    let mut files = vec![
        (
            "report.md".to_owned(),
            markdown::render(report).into_bytes(),
        ),
        (
            "e_app.csv".to_owned(),
            table::to_csv(&report.lines).into_bytes(),
        ),
        (
            "results.csv".to_owned(),
            table::to_csv(&report.rows).into_bytes(),
        ),
    ];
    let bar = session.bar(report.figures.len() as u64, "drawing figures");
    for figure in &report.figures {
        let drawing = plot::draw(figure);
        files.push((format!("{}.svg", figure.stem), drawing.svg().into_bytes()));
        files.push((format!("{}.png", figure.stem), drawing.png()?));
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(files)
}
