//! Owns the report as one HTML file that needs nothing else: styles, figures, pictures and the sorting of tables inside.

use crate::error::{Error, Result};
use crate::report::figure::Figure;
use crate::report::markdown::digits;
use crate::report::plot;
use crate::report::table::Line;
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
    /// `segment.png`: mid-slices with the mask's outline.
    pub picture: Option<Vec<u8>>,
    /// Key and value: what is known of the input, the segmentation, the solve.
    pub facts: Vec<(String, String)>,
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

/// A table as the page shows it; numbers are sorted as numbers.
#[derive(Serialize)]
struct Table {
    head: Vec<String>,
    body: Vec<Vec<Cell>>,
}

#[derive(Serialize)]
struct Cell {
    text: String,
    /// To sort by, where the text is a number.
    key: Option<f64>,
    /// Name of the scan whose page it leads to.
    link: Option<String>,
    /// Shown on pointing at it.
    hint: Option<String>,
    /// A number that is not there.
    missing: bool,
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
    picture: Option<String>,
    facts: &'a [(String, String)],
    figures: Vec<Shown<'a>>,
}

/// The whole page.
pub fn render(report: &Report, pages: &[ScanPage], source: &Source) -> Result<String> {
    let (own, shared): (Vec<&Figure>, Vec<&Figure>) =
        report.figures.iter().partition(|f| f.scan.is_some());
    let pages: Vec<Page> = pages.iter().map(|page| shown_page(page, &own)).collect();
    let figures: Vec<Shown> = shared.into_iter().map(shown).collect();
    let statistics = &report.statistics;
    let page = context! {
        title => &report.title,
        version => &source.version,
        date => &source.date,
        host => &source.host,
        recipe => &source.recipe,
        notes => &report.notes,
        e_app => plain(&e_app(report)),
        regressions => plain(&records(&statistics.regressions)),
        agreements => plain(&records(&statistics.agreements)),
        boxes => plain(&records(&statistics.boxes)),
        anova => plain(&statistics.anova),
        figures => plain(&figures),
        pages => plain(&pages),
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
        picture: page.picture.as_ref().map(|png| STANDARD.encode(png)),
        facts: &page.facts,
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

fn e_app(report: &Report) -> Table {
    let models: Vec<Model> = Model::ALL
        .into_iter()
        .filter(|m| report.lines.iter().any(|line| line.modulus(*m).is_some()))
        .collect();
    let mut head: Vec<String> = ["scan", "structure", "LP (mm)", "condition", "BV/TV"]
        .map(str::to_owned)
        .into();
    head.extend(models.iter().map(|m| format!("{} (MPa)", m.name())));
    head.push("time (s)".to_owned());
    let finest = report.lines.iter().map(|line| decimals(line.lp_mm)).max();
    let lp = |v: f64| format!("{v:.*}", finest.unwrap_or(0).min(6));
    let body = report.lines.iter().map(|line| {
        let mut cells = vec![
            Cell {
                link: Some(line.scan.clone()),
                ..text(&line.scan)
            },
            text(&line.structure.name().to_uppercase()),
            Cell {
                text: lp(line.lp_mm),
                ..number(Some(line.lp_mm))
            },
            text(line.condition.as_deref().unwrap_or("")),
            number(Some(line.bv_tv)),
        ];
        cells.extend(models.iter().map(|m| modulus(line, *m)));
        cells.push(number(line.wall_s));
        cells
    });
    Table {
        body: body.collect(),
        head,
    }
    .without_empty_columns()
}

/// A modulus with its stated error; what the error is made of shows on pointing at it.
fn modulus(line: &Line, model: Model) -> Cell {
    let plain = number(line.modulus(model));
    let stated = line.stated_errors(model);
    if plain.key.is_none() || stated.iter().all(Option::is_none) {
        return plain;
    }
    let total: f64 = stated.iter().flatten().map(|e| e.abs()).sum();
    let part =
        |name: &str, error: Option<f64>| Some(format!("{name} {} MPa", digits(Some(error?))));
    let parts = [
        part("algebraic error", stated[0]),
        part("discretisation error", stated[1]),
    ];
    Cell {
        text: format!("{} ± {}", plain.text, short(total)),
        hint: Some(parts.into_iter().flatten().collect::<Vec<_>>().join(", ")),
        ..plain
    }
}

/// An error in two digits.
fn short(error: f64) -> String {
    match error {
        e if e <= 0.0 || !e.is_finite() => e.to_string(),
        e => format!(
            "{e:.*}",
            (1 - e.log10().floor() as i32).clamp(0, 6) as usize
        ),
    }
}

/// Decimals of a length as it was given, at most nanometres.
fn decimals(mm: f64) -> usize {
    let text = mm.to_string();
    text.split_once('.').map_or(0, |(_, after)| after.len())
}

impl Table {
    fn without_empty_columns(mut self) -> Table {
        for column in (0..self.head.len()).rev() {
            let empty = |cell: &Cell| cell.text.is_empty() || cell.missing;
            if self.body.iter().all(|row| empty(&row[column])) {
                self.head.remove(column);
                self.body.iter_mut().for_each(|row| {
                    row.remove(column);
                });
            }
        }
        self
    }
}

/// Plain records as a table; heads are the fields' names.
fn records<T: Serialize>(records: &[T]) -> Table {
    let rows: Vec<serde_json::Map<String, serde_json::Value>> = records
        .iter()
        .filter_map(|record| serde_json::to_value(record).ok()?.as_object().cloned())
        .collect();
    let head = rows.first().map_or(Vec::new(), |row| {
        row.keys().map(|key| head_of(key)).collect()
    });
    let cell = |value: &serde_json::Value| match (value.as_u64(), value.as_f64(), value.as_str()) {
        (Some(n), _, _) => Cell {
            text: n.to_string(),
            ..number(Some(n as f64))
        },
        (_, Some(v), _) => number(Some(v)),
        (_, _, word) => text(word.unwrap_or("")),
    };
    let body = rows
        .iter()
        .map(|row| row.values().map(cell).collect())
        .collect();
    Table { head, body }.without_empty_columns()
}

/// A field's name as people write it.
fn head_of(field: &str) -> String {
    let known = match field {
        "r2" => "R²",
        "q1" => "first quartile",
        "q3" => "third quartile",
        "sd" => "SD",
        "slope_p" => "p of slope",
        "intercept_p" => "p of intercept",
        "bias_p" => "p of bias",
        "slope_standard_error" => "SE of slope",
        "intercept_standard_error" => "SE of intercept",
        other => return other.replace('_', " "),
    };
    known.to_owned()
}

fn text(words: &str) -> Cell {
    Cell {
        text: words.to_owned(),
        key: None,
        link: None,
        hint: None,
        missing: false,
    }
}

fn number(value: Option<f64>) -> Cell {
    let small = value.filter(|v| *v != 0.0 && v.abs() < 1e-4);
    let text = match value {
        Some(_) => small.map_or_else(|| digits(value), |v| format!("{v:.2e}")),
        None => "–".to_owned(),
    };
    Cell {
        text,
        key: value,
        link: None,
        hint: None,
        missing: value.is_none(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_said_in_two_digits() {
        for (error, words) in [
            (0.0, "0"),
            (0.01234, "0.012"),
            (1.96, "2.0"),
            (123.4, "123"),
        ] {
            assert_eq!(short(error), words);
        }
    }

    /// A reader of the page has no repository.
    #[test]
    fn a_page_is_about_its_scans_alone() {
        let report = crate::report::report(&[], &Default::default());
        let page = render(&report, &[], &Source::default()).unwrap();
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
