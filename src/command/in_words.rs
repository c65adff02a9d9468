//! Owns the line that the terminal shows of a row.

use crate::report::cells::with_error;
use crate::result::answer::AnswerLine;
use crate::result::cautions::WARNING;
use crate::result::details::Details;
use crate::result::notes;
use crate::result::row::{FailureLoad, Row};
use crate::result::strength::Strength;

/// Scan, model, modulus with all of its stated error, cost. Warnings of its note are left out: the terminal has them in lines
/// of their own.
pub fn in_words(row: &Row) -> String {
    let solved = row.solved.clone().unwrap_or_default();
    let failure = solved.failure.map_or(String::new(), |f| failure(&f));
    let strength = strength(&solved.strength);
    let wall = solved.wall_s.map_or("NA".to_owned(), |t| format!("{t:.2}"));
    let cost = match row.key.is_derived() {
        true => String::new(),
        false => format!(
            " {:>9} sites {:>6} iterations {wall:>7} s",
            solved.sites.unwrap_or(0),
            solved.iterations.unwrap_or(0)
        ),
    };
    format!(
        "{} {:<5} {:<12} {:>7} mm  {}{cost}{failure}{strength}{}",
        row.key.scan,
        row.key.structure.name(),
        row.key
            .boundary
            .map_or("", |b| b.method_name(row.key.structure)),
        (row.key.lp_mm * 1e6).round() / 1e6,
        answered(row),
        note(row),
    )
}

/// The modulus, with stiffness and force where they are the row's own; of loads without one force or moment.
fn answered(row: &Row) -> String {
    let solved = row.solved.clone().unwrap_or_default();
    let load = row.key.load.name();
    let error = solved
        .algebraic_error_percent
        .map_or(String::new(), |p| format!(" (solver ± {p:.3} %)"));
    match (
        solved.moment_nmm,
        solved.force_n.zip(solved.stiffness_n_per_mm),
    ) {
        (Some(moment), _) => format!("{load} moment {moment:.3} N mm{error}"),
        (None, Some((force, k))) if !row.key.load.has_modulus() => {
            format!("{load} force {force:.3} N, stiffness {k:.3} N/mm{error}")
        }
        (None, Some((force, k))) => {
            format!("E_app {}  K {k:.3} N/mm, F {force:.3} N", modulus(row))
        }
        _ => format!("E_app {}", modulus(row)),
    }
}

fn failure(failure: &FailureLoad) -> String {
    let at = match (failure.displacement_mm, failure.strain) {
        (Some(u), Some(strain)) => format!(" at {u:.4} mm, strain {strain:.5}"),
        _ => String::new(),
    };
    match (failure.load_n, failure.moment_nmm) {
        (Some(load), _) => format!("  failure load {load:.3} N{at}"),
        (None, Some(moment)) => format!("  failure moment {moment:.3} N mm"),
        (None, None) => String::new(),
    }
}

/// Yield stress and largest stress, each with its error where it is stated.
fn strength(s: &Strength) -> String {
    let of = |name: &str, stress: Option<f64>, error: Option<f64>| match stress {
        None => String::new(),
        Some(_) => format!("  {name} {} MPa", with_error(stress, error).text),
    };
    let yields = of("yield stress", s.yield_stress_mpa, s.yield_stress_error_mpa);
    let largest = of("largest stress", s.max_stress_mpa, s.max_stress_error_mpa);
    format!("{yields}{largest}")
}

/// What each tissue carries at both ends and in the middle, in a line; None where it was not asked for or there is one tissue.
pub fn sections_in_words(details: &Details) -> Option<String> {
    let of = |section: &str| {
        let own = details.sections.iter().filter(|s| s.section == section);
        let tissues = own.filter(|s| s.label != "all");
        let shares = tissues.map(|s| format!("label {} {:.1} %", s.label, 100.0 * s.share));
        let shares: Vec<String> = shares.collect();
        (!shares.is_empty()).then(|| format!("{section} {}", shares.join(", ")))
    };
    let found: Vec<String> = ["lower", "middle", "upper"]
        .into_iter()
        .filter_map(of)
        .collect();
    (!found.is_empty()).then(|| format!("  load carried: {}", found.join("; ")))
}

/// The modulus, with everything that is stated of it and of what that is made.
fn modulus(row: &Row) -> String {
    let Some(e_app_mpa) = row.e_app_mpa() else {
        return "NA".to_owned();
    };
    let [algebraic, discretisation] = row.stated_errors_mpa();
    match (algebraic, discretisation) {
        (_, Some(d)) => {
            let all = row.error_mpa().unwrap_or_default();
            let solver = algebraic.map_or(String::new(), |a| format!("solver {a:.3}, "));
            format!("{e_app_mpa:.3} ± {all:.3} MPa ({solver}elements and shape {d:.3})")
        }
        (Some(a), None) => {
            format!("{e_app_mpa:.3} MPa (solver ± {a:.3}; the rest is not stated)")
        }
        (None, None) => format!("{e_app_mpa:.3} MPa (error not stated)"),
    }
}

fn note(row: &Row) -> String {
    let parts = notes::parts(row.marks.note.as_deref());
    let kept: Vec<&str> = parts.filter(|p| !p.starts_with(WARNING)).collect();
    match kept.is_empty() {
        true => String::new(),
        false => format!("  ({})", kept.join("; ")),
    }
}

/// The answer of a scan in a few words.
pub fn answer_in_words(answer: &AnswerLine) -> String {
    let Some(e_app) = answer.e_app_mpa else {
        return loads_in_words(answer);
    };
    if e_app == 0.0 {
        return format!("carries no load: E_app 0 by {}", answer.method);
    }
    let error = match answer.error_percent {
        Some(p) => format!("MPa ({p:.1} %)"),
        None => "MPa (error not stated)".to_owned(),
    };
    let e_app = with_error(answer.e_app_mpa, answer.error_mpa).text;
    let failure = answer
        .failure_load_n
        .map_or(String::new(), |f| format!(", failure load {f:.2} N"));
    format!(
        "E_app {e_app} {error} by {} {} mm{failure}",
        answer.method,
        (answer.element_mm * 1e6).round() / 1e6
    )
}

/// The same of a load without a modulus.
fn loads_in_words(answer: &AnswerLine) -> String {
    let by = format!(
        "by {} {} mm",
        answer.method,
        (answer.element_mm * 1e6).round() / 1e6
    );
    match (answer.force_n, answer.moment_nmm) {
        (Some(force), _) => format!("{} force {force:.3} N {by}", answer.load),
        (None, Some(moment)) => format!("{} moment {moment:.3} N mm {by}", answer.load),
        (None, None) => format!("{}: no answer {by}", answer.load),
    }
}
