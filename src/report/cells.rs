//! Owns tables as a page shows them: cells with what they are sorted by, and numbers in a reader's digits.

use serde::Serialize;

/// A table as the page shows it; numbers are sorted as numbers.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Table {
    pub head: Vec<String>,
    pub body: Vec<Vec<Cell>>,
}

#[derive(Debug, Clone, Default, Serialize)]
pub struct Cell {
    pub text: String,
    /// To sort by, where the text is a number.
    pub key: Option<f64>,
    /// Name of the scan whose page it leads to.
    pub link: Option<String>,
    /// A number that is not there.
    pub missing: bool,
}

impl Table {
    pub fn new(head: &[&str], body: Vec<Vec<Cell>>) -> Table {
        Table {
            head: head.iter().map(|name| (*name).to_owned()).collect(),
            body,
        }
    }

    pub fn without_empty_columns(mut self) -> Table {
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

    /// The same as Markdown.
    pub fn markdown(&self) -> String {
        let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
        let escaped = |text: &String| text.replace('|', "\\|");
        let head = line(self.head.iter().map(escaped).collect());
        let rule = line(self.head.iter().map(|_| "---".to_owned()).collect());
        let rows = self
            .body
            .iter()
            .map(|row| line(row.iter().map(|cell| escaped(&cell.text)).collect()));
        [head, rule].into_iter().chain(rows).collect()
    }
}

/// Plain records as a table; heads are the fields' names.
pub fn records<T: Serialize>(records: &[T]) -> Table {
    let rows: Vec<serde_json::Map<String, serde_json::Value>> = records
        .iter()
        .filter_map(|record| serde_json::to_value(record).ok()?.as_object().cloned())
        .collect();
    let head = rows.first().map_or(Vec::new(), |row| {
        row.keys().map(|key| head_of(key)).collect()
    });
    let is_p = |key: &str| key.starts_with("p_") || key.ends_with("_p");
    let cell = |key: &str, value: &serde_json::Value| match (
        value.as_u64(),
        value.as_f64(),
        value.as_str(),
    ) {
        (Some(n), _, _) => count(n),
        (_, v, None) if is_p(key) => p_value(v),
        (_, Some(v), _) => number(Some(v)),
        (_, _, Some(word)) => text(word),
        (_, None, None) => number(None),
    };
    let body = rows
        .iter()
        .map(|row| row.iter().map(|(key, value)| cell(key, value)).collect())
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
        "lp_mm" => "LP or element (mm)",
        "slope_p" => "p of slope",
        "intercept_p" => "p of intercept",
        "bias_p" => "p of bias",
        "slope_standard_error" => "SE of slope",
        "intercept_standard_error" => "SE of intercept",
        other => return other.replace('_', " "),
    };
    known.to_owned()
}

pub fn text(words: &str) -> Cell {
    Cell {
        text: words.to_owned(),
        ..Cell::default()
    }
}

pub fn link(scan: &str) -> Cell {
    Cell {
        link: Some(scan.to_owned()),
        ..text(scan)
    }
}

pub fn count(n: u64) -> Cell {
    Cell {
        text: n.to_string(),
        key: Some(n as f64),
        ..Cell::default()
    }
}

pub fn number(value: Option<f64>) -> Cell {
    let small = value.filter(|v| *v != 0.0 && v.abs() < 1e-4);
    Cell {
        text: match value {
            Some(_) => small.map_or_else(|| digits(value), |v| format!("{v:.1e}")),
            None => "–".to_owned(),
        },
        key: value,
        missing: value.is_none(),
        ..Cell::default()
    }
}

/// A length in mm without trailing zeros.
pub fn length(mm: f64) -> Cell {
    Cell {
        text: ((mm * 1e5).round() / 1e5).to_string(),
        ..number(Some(mm))
    }
}

/// A time in s: two decimals, or whole seconds from a minute on.
pub fn time(seconds: Option<f64>) -> Cell {
    let plain = number(seconds);
    match seconds {
        Some(s) if s < 60.0 => Cell {
            text: format!("{s:.2}"),
            ..plain
        },
        Some(s) => Cell {
            text: format!("{s:.0}"),
            ..plain
        },
        None => plain,
    }
}

/// A p value in two digits.
pub fn p_value(p: Option<f64>) -> Cell {
    let text = match p {
        None => return number(None),
        Some(p) if p < 1e-4 => "< 0.0001".to_owned(),
        Some(p) if p < 0.01 => format!("{p:.4}"),
        Some(p) => format!("{p:.3}"),
    };
    Cell { text, ..number(p) }
}

/// `value ± error`, the error in two digits and the value to the same place; the value alone where no error is stated.
pub fn with_error(value: Option<f64>, error: Option<f64>) -> Cell {
    let plain = number(value);
    match (value, error) {
        (Some(v), Some(e)) if e > 0.0 && e.is_finite() => Cell {
            text: format!("{v:.*} ± {e:.*}", places(e), places(e)),
            ..plain
        },
        (Some(_), Some(_)) => Cell {
            text: format!("{} ± 0", plain.text),
            ..plain
        },
        _ => plain,
    }
}

/// Two numbers as an interval, in the places of its width.
pub fn interval(low: Option<f64>, high: Option<f64>) -> Cell {
    match low.zip(high) {
        None => number(None),
        Some((low, high)) => {
            let places = places(0.2 * (high - low));
            Cell {
                text: format!("{low:.places$} to {high:.places$}"),
                ..number(Some(low))
            }
        }
    }
}

/// Decimal places that show an error in two digits.
pub fn places(error: f64) -> usize {
    match error {
        e if e > 0.0 && e.is_finite() => (1 - e.log10().floor() as i32).clamp(0, 6) as usize,
        _ => 2,
    }
}

/// Four significant digits; missing values are `NA`.
pub fn digits(value: Option<f64>) -> String {
    match value {
        None => "NA".to_owned(),
        Some(v) if v == 0.0 || !v.is_finite() => v.to_string(),
        Some(v) => {
            let before = v.abs().log10().floor() as i32 + 1;
            format!("{v:.*}", (4 - before).clamp(0, 8) as usize)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_has_two_digits_and_its_value_the_same_place() {
        for (value, error, words) in [
            (12.3456, 0.01234, "12.346 ± 0.012"),
            (12.3456, 1.96, "12.3 ± 2.0"),
            (1234.56, 123.4, "1235 ± 123"),
        ] {
            assert_eq!(with_error(Some(value), Some(error)).text, words);
        }
        assert_eq!(with_error(Some(12.0), None).text, "12.00");
        assert_eq!(with_error(Some(0.0), Some(0.0)).text, "0 ± 0");
        assert!(with_error(None, None).missing);
    }

    #[test]
    fn p_values_and_intervals_have_few_digits() {
        assert_eq!(p_value(Some(3e-9)).text, "< 0.0001");
        assert_eq!(p_value(Some(0.00441)).text, "0.0044");
        assert_eq!(p_value(Some(0.10151)).text, "0.102");
        assert_eq!(interval(Some(-1.234), Some(8.765)).text, "-1.2 to 8.8");
    }

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (81.43219, "81.43"),
            (0.012345, "0.01235"),
            (12345.6, "12346"),
            (0.0, "0"),
            (999.96, "1000.0"),
        ] {
            assert_eq!(digits(Some(value)), text);
        }
        assert_eq!(digits(None), "NA");
    }
}
