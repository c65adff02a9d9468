//! Owns `report` on disk: rows of any number of solved scans in; tables, plots and pages out.

mod details;
mod facts;
mod folders;
mod methods;
mod stiffness;
mod views;

use crate::command::stiffness::RECORD;
use crate::command::{answer, fields};
use crate::error::Result;
use crate::io::own_files::{ANSWERS, RECIPE, RESULTS};
use crate::io::{atomic, table};
use crate::machine::host;
use crate::machine::session::Session;
use crate::recipe::Recipe;
use crate::record::collect_rows::CollectedRows;
use crate::record::details::{
    FAILURE, LABELS, REACTIONS, SECTIONS, TISSUE, YIELDED, curve as curve_of,
};
use crate::record::failures::Failure;
use crate::record::in_vivo::IN_VIVO;
use crate::record::results::mask_blake3;
use crate::record::specimen;
use crate::record::stiffness::StiffnessLine;
use crate::report::answers;
use crate::report::answers::Answers;
use crate::report::html;
use crate::report::html::{ScanPage, Source};
use crate::report::methods::methods as written;
use crate::report::{Report, ReportParams, report as assemble};
use crate::report::{markdown, plot};
use crate::result::answer::ScanFacts;
use crate::result::ffb::with_ffb;
use crate::result::row::Row;
use crate::result::strength::CurvePoint;
pub use folders::{Folder, Folders};
use std::path::{Path, PathBuf};

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
    let rows = with_ffb(&rows, &rows);
    let folders = &Folders::of(&rows, dirs);
    let answers = answers(&rows, folders);
    let sources = Sources {
        rows: &rows,
        answers,
        failures: &failures,
        params: &params,
        folders,
        recipe,
    };
    write(sources, out, session)
}

/// The answers of `rows`, with what the folders of their scans say of them.
#[doc(hidden)]
pub fn answers(rows: &[Row], folders: &Folders) -> Answers {
    answers::answers(rows, |scan| {
        let facts = |folder: &Folder| answer::facts(&folder.dir, &folder.record);
        folders.get(scan).map_or_else(ScanFacts::default, facts)
    })
}

/// The methods section of a paper, filled in.
pub const METHODS: &str = "methods.md";

/// What a report is of.
#[doc(hidden)]
pub struct Sources<'a> {
    /// All rows, in their order.
    pub rows: &'a [Row],
    /// The answers of the scans.
    pub answers: Answers,
    /// Scans of a run that have no results.
    pub failures: &'a [Failure],
    /// Settings of `report`.
    pub params: &'a ReportParams,
    /// The folders of the scans of `rows`.
    pub folders: &'a Folders,
    /// The recipe as text; None where rows come from single commands.
    pub recipe: Option<String>,
}

/// Writes the report into `out`. Returns the files written.
#[doc(hidden)]
pub fn write(sources: Sources, out: &Path, session: &Session) -> Result<Vec<PathBuf>> {
    let Sources {
        rows,
        answers,
        failures,
        params,
        folders,
        recipe,
    } = sources;
    let mut report = assemble(rows, answers, &strength(folders), params);
    report.notes.extend(same_masks(folders));
    report.notes.extend(unlike_thresholds(folders));
    let failed = failures.iter().map(|f| {
        let reason = f.reason.lines().next().unwrap_or_default();
        format!("{}: failed, no results: {reason}", f.scan)
    });
    report.notes.splice(0..0, failed);
    let fabric_table = fabric_fit(folders).map(|(table, words)| {
        report.notes.push(words);
        table
    });
    let mut pages: Vec<ScanPage> = folders.scans().map(page).collect();
    let views = views::linked(&mut pages, folders);
    let methods = written(&report, &methods::known(&report, folders, failures.len()));
    let mut files = render(&report, &pages, session)?;
    files.push((METHODS.to_owned(), methods.markdown().into_bytes()));
    files.extend(stiffness_table(rows, folders));
    files.extend(fabric_table);
    files.extend(views);
    let source = Source {
        recipe,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        date: host::date(),
        host: host::name(),
    };
    let page = html::render(&report, &pages, &methods, &source)?;
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
fn render(
    report: &Report,
    pages: &[ScanPage],
    session: &Session,
) -> Result<Vec<(String, Vec<u8>)>> {
    let text = |name: &str, content: String| (name.to_owned(), content.into_bytes());
    let mut files = vec![
        text("report.md", markdown::render(report, pages)),
        text(ANSWERS, table::to_csv(&report.answers.lines)),
        text("groups.csv", table::to_csv(&report.groups.lines)),
        text("comparisons.csv", table::to_csv(&report.groups.comparisons)),
        text("e_app.csv", table::to_csv(&report.lines)),
        text(RESULTS, table::to_csv(&report.rows)),
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

/// The stress–strain curves of the scans.
fn strength(folders: &Folders) -> Vec<(String, Vec<CurvePoint>)> {
    let curve =
        |(scan, folder): (&str, Option<&Folder>)| Some((scan.to_owned(), curve_of(&folder?.dir)?));
    folders.scans().filter_map(curve).collect()
}

/// Scans whose masks are one, voxel by voxel: the same specimen, counted twice.
fn same_masks(folders: &Folders) -> Vec<String> {
    let masks = folders.by(|folder| mask_blake3(&folder.dir));
    let twice = masks.into_iter().filter(|(_, scans)| scans.len() > 1);
    twice
        .map(|(_, scans)| {
            format!(
                "{} are the same mask voxel by voxel: one specimen that is counted {} times, unless the manifest gives them one subject",
                scans.join(" and "),
                scans.len()
            )
        })
        .collect()
}

/// Says so where a threshold was given and scans differ in it.
fn unlike_thresholds(folders: &Folders) -> Option<String> {
    let found = folders.by(|Folder { record, .. }| {
        let lower = record.results.lower.filter(|_| !record.settings.otsu);
        lower.map(|lower| lower.to_string())
    });
    let words: Vec<String> = found
        .iter()
        .map(|(lower, scans)| format!("{lower}: {}", scans.join(", ")))
        .collect();
    (found.len() > 1).then(|| {
        format!(
            "lower thresholds differ between scans ({}): a difference of moduli can be one of thresholds",
            words.join("; ")
        )
    })
}

fn page((scan, folder): (&str, Option<&Folder>)) -> ScanPage {
    let Some(Folder { dir, record }) = folder else {
        return ScanPage {
            scan: scan.to_owned(),
            ..ScanPage::default()
        };
    };
    let picture = |name: &str, caption: &str| {
        let png = std::fs::read(dir.join(name)).ok()?;
        Some((caption.to_owned(), png))
    };
    let of_mask = [
        picture(specimen::STILL, STILL),
        picture(
            specimen::PICTURE,
            "Mid-slices of the three planes, with the outline of the mask",
        ),
    ];
    ScanPage {
        scan: scan.to_owned(),
        pictures: of_mask
            .into_iter()
            .flatten()
            .chain(fields::pictures::found(dir))
            .collect(),
        facts: facts::facts(record),
        stiffness: crate::record::stiffness::record(&dir.join(RECORD))
            .map(|record| self::stiffness::shown(&record)),
        views: Vec::new(),
        tables: details::tables(dir),
        files: files(dir),
    }
}

/// Caption.
const STILL: &str = "The bone within the box of the scan, smoothed; parallel view, so that the scale bar holds in all of the picture; z is the long axis";

/// `stiffness.csv`, where a scan has a stiffness.
fn stiffness_table(rows: &[Row], folders: &Folders) -> Option<(String, Vec<u8>)> {
    let of = |(scan, folder): (&str, Option<&Folder>)| {
        let record = crate::record::stiffness::record(&folder?.dir.join(RECORD))?;
        let marks = &rows.iter().find(|row| row.key.scan == scan)?.marks;
        let (subject, group) = (marks.subject.clone(), marks.group.clone());
        Some(StiffnessLine::of(&record, subject, group))
    };
    let lines: Vec<StiffnessLine> = folders.scans().filter_map(of).collect();
    (!lines.is_empty()).then(|| {
        (
            "stiffness.csv".to_owned(),
            table::to_csv(&lines).into_bytes(),
        )
    })
}

/// `fabric_fit.csv` and its note, where enough scans have a stiffness and a fabric.
fn fabric_fit(folders: &Folders) -> Option<((String, Vec<u8>), String)> {
    let of = |(_, folder): (&str, Option<&Folder>)| {
        crate::record::stiffness::record(&folder?.dir.join(RECORD))
    };
    let records: Vec<_> = folders.scans().filter_map(of).collect();
    let lines = self::stiffness::fabric_fit(&records)?;
    let words = self::stiffness::fit_in_words(&lines);
    let table = table::to_csv(&lines).into_bytes();
    Some((("fabric_fit.csv".to_owned(), table), words))
}

/// Tidy tables of results.
const TABLES: [&str; 9] = [
    IN_VIVO,
    LABELS,
    "curve.csv",
    "fracture.csv",
    REACTIONS,
    FAILURE,
    SECTIONS,
    TISSUE,
    YIELDED,
];

/// Fields, curves, tables and models that were asked for.
fn files(dir: &Path) -> Vec<String> {
    let wanted = |name: &str| {
        name.starts_with("field") && !name.ends_with(".png")
            || name.ends_with(".inp")
            || TABLES.contains(&name)
    };
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    let mut names: Vec<String> = names.filter(|name| wanted(name)).collect();
    names.sort();
    names
}
