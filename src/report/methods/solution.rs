//! Owns what a methods section says of the solver, of stated errors and of failure.

use super::words::{counted, list, mean_and_range, percent, setting, settings};
use super::{Answered, Criterion, Known};
use crate::report::distinct;
use crate::result::condition::Condition;
use crate::result::row::Row;
use crate::result::settings::Sed;

pub fn text(
    answered: &[Answered],
    solved: &[&Row],
    condition: &Condition,
    target: Option<f64>,
) -> String {
    let own = |row: &&&Row| {
        Condition::of(&row.key) == *condition
            && answered.iter().any(|a| a.row.key.scan == row.key.scan)
    };
    let own: Vec<&Row> = solved.iter().filter(own).copied().collect();
    let mut text = solver(&own, condition);
    let stalled = answered.iter().filter(|a| a.row.converged() == Some(false));
    let stalled = stalled.count();
    if stalled > 0 {
        text += &format!(" {} did not converge.", counted(stalled, "answer"));
    }
    if condition.load.has_modulus() {
        text += &errors(answered, target);
    }
    text.trim_start().to_owned()
}

fn solver(own: &[&Row], condition: &Condition) -> String {
    let tolerances = own.iter().filter_map(|row| row.key.tolerance);
    let tolerances = settings(tolerances.map(|t| 100.0 * t));
    if tolerances.is_empty() {
        return String::new();
    }
    let what = match condition.load.has_modulus() {
        true => "E_app",
        false => "the stored energy",
    };
    let yields = own.iter().any(|row| row.key.plasticity.is_some());
    let steps = match yields {
        true => " Each load step was solved by Newton's method.",
        false => "",
    };
    format!(
        "Linear equations were solved by preconditioned conjugate gradients until the estimated algebraic error of {what} was below {tolerances} % (Meurant and Tichý 2019).{steps}"
    )
}

fn errors(answered: &[Answered], target: Option<f64>) -> String {
    let (loaded, empty): (Vec<&Answered>, Vec<&Answered>) =
        answered.iter().partition(|a| !a.row.is_disconnected());
    let stated: Vec<f64> = loaded.iter().filter_map(|a| a.line.error_percent).collect();
    let mut text = match mean_and_range(&stated, "%") {
        Some(words) => format!(
            " The stated error of E_app was {words}; it adds the estimated errors of the solver, of the size of elements or lattice cells, and of the surface of bone within a voxel."
        ),
        None => String::new(),
    };
    let silent = loaded.len() - stated.len();
    if silent > 0 {
        let of = match stated.is_empty() {
            true => "is stated".to_owned(),
            false => format!("is stated of {}", counted(silent, "scan")),
        };
        text += &format!(" No discretisation error {of}.");
    }
    if let Some(target) = target {
        let met = answered.iter().filter(|a| a.line.met == Some(true)).count();
        let asked = answered.iter().filter(|a| a.line.met.is_some()).count();
        let on = match (asked, met) {
            (1, 1) => "it was met".to_owned(),
            (1, _) => "it was not met".to_owned(),
            _ if empty.is_empty() => format!("it was met on {met} of {asked}"),
            _ => format!("it was met on {met} of the {asked} scans that carry load"),
        };
        text += &format!(
            " The target of the stated error was {} %; {on}.",
            setting(100.0 * target)
        );
    }
    let sensitivity = loaded.iter().filter_map(|a| a.line.threshold_sensitivity);
    let sensitivity: Vec<f64> = sensitivity.collect();
    if let Some(words) = mean_and_range(&sensitivity, "%") {
        text += &format!(
            " The threshold is not part of that error: E_app changes by {words} per 1 % of bone volume."
        );
    }
    if !empty.is_empty() {
        text += &format!(
            " In {} no bone joined the loaded ends (E_app = 0).",
            counted(empty.len(), "scan")
        );
    }
    text
}

/// Pistoia's criterion and the yield stress, where answers have one.
pub fn failure(answered: &[Answered], known: &Known) -> String {
    let has_load = |a: &Answered| {
        a.line
            .failure_load_n
            .or(a.line.failure_moment_nmm)
            .is_some()
    };
    let mut text = String::new();
    if answered.iter().any(has_load) {
        text += &match &known.criteria[..] {
            [] => "Failure loads follow the criterion of Pistoia et al. (2002).".to_owned(),
            all => {
                let words: Vec<String> = all.iter().map(criterion).collect();
                format!(
                    "The failure load was found by the criterion of Pistoia et al. (2002): {}.",
                    words.join("; or ")
                )
            }
        };
        for sed in distinct(answered.iter().filter_map(|a| a.row.key.sed)) {
            text += match sed {
                Sed::Centre => {
                    " Effective strains follow from the strain energy density at the centre of each element."
                }
                Sed::Mean => {
                    " Effective strains follow from the mean strain energy density of each element."
                }
            };
        }
        text += " The model is linear, so its load was scaled to that point; no error of the failure load is stated.";
    }
    if answered.iter().any(|a| a.line.yield_stress_mpa.is_some()) {
        text += " The yield stress is where the apparent stress–strain curve meets the elastic line offset by 0.2 % strain.";
    }
    text.trim_start().to_owned()
}

fn criterion(c: &Criterion) -> String {
    let bone = match c.labels.is_empty() {
        true => "the bone".to_owned(),
        false => {
            let labels: Vec<String> = c.labels.iter().map(i32::to_string).collect();
            format!("the bone of label {}", list(&labels))
        }
    };
    format!(
        "{} of {bone} exceed an effective strain of {}",
        percent(c.pistoia.critical_volume),
        setting(c.pistoia.critical_strain)
    )
}
