//! Owns the firm and floppy boundary's mean (Zojaji et al. 2024): at one lattice parameter, FFB is the mean of the firm
//! and the floppy modulus. Its stated error is half their gap, which is a bracket, not a likely error.

use crate::result::row::Row;

/// Boundary name of a mean row.
pub const FFB: &str = "ffb";

/// The rows of `rows` with one FFB row after each pair of firm and floppy that differ in nothing else. FFB rows already
/// there are made anew.
pub fn with_ffb(rows: &[Row]) -> Vec<Row> {
    let mut all: Vec<Row> = Vec::new();
    for row in rows
        .iter()
        .filter(|row| row.boundary.as_deref() != Some(FFB))
    {
        all.push(row.clone());
        let partner = all.iter().find(|other| are_a_pair(row, other));
        let mean = partner.map(|other| mean_row(row, other));
        all.extend(mean);
    }
    all
}

fn are_a_pair(a: &Row, b: &Row) -> bool {
    let boundaries = [a, b].map(|row| row.boundary.as_deref());
    let one_of_each = matches!(
        boundaries,
        [Some("firm"), Some("floppy")] | [Some("floppy"), Some("firm")]
    );
    one_of_each && settings_of(a) == settings_of(b)
}

/// The row without what only its boundary and its solve decide.
pub fn settings_of(row: &Row) -> Row {
    Row {
        boundary: None,
        sites: None,
        dropped_sites: None,
        unknowns: None,
        iterations: None,
        residual: None,
        converged: None,
        e_app_mpa: None,
        e_app_reaction_mpa: None,
        e_app_stress_mpa: None,
        algebraic_error_mpa: None,
        discretization_error_mpa: None,
        wall_s: None,
        peak_mib: None,
        note: None,
        ..row.clone()
    }
}

/// Moduli are means, sites and times are sums, it is converged where both are; the rest is missing.
fn mean_row(a: &Row, b: &Row) -> Row {
    let both = |x: Option<f64>, y: Option<f64>| Some(x? + y?);
    let mean = |x, y| both(x, y).map(|sum| 0.5 * sum);
    Row {
        boundary: Some(FFB.to_owned()),
        sites: a.sites.zip(b.sites).map(|(x, y)| x + y),
        e_app_mpa: mean(a.e_app_mpa, b.e_app_mpa),
        e_app_reaction_mpa: mean(a.e_app_reaction_mpa, b.e_app_reaction_mpa),
        e_app_stress_mpa: mean(a.e_app_stress_mpa, b.e_app_stress_mpa),
        // Half the bracket.
        discretization_error_mpa: a
            .e_app_mpa
            .zip(b.e_app_mpa)
            .map(|(x, y)| 0.5 * (x - y).abs()),
        wall_s: both(a.wall_s, b.wall_s),
        converged: both_converged(a, b),
        note: unconverged(a, b),
        ..settings_of(a)
    }
}

/// None where it is not known of either.
fn both_converged(a: &Row, b: &Row) -> Option<bool> {
    match (a.converged, b.converged) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (x, y) => x.and(y),
    }
}

/// A mean of an unconverged modulus must say so.
fn unconverged(a: &Row, b: &Row) -> Option<String> {
    let failed = [a, b].iter().any(|row| row.converged == Some(false));
    failed.then(|| "mean of a modulus that is not converged".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(boundary: &str, lp_mm: f64, e: f64) -> Row {
        Row {
            scan: "a".to_owned(),
            boundary: Some(boundary.to_owned()),
            lp_mm,
            e_app_mpa: Some(e),
            e_app_stress_mpa: (boundary == "firm").then_some(e),
            sites: Some(10),
            wall_s: Some(2.0),
            converged: Some(boundary != "firm"),
            ..Row::default()
        }
    }

    #[test]
    fn the_mean_follows_the_second_of_its_pair() {
        let rows = [
            row("firm", 0.1, 30.0),
            row("firm", 0.2, 50.0),
            row("floppy", 0.1, 10.0),
            row("graded", 0.1, 19.0),
        ];
        let all = with_ffb(&rows);
        assert_eq!(all.len(), 5);
        let mean = &all[3];
        assert_eq!(mean.boundary.as_deref(), Some("ffb"));
        assert_eq!((mean.lp_mm, mean.e_app_mpa), (0.1, Some(20.0)));
        assert_eq!((mean.sites, mean.wall_s), (Some(20), Some(4.0)));
        assert_eq!(mean.e_app_stress_mpa, None);
        assert_eq!(mean.converged, Some(false), "firm is not");
        assert!(mean.note.as_ref().unwrap().contains("not converged"));
    }

    #[test]
    fn a_mean_is_converged_where_both_its_parts_are() {
        let with = |firm, floppy| {
            let part = |boundary, converged| Row {
                converged,
                ..row(boundary, 0.1, 1.0)
            };
            with_ffb(&[part("firm", firm), part("floppy", floppy)])[2].converged
        };
        let (yes, no) = (Some(true), Some(false));
        assert_eq!(
            [with(yes, yes), with(yes, no), with(no, yes)],
            [yes, no, no]
        );
        assert_eq!([with(None, yes), with(None, no)], [None, no]);
    }

    #[test]
    fn means_are_not_made_twice() {
        let once = with_ffb(&[row("firm", 0.1, 3.0), row("floppy", 0.1, 1.0)]);
        assert_eq!(with_ffb(&once), once);
    }

    #[test]
    fn other_settings_are_no_pair() {
        let stiffer = Row {
            young_mpa: 2.0,
            ..row("floppy", 0.1, 1.0)
        };
        assert_eq!(with_ffb(&[row("firm", 0.1, 3.0), stiffer]).len(), 2);
    }
}
