//! Owns the comparison of groups of a manifest: description, tests and effect sizes over subjects.

use crate::report::distinct;
use crate::result::answer::AnswerLine;
use crate::result::statistics::agreement::agreement;
use crate::result::statistics::holm::holm;
use crate::result::statistics::mann_whitney::mann_whitney;
use crate::result::statistics::summary::{Summary, summary};
use crate::result::statistics::welch::{HedgesG, Welch, hedges_g, welch};
use serde::Serialize;

/// One line of `groups.csv`. A subject's value is the mean of its scans.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct GroupLine {
    pub quantity: String,
    pub group: String,
    pub scans: usize,
    #[serde(flatten)]
    pub found: Summary,
    /// Mean of the subjects' stated errors, each the mean of its scans; None where a scan states none.
    pub mean_error: Option<f64>,
}

/// One line of `comparisons.csv`: `group` less `other`.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct ComparisonLine {
    pub quantity: String,
    pub group: String,
    pub other: String,
    /// `independent` (Welch, Mann–Whitney) or `paired` (the same subjects in both groups).
    pub design: String,
    pub difference: f64,
    pub difference_low: f64,
    pub difference_high: f64,
    pub ratio: f64,
    /// Of Welch's t test, or of the paired t test.
    pub p_t: f64,
    pub p_mann_whitney: Option<f64>,
    /// The same, corrected by Holm for all pairs of groups of a quantity.
    pub p_t_holm: Option<f64>,
    pub p_mann_whitney_holm: Option<f64>,
    pub hedges_g: Option<f64>,
    pub hedges_g_low: Option<f64>,
    pub hedges_g_high: Option<f64>,
    /// The interval of the difference, widened by the mean stated errors of both groups: all of one too high, all of the other
    /// too low.
    pub widened_low: Option<f64>,
    pub widened_high: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Groups {
    pub lines: Vec<GroupLine>,
    pub comparisons: Vec<ComparisonLine>,
    pub notes: Vec<String>,
}

/// A quantity of answers that groups are compared in.
struct Quantity {
    name: &'static str,
    value: fn(&AnswerLine) -> Option<f64>,
    error: fn(&AnswerLine) -> Option<f64>,
}

/// The first quantity.
pub const MODULUS: &str = "E_app (MPa)";

const QUANTITIES: [Quantity; 3] = [
    Quantity {
        name: MODULUS,
        value: |a| a.e_app_mpa,
        error: |a| a.error_mpa,
    },
    Quantity {
        name: "failure load (N)",
        value: |a| a.failure_load_n,
        error: |_| None,
    },
    Quantity {
        name: "BV/TV",
        value: |a| Some(a.bv_tv),
        error: |_| None,
    },
];

/// One subject of a group: its mean over scans.
struct Member {
    subject: String,
    value: f64,
}

struct Group<'a> {
    name: &'a str,
    scans: usize,
    members: Vec<Member>,
    mean_error: Option<f64>,
}

impl Group<'_> {
    fn values(&self) -> Vec<f64> {
        self.members.iter().map(|m| m.value).collect()
    }

    fn of(&self, subject: &str) -> Option<f64> {
        let member = self.members.iter().find(|m| m.subject == subject)?;
        Some(member.value)
    }
}

/// Description and comparison of the groups of `answers`; of all scans together where there are no groups.
pub fn groups(answers: &[&AnswerLine]) -> Groups {
    let mut found = Groups {
        notes: notes(answers),
        ..Groups::default()
    };
    let all = of_quantity(answers, &QUANTITIES[0]);
    let single = all.iter().filter(|g| all.len() > 1 && g.members.len() == 1);
    found.notes.extend(single.map(|group| {
        format!(
            "group {} has one subject only: it has no spread, and no test compares it",
            group.name
        )
    }));
    for quantity in &QUANTITIES {
        let all = of_quantity(answers, quantity);
        for group in &all {
            let line = summary(&group.values()).map(|found| GroupLine {
                quantity: quantity.name.to_owned(),
                group: group.name.to_owned(),
                scans: group.scans,
                found,
                mean_error: group.mean_error,
            });
            found.lines.extend(line);
        }
        found.comparisons.extend(compared(quantity, &all));
    }
    found
}

fn of_quantity<'a>(answers: &[&'a AnswerLine], quantity: &Quantity) -> Vec<Group<'a>> {
    let named = distinct(answers.iter().filter_map(|a| a.group.as_deref()));
    let of = |name: &'a str, own: Vec<&AnswerLine>| {
        let own: Vec<&AnswerLine> = own
            .into_iter()
            .filter(|a| (quantity.value)(a).is_some())
            .collect();
        let all_state = own.iter().all(|a| (quantity.error)(a).is_some());
        let errors = members(&own, quantity.error);
        Group {
            name,
            scans: own.len(),
            members: members(&own, quantity.value),
            mean_error: (all_state && !errors.is_empty())
                .then(|| errors.iter().map(|m| m.value).sum::<f64>() / errors.len() as f64),
        }
    };
    let all = match named.is_empty() {
        true => vec![of("all", answers.to_vec())],
        false => named
            .into_iter()
            .map(|name| {
                let own = answers.iter().filter(|a| a.group.as_deref() == Some(name));
                of(name, own.copied().collect())
            })
            .collect(),
    };
    all.into_iter().filter(|g| !g.members.is_empty()).collect()
}

/// The subjects of scans that have the value.
fn members(own: &[&AnswerLine], value: fn(&AnswerLine) -> Option<f64>) -> Vec<Member> {
    let member = |name: &str| {
        let of_one = own.iter().filter(|a| subject(a) == name);
        let values: Vec<f64> = of_one.filter_map(|a| value(a)).collect();
        Member {
            subject: name.to_owned(),
            value: values.iter().sum::<f64>() / values.len() as f64,
        }
    };
    let subjects = distinct(own.iter().map(|a| subject(a)));
    subjects.into_iter().map(member).collect()
}

/// The value of each subject, the mean of its scans, which all have it.
pub(super) fn subject_means(
    own: &[&AnswerLine],
    value: fn(&AnswerLine) -> Option<f64>,
) -> Vec<f64> {
    members(own, value).iter().map(|m| m.value).collect()
}

/// Scans without a subject are subjects of their own.
fn subject(answer: &AnswerLine) -> &str {
    answer.subject.as_deref().unwrap_or(&answer.scan)
}

fn compared(quantity: &Quantity, groups: &[Group]) -> Vec<ComparisonLine> {
    let mut lines = Vec::new();
    for (at, a) in groups.iter().enumerate() {
        for b in &groups[at + 1..] {
            lines.extend(comparison(quantity, a, b));
        }
    }
    if groups.len() > 2 {
        let t: Vec<f64> = lines.iter().map(|l| l.p_t).collect();
        for (line, p) in lines.iter_mut().zip(holm(&t)) {
            line.p_t_holm = Some(p);
        }
        let ranks: Option<Vec<f64>> = lines.iter().map(|l| l.p_mann_whitney).collect();
        for (line, p) in lines.iter_mut().zip(holm(&ranks.unwrap_or_default())) {
            line.p_mann_whitney_holm = Some(p);
        }
    }
    lines
}

/// None where groups share some subjects but not all, or are too small.
fn comparison(quantity: &Quantity, a: &Group, b: &Group) -> Option<ComparisonLine> {
    let shared = a
        .members
        .iter()
        .filter(|m| b.of(&m.subject).is_some())
        .count();
    let (va, vb) = (a.values(), b.values());
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let base = ComparisonLine {
        quantity: quantity.name.to_owned(),
        group: a.name.to_owned(),
        other: b.name.to_owned(),
        ratio: mean(&va) / mean(&vb),
        ..ComparisonLine::default()
    };
    let mut line = match shared {
        0 => independent(base, &va, &vb)?,
        n if n == va.len() && n == vb.len() => paired(base, a, b)?,
        _ => return None,
    };
    let errors = a.mean_error.zip(b.mean_error).map(|(x, y)| x + y);
    line.widened_low = errors.map(|e| line.difference_low - e);
    line.widened_high = errors.map(|e| line.difference_high + e);
    Some(line)
}

fn independent(base: ComparisonLine, a: &[f64], b: &[f64]) -> Option<ComparisonLine> {
    let Welch {
        difference,
        difference_low,
        difference_high,
        p,
        ..
    } = welch(a, b)?;
    let effect: Option<HedgesG> = hedges_g(a, b);
    Some(ComparisonLine {
        design: "independent".to_owned(),
        difference,
        difference_low,
        difference_high,
        p_t: p,
        p_mann_whitney: mann_whitney(a, b).map(|m| m.p),
        hedges_g: effect.map(|g| g.g),
        hedges_g_low: effect.map(|g| g.g_low),
        hedges_g_high: effect.map(|g| g.g_high),
        ..base
    })
}

/// Each subject against itself.
fn paired(base: ComparisonLine, a: &Group, b: &Group) -> Option<ComparisonLine> {
    let pairs = a
        .members
        .iter()
        .filter_map(|m| Some((m.value, b.of(&m.subject)?)));
    let (va, vb): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let found = agreement(&va, &vb)?;
    let differences: Vec<f64> = va.iter().zip(&vb).map(|(x, y)| x - y).collect();
    let interval = summary(&differences)?;
    Some(ComparisonLine {
        design: "paired".to_owned(),
        difference: found.bias,
        difference_low: interval.mean_low?,
        difference_high: interval.mean_high?,
        p_t: found.bias_p?,
        ..base
    })
}

/// What a reader must know of the groups.
fn notes(answers: &[&AnswerLine]) -> Vec<String> {
    let mut notes = Vec::new();
    let named = distinct(answers.iter().filter_map(|a| a.group.as_deref()));
    for (at, a) in named.iter().enumerate() {
        let same = |b: &&&str| a.trim().to_lowercase() == b.trim().to_lowercase();
        if let Some(b) = named[at + 1..].iter().find(same) {
            notes.push(format!(
                "groups `{a}` and `{b}` differ in case or spaces only and are taken as two: correct the manifest if they are one"
            ));
        }
    }
    if !named.is_empty() {
        let without: Vec<&str> = answers
            .iter()
            .filter(|a| a.group.is_none())
            .map(|a| a.scan.as_str())
            .collect();
        if !without.is_empty() {
            notes.push(format!(
                "scans without a group, in no comparison of groups: {}",
                without.join(", ")
            ));
        }
    }
    let in_both = |s: &&str| {
        let own = answers.iter().filter(|a| a.subject.as_deref() == Some(*s));
        distinct(own.filter_map(|a| a.group.as_deref())).len() > 1
    };
    let subjects = distinct(answers.iter().filter_map(|a| a.subject.as_deref()));
    let torn: Vec<&str> = subjects.iter().copied().filter(|s| in_both(s)).collect();
    if !torn.is_empty() {
        notes.push(format!(
            "subjects with scans in several groups: {}. Groups of the same subjects are compared in pairs; groups that share some subjects only are not compared",
            torn.join(", ")
        ));
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(scan: &str, subject: Option<&str>, group: &str, e: f64) -> AnswerLine {
        AnswerLine {
            scan: scan.to_owned(),
            subject: subject.map(str::to_owned),
            group: Some(group.to_owned()),
            bv_tv: 0.01 * e,
            e_app_mpa: Some(e),
            error_mpa: Some(1.0),
            ..AnswerLine::default()
        }
    }

    fn of(answers: &[AnswerLine]) -> Groups {
        groups(&answers.iter().collect::<Vec<_>>())
    }

    fn two_groups() -> Vec<AnswerLine> {
        let values = [("c", [40.0, 44.0, 52.0]), ("o", [20.0, 23.0, 31.0])];
        let scans = values.iter().flat_map(|(group, values)| {
            values
                .iter()
                .enumerate()
                .map(move |(i, e)| answer(&format!("{group}{i}"), None, group, *e))
        });
        scans.collect()
    }

    #[test]
    fn two_groups_have_one_comparison_a_quantity() {
        let found = of(&two_groups());
        let c = &found.comparisons[0];
        assert_eq!(
            (c.quantity.as_str(), c.group.as_str(), c.other.as_str()),
            ("E_app (MPa)", "c", "o")
        );
        let expected = welch(&[40.0, 44.0, 52.0], &[20.0, 23.0, 31.0]).unwrap();
        assert_eq!((c.difference, c.p_t), (expected.difference, expected.p));
        assert_eq!(c.p_mann_whitney, Some(0.1));
        assert_eq!(c.p_t_holm, None);
        assert_eq!(c.widened_low, Some(c.difference_low - 2.0));
        assert_eq!(found.comparisons.len(), 2);
    }

    #[test]
    fn a_subject_counts_once_however_often_it_was_scanned() {
        let mut scans = two_groups();
        let once = of(&scans);
        // The first control again, as left and right of one subject.
        scans[0].subject = Some("p1".to_owned());
        scans.push(answer("again", Some("p1"), "c", 40.0));
        let twice = of(&scans);
        assert_eq!(twice.lines[0].found, once.lines[0].found);
        assert_eq!((twice.lines[0].scans, twice.lines[0].found.n), (4, 3));
        assert_eq!(twice.comparisons[0].p_t, once.comparisons[0].p_t);
    }

    #[test]
    fn the_same_subjects_in_both_groups_are_compared_in_pairs() {
        let mut scans = two_groups();
        for (i, scan) in scans.iter_mut().enumerate() {
            scan.subject = Some(format!("p{}", i % 3));
        }
        let found = of(&scans);
        let c = &found.comparisons[0];
        assert_eq!(c.design, "paired");
        assert!((c.difference - 62.0 / 3.0).abs() < 1e-12 && c.hedges_g.is_none());
        // Shared in part only: no test fits.
        scans[5].subject = Some("p9".to_owned());
        let found = of(&scans);
        assert!(found.comparisons.is_empty());
        assert!(found.notes[0].contains("p0, p1"), "{:?}", found.notes);
    }

    #[test]
    fn more_than_two_groups_are_corrected_by_holm() {
        let mut scans = two_groups();
        scans.extend([60.0, 70.0, 90.0].map(|e| answer(&format!("x{e}"), None, "x", e)));
        let found = of(&scans);
        let of_e: Vec<&ComparisonLine> = found
            .comparisons
            .iter()
            .filter(|c| c.quantity.starts_with("E_app"))
            .collect();
        assert_eq!(of_e.len(), 3);
        assert!(of_e.iter().all(|c| c.p_t_holm.unwrap() >= c.p_t));
        assert!(of_e.iter().any(|c| c.p_t_holm.unwrap() > c.p_t));
    }

    #[test]
    fn names_that_differ_in_case_are_noted_and_no_groups_are_one() {
        let mut scans = two_groups();
        scans[3].group = Some("C".to_owned());
        assert!(of(&scans).notes[0].contains("`c` and `C`"));
        scans.iter_mut().for_each(|scan| scan.group = None);
        let found = of(&scans);
        assert_eq!(
            (found.lines[0].group.as_str(), found.lines[0].found.n),
            ("all", 6)
        );
        assert!(found.comparisons.is_empty());
    }
}
