//! Owns the report as one HTML file that needs nothing else: styles, figures, pictures and the sorting of tables inside.

use crate::error::{Error, Result};
use crate::report::answers;
use crate::report::cells::{Cell, Table, length, link, number, records, text, time, with_error};
use crate::report::figure::Figure;
use crate::report::group_tables;
use crate::report::methods::Methods;
use crate::report::plot;
use crate::report::{Model, Report};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use minijinja::value::Serde;
use minijinja::{Environment, Value, context};
use serde::Serialize;

/// What a scan's folder adds to its page.
#[derive(Debug, Clone, Default)]
pub struct ScanPage {
    pub scan: String,
    /// Pictures as PNG, each with its caption: the bone, slices, fields.
    pub pictures: Vec<(String, Vec<u8>)>,
    /// Views that turn under the mouse and further pictures: what each shows, and its file next to the page.
    pub views: Vec<(String, String)>,
    /// Key and value: what is known of the input, the segmentation, the solve.
    pub facts: Vec<(String, String)>,
    /// Apparent stiffness, where it was asked for: conditions in words, matrix, constants.
    pub stiffness: Option<ShownStiffness>,
    /// Further tables, each with its caption: failure, sections, tissue.
    pub tables: Vec<(String, Table)>,
    /// Files of fields, curves and models in the scan's folder.
    pub files: Vec<String>,
}

/// The apparent stiffness of a scan.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ShownStiffness {
    pub conditions: String,
    pub matrix: Table,
    pub constants: Table,
}

/// Where a report comes from.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// The recipe as it was run, where one was.
    pub recipe: Option<String>,
    pub version: String,
    pub date: String,
    pub host: String,
}

#[derive(Serialize)]
struct Shown<'a> {
    title: &'a str,
    caption: &'a str,
    svg: String,
}

#[derive(Serialize)]
struct Page<'a> {
    scan: &'a str,
    pictures: Vec<Picture<'a>>,
    views: &'a [(String, String)],
    facts: &'a [(String, String)],
    stiffness: &'a Option<ShownStiffness>,
    tables: &'a [(String, Table)],
    files: &'a [String],
    figures: Vec<Shown<'a>>,
}

#[derive(Serialize)]
struct Picture<'a> {
    caption: &'a str,
    base64: String,
}

/// The whole page.
pub fn render(
    report: &Report,
    pages: &[ScanPage],
    methods: &Methods,
    source: &Source,
) -> Result<String> {
    let (own, shared): (Vec<&Figure>, Vec<&Figure>) =
        report.figures.iter().partition(|f| f.scan.is_some());
    let pages: Vec<Page> = pages.iter().map(|page| shown_page(page, &own)).collect();
    let (folded, figures): (Vec<&Figure>, Vec<&Figure>) =
        shared.into_iter().partition(|f| f.folded);
    let shown_all = |figures: Vec<&Figure>| -> Vec<Value> {
        figures.into_iter().map(|f| plain(&shown(f))).collect()
    };
    let statistics = &report.statistics;
    let page = context! {
        title => &report.title,
        version => &source.version,
        date => &source.date,
        host => &source.host,
        recipe => &source.recipe,
        conditions => &report.answers.conditions,
        notes => &report.notes,
        answers => plain(&answers::table(&report.answers)),
        groups => plain(&group_tables::lines_table(&report.groups)),
        grouped => report.groups.lines.iter().any(|line| line.group != "all"),
        subjects_repeat => report.answers.subjects_repeat(),
        comparisons => plain(&group_tables::comparisons_table(&report.groups)),
        on_errors => group_tables::ON_ERRORS,
        figures => shown_all(figures),
        solves => plain(&solves(report)),
        method_notes => &report.method_notes,
        method_figures => shown_all(folded),
        regressions => plain(&records(&statistics.regressions)),
        agreements => plain(&records(&statistics.agreements)),
        boxes => plain(&records(&statistics.boxes)),
        pages => plain(&pages),
        methods => plain(methods),
    };
    let mut environment = Environment::new();
    let template = environment
        .add_template("report.html", include_str!("report.html"))
        .and_then(|()| environment.get_template("report.html")?.render(page));
    template.map_err(|e| {
        Error::specimen(
            format!("the report's page could not be made: {e}"),
            "report this; the CSV files hold the same",
        )
        .caused_by(e)
    })
}

fn plain<T: Serialize>(value: &T) -> Value {
    Value::from(Serde(value))
}

fn shown_page<'a>(page: &'a ScanPage, figures: &[&'a Figure]) -> Page<'a> {
    let own = figures
        .iter()
        .filter(|f| f.scan.as_deref() == Some(&page.scan));
    Page {
        scan: &page.scan,
        pictures: page
            .pictures
            .iter()
            .map(|(caption, png)| Picture {
                caption,
                base64: STANDARD.encode(png),
            })
            .collect(),
        views: &page.views,
        facts: &page.facts,
        stiffness: &page.stiffness,
        tables: &page.tables,
        files: &page.files,
        figures: own.map(|f| shown(f)).collect(),
    }
}

/// The drawing with ids of its own: several figures share one page.
fn shown(figure: &Figure) -> Shown<'_> {
    let svg = plot::draw(figure).svg();
    let svg = svg.get(svg.find("<svg").unwrap_or(0)..).unwrap_or_default();
    Shown {
        title: &figure.title,
        caption: &figure.caption,
        svg: scalable(svg).replace("kuva-clip-", &format!("{}-clip-", figure.stem)),
    }
}

/// A drawing that shrinks with the page: without a `viewBox` a narrow screen would cut it off.
fn scalable(svg: &str) -> String {
    let size = |name: &str| {
        let (_, rest) = svg.split_once(&format!(" {name}=\""))?;
        rest.split_once('"')?.0.parse::<f64>().ok()
    };
    match (size("width"), size("height")) {
        (Some(w), Some(h)) => svg.replacen("<svg ", &format!("<svg viewBox=\"0 0 {w} {h}\" "), 1),
        _ => svg.to_owned(),
    }
}

/// All solves, one line per scan, structure and lattice parameter.
pub(super) fn solves(report: &Report) -> Table {
    let models: Vec<Model> = Model::ALL
        .into_iter()
        .filter(|m| report.lines.iter().any(|line| line.modulus(*m).is_some()))
        .collect();
    let mut head = ["scan", "structure", "LP (mm)", "condition", "BV/TV"].to_vec();
    let names: Vec<String> = models
        .iter()
        .map(|m| format!("{} (MPa)", m.name()))
        .collect();
    head.extend(names.iter().map(String::as_str));
    head.push("time (s)");
    let body = report.lines.iter().map(|line| {
        let mut cells: Vec<Cell> = vec![
            link(&line.scan),
            text(&line.structure.name().to_uppercase()),
            length(line.lp_mm),
            text(line.condition.as_deref().unwrap_or("")),
            number(Some(line.bv_tv)),
        ];
        let modulus = |m: &Model| {
            let [algebraic, discretisation] = line.stated_errors(*m);
            let all = discretisation.map(|d| d.abs() + algebraic.unwrap_or(0.0).abs());
            with_error(line.modulus(*m), all)
        };
        cells.extend(models.iter().map(modulus));
        cells.push(time(line.wall_s));
        cells
    });
    Table::new(&head, body.collect()).without_empty_columns()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reader of the page has no repository.
    #[test]
    fn a_page_is_about_its_scans_alone() {
        let report = crate::report::report(&[], Default::default(), &[], &Default::default());
        let page = render(&report, &[], &Methods::default(), &Source::default()).unwrap();
        assert!(page.contains("Recipe and provenance"));
        for words in ["cargo ", "reports/", "Validation"] {
            assert!(!page.contains(words), "{words}");
        }
    }

    #[test]
    fn a_drawing_can_shrink() {
        let svg = scalable("<svg xmlns=\"x\" width=\"560\" height=\"380\"></svg>");
        assert!(
            svg.starts_with("<svg viewBox=\"0 0 560 380\" xmlns"),
            "{svg}"
        );
    }
}
