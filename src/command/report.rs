//! Owns `report` on disk: rows of any number of solved scans in; tables, plots and pages out.

use crate::error::Result;
use crate::grid::Axis;
use crate::io::{atomic, table};
use crate::machine::host;
use crate::machine::session::Session;
use crate::measure::spheres::Spread;
use crate::recipe::Recipe;
use crate::record::collect_rows::CollectedRows;
use crate::record::failures::Failure;
use crate::record::results;
use crate::record::specimen;
use crate::record::specimen::SegmentRecord;
use crate::report::html;
use crate::report::html::{ScanPage, Source};
use crate::report::{Report, ReportParams, report as assemble};
use crate::report::{markdown, plot};
use crate::result::ffb::with_ffb;
use crate::result::row::Row;
use std::path::{Path, PathBuf};

/// The recipe as it was run, in the output folder of a run.
pub const RECIPE: &str = "recipe.toml";

/// Reads `results.csv` of each folder (a solved scan, or the output of a run) and writes the report into `out`. Scans that
/// were solved again in their own folders after the run are read from there. Returns the files written.
pub fn report(dirs: &[PathBuf], out: &Path, session: &Session) -> Result<Vec<PathBuf>> {
    let mut found = CollectedRows::default();
    for dir in dirs {
        found.add(dir, session)?;
    }
    let CollectedRows { rows, failures } = found;
    session.detail(format!("{} rows from {} folders", rows.len(), dirs.len()));
    let recipe = dirs
        .iter()
        .find_map(|dir| std::fs::read_to_string(dir.join(RECIPE)).ok());
    let params = recipe
        .as_deref()
        .and_then(|text| Recipe::parse(text, Path::new(RECIPE)).ok())
        .map_or_else(ReportParams::default, |recipe| recipe.report);
    // Means of older programs do not say whether they are converged.
    let rows = with_ffb(&rows);
    write(&rows, &failures, &params, dirs, recipe, out, session)
}

/// Writes the report of `rows` into `out`. `dirs` are searched for what is known of the scans.
pub fn write(
    rows: &[Row],
    failures: &[Failure],
    params: &ReportParams,
    dirs: &[PathBuf],
    recipe: Option<String>,
    out: &Path,
    session: &Session,
) -> Result<Vec<PathBuf>> {
    let mut report = assemble(rows, params);
    let failed = failures.iter().map(|f| {
        let reason = f.reason.lines().next().unwrap_or_default();
        format!("{}: failed, no results: {reason}", f.scan)
    });
    report.notes.splice(0..0, failed);
    let mut files = render(&report, session)?;
    let source = Source {
        recipe,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: host::date(),
        host: host::name(),
    };
    let page = html::render(&report, &pages(rows, dirs), &source)?;
    files.push(("report.html".to_owned(), page.into_bytes()));
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| out.join(name)).collect();
    if session.dry_run {
        session.say(format!(
            "would write {} files into {}",
            paths.len(),
            out.display()
        ));
        return Ok(paths);
    }
    atomic::sweep(out);
    for ((_, bytes), path) in files.iter().zip(&paths) {
        atomic::write(path, bytes)?;
    }
    session.say(format!("{}: {} files", out.display(), paths.len()));
    Ok(paths)
}

/// Name and content of every file of a report but the page.
fn render(report: &Report, session: &Session) -> Result<Vec<(String, Vec<u8>)>> {
    let text = |name: &str, content: String| (name.to_owned(), content.into_bytes());
    let mut files = vec![
        text("report.md", markdown::render(report)),
        text("e_app.csv", table::to_csv(&report.lines)),
        text(results::TABLE, table::to_csv(&report.rows)),
    ];
    let statistics = &report.statistics;
    if !statistics.boxes.is_empty() {
        let anova: Vec<_> = statistics.anova.into_iter().collect();
        files.push(text(
            "regressions.csv",
            table::to_csv(&statistics.regressions),
        ));
        files.push(text("agreement.csv", table::to_csv(&statistics.agreements)));
        files.push(text("distributions.csv", table::to_csv(&statistics.boxes)));
        files.push(text("anova.csv", table::to_csv(&anova)));
    }
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

/// A page for each scan of `rows`.
fn pages(rows: &[Row], dirs: &[PathBuf]) -> Vec<ScanPage> {
    let mut pages: Vec<ScanPage> = Vec::new();
    for row in rows {
        if pages.iter().all(|page| page.scan != row.key.scan) {
            pages.push(page(&row.key.scan, dirs));
        }
    }
    pages
}

fn page(scan: &str, dirs: &[PathBuf]) -> ScanPage {
    let places = dirs.iter().flat_map(|dir| [dir.join(scan), dir.clone()]);
    let found = places
        .filter_map(|dir| specimen::record(&dir).map(|record| (dir, record)))
        .find(|(_, record)| record.scan == scan);
    let Some((dir, record)) = found else {
        return ScanPage {
            scan: scan.to_owned(),
            ..ScanPage::default()
        };
    };
    ScanPage {
        scan: scan.to_owned(),
        picture: std::fs::read(dir.join(specimen::PICTURE)).ok(),
        facts: facts(&record),
    }
}

fn facts(record: &SegmentRecord) -> Vec<(String, String)> {
    let results = &record.results;
    let three = |values: [String; 3]| values.join(" × ");
    let mut facts = vec![
        ("input", record.input.path.display().to_string()),
        ("BLAKE3 of the input", record.input.blake3.clone()),
        ("format", record.input.format.clone()),
        ("voxels", three(results.voxels.map(|n| n.to_string()))),
        (
            "voxel size (mm)",
            three(results.spacing_mm.map(|h| h.to_string())),
        ),
        ("threshold", threshold(record)),
        ("BV (mm³)", format!("{:.4}", results.bv_mm3)),
        (
            "TV (mm³)",
            format!("{:.4}, {}", results.tv_mm3, results.tv_definition),
        ),
        ("BV/TV", format!("{:.4}", results.bv_tv)),
        (
            "voxels removed as unconnected",
            results.removed_voxels.to_string(),
        ),
    ];
    if record.settings.turn != Axis::Z {
        let turned = format!("its {} axis is now z", record.settings.turn.name());
        facts.push(("turned", turned));
    }
    if let Some(r) = results.rotation {
        let [x, y, z] = r.direction;
        let words = format!(
            "by {:.1}°, ({x:.3}, {y:.3}, {z:.3}) is now z; a box of {:.0} % of the volume",
            r.angle_deg,
            100.0 * r.kept
        );
        facts.push(("rotated", words));
    }
    if let Some([low, high]) = results.plane_cut_mm {
        facts.push(("ends cut flat (mm)", format!("{low:.3} and {high:.3}")));
    }
    if let Some(t) = results.mean_thickness_mm {
        facts.push(("mean strut thickness (mm)", format!("{t:.3}")));
    }
    if let Some(m) = &results.morphometry {
        let spread = |s: &Option<Spread>| {
            s.as_ref().map_or("NA".into(), |s| {
                format!("{:.3} ± {:.3}", s.mean_mm, s.sd_mm)
            })
        };
        facts.push(("Tb.Th (mm)", spread(&m.tb_th)));
        facts.push(("Tb.Sp (mm)", spread(&m.tb_sp)));
        facts.push(("Conn.D (1/mm³)", format!("{:.3}", m.conn_d_per_mm3)));
        let da = m.fabric.map_or("NA".into(), |f| format!("{:.3}", f.da));
        facts.push(("DA", da));
    }
    facts.extend(results.warnings.iter().map(|w| ("warning", w.clone())));
    facts
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
}

fn threshold(record: &SegmentRecord) -> String {
    let (lower, upper) = (record.results.lower, record.results.upper);
    let unit = record
        .input
        .unit
        .as_deref()
        .unwrap_or("in the image's units");
    // Otsu's threshold has digits that mean nothing.
    let bound =
        |v: Option<f64>| v.map_or("∞".to_owned(), |v| ((v * 1e3).round() / 1e3).to_string());
    format!(
        "{}: {} to {} {unit}",
        record.results.threshold,
        bound(lower),
        bound(upper)
    )
}
