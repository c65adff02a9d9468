//! Owns the report as Markdown: the E_app table, the figures by file name, the notes.

use crate::report::figure::Figure;
use crate::report::statistics::{AgreementLine, RegressionLine, Statistics};
use crate::report::table::Line;
use crate::report::{Model, Report};

/// The report's text. Figures are `STEM.svg` beside it.
pub fn render(report: &Report) -> String {
    let mut text = format!("# {}\n\n## Apparent modulus\n\n", report.title);
    text += &e_app_table(&report.lines);
    if !report.notes.is_empty() {
        text += "\n## Notes\n\n";
        report
            .notes
            .iter()
            .for_each(|note| text += &format!("- {note}\n"));
    }
    text += &statistics_text(&report.statistics);
    if !report.figures.is_empty() {
        text += "\n## Figures\n";
        report
            .figures
            .iter()
            .for_each(|figure| text += &figure_text(figure));
    }
    text
}

/// Regressions and agreements; empty for fewer than three scans.
fn statistics_text(statistics: &Statistics) -> String {
    if statistics.regressions.is_empty() {
        return String::new();
    }
    let mut text = "\n## Statistics\n\n| y | x | n | slope | intercept | R² | p of slope |\n| --- | --- | --- | --- | --- | --- | --- |\n".to_owned();
    for RegressionLine { y, x, fit } in &statistics.regressions {
        let numbers = [fit.slope, fit.intercept, fit.r2].map(|v| digits(Some(v)));
        text += &format!(
            "| {y} | {x} | {} | {} | {:.2e} |\n",
            fit.n,
            numbers.join(" | "),
            fit.slope_p
        );
    }
    if !statistics.agreements.is_empty() {
        text += "\n| method | reference | n | bias (MPa) | limits of agreement (MPa) | p of bias |\n| --- | --- | --- | --- | --- | --- |\n";
    }
    for AgreementLine {
        method,
        reference,
        found,
    } in &statistics.agreements
    {
        let [bias, low, high] =
            [found.bias, found.lower_limit, found.upper_limit].map(|v| digits(Some(v)));
        text += &format!(
            "| {method} | {reference} | {} | {bias} | {low} to {high} | {:.2e} |\n",
            found.n, found.bias_p
        );
    }
    if let Some(a) = &statistics.anova {
        text += &format!(
            "\nRepeated-measures analysis of variance between {} methods over {} scans: F({}, {}) = {}, p = {:.2e} if spherical; Greenhouse–Geisser ε = {}, p = {:.2e}.\n",
            a.methods,
            a.specimens,
            a.df_methods,
            a.df_error,
            digits(Some(a.f)),
            a.p,
            digits(Some(a.epsilon)),
            a.p_greenhouse_geisser
        );
    }
    text
}

fn figure_text(figure: &Figure) -> String {
    let Figure {
        stem,
        title,
        caption,
        ..
    } = figure;
    format!("\n### {title}\n\n![{title}]({stem}.svg)\n\n{caption}\n")
}

fn e_app_table(lines: &[Line]) -> String {
    let models: Vec<Model> = Model::ALL
        .into_iter()
        .filter(|m| lines.iter().any(|line| line.modulus(*m).is_some()))
        .collect();
    let conditions = lines.iter().any(|line| line.condition.is_some());
    let mut head = vec![
        "scan".to_owned(),
        "structure".to_owned(),
        "LP (mm)".to_owned(),
    ];
    head.extend(conditions.then(|| "condition".to_owned()));
    head.push("BV/TV".to_owned());
    head.extend(models.iter().map(|m| format!("{} (MPa)", m.name())));
    head.extend(models.iter().map(|m| format!("{} / E (%)", m.name())));
    head.push("time (s)".to_owned());
    let body = lines.iter().map(|line| cells(line, &models, conditions));
    let rule = head.iter().map(|_| "---".to_owned()).collect();
    [head, rule]
        .into_iter()
        .chain(body)
        .map(|cells| format!("| {} |\n", cells.join(" | ")))
        .collect()
}

fn cells(line: &Line, models: &[Model], conditions: bool) -> Vec<String> {
    let mut cells = vec![
        line.scan.replace('|', "\\|"),
        line.structure.name().to_uppercase(),
        line.lp_mm.to_string(),
    ];
    cells.extend(conditions.then(|| line.condition.clone().unwrap_or_default()));
    cells.push(format!("{:.4}", line.bv_tv));
    let moduli: Vec<Option<f64>> = models.iter().map(|m| line.modulus(*m)).collect();
    cells.extend(moduli.iter().map(|e| digits(*e)));
    cells.extend(
        moduli
            .iter()
            .map(|e| digits(e.map(|e| 100.0 * e / line.young_mpa))),
    );
    cells.push(digits(line.wall_s));
    cells
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

    #[test]
    fn the_table_has_a_column_per_model_found() {
        let line = Line {
            scan: "a|b".to_owned(),
            lp_mm: 0.1,
            young_mpa: 1000.0,
            floppy_mpa: Some(32.82),
            ..Line::default()
        };
        let table = e_app_table(&[line]);
        let lines: Vec<&str> = table.lines().collect();
        assert_eq!(
            lines[0],
            "| scan | structure | LP (mm) | BV/TV | floppy (MPa) | floppy / E (%) | time (s) |"
        );
        assert_eq!(
            lines[2],
            "| a\\|b | SC | 0.1 | 0.0000 | 32.82 | 3.282 | NA |"
        );
    }
}
