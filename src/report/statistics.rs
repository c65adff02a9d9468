//! Owns the report's statistics over scans: which methods are held against which, and the tables of it.

use super::cells::p_value;
use super::sample::{Case, LEAST_SCANS, Sample};
use super::{Model, distinct};
use crate::result::statistics::agreement::{Agreement, agreement};
use crate::result::statistics::anova::{Anova, repeated_measures};
use crate::result::statistics::quartiles::{Quartiles, quartiles};
use crate::result::statistics::regression::{Regression, regression};
use serde::Serialize;

/// One line of a table of regressions: `y = intercept + slope · x`.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct RegressionLine {
    pub y: String,
    pub x: String,
    #[serde(flatten)]
    pub fit: Regression,
}

/// One line of a table of agreements: `method − reference`, in MPa.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct AgreementLine {
    pub method: String,
    pub reference: String,
    #[serde(flatten)]
    pub found: Agreement,
}

/// One line of a table of distributions.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct BoxLine {
    /// `E_app (MPa)`, `E_app / (BV/TV) (MPa)`, `BV of the model, difference from the mask (%)` or `difference from REFERENCE (%)`.
    pub quantity: String,
    pub method: String,
    /// None: all scans.
    pub group: Option<String>,
    #[serde(flatten)]
    pub found: Quartiles,
}

#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Statistics {
    /// Empty for fewer than three scans.
    pub regressions: Vec<RegressionLine>,
    pub agreements: Vec<AgreementLine>,
    pub boxes: Vec<BoxLine>,
    /// Between the methods of `anova_between`, repeated over the scans that have them all.
    pub anova: Option<Anova>,
    pub anova_between: Vec<String>,
}

impl Statistics {
    /// The analysis of variance in a sentence, with the p that does not assume sphericity.
    pub(super) fn analysis_of_variance(&self) -> Option<String> {
        let a = self.anova.as_ref()?;
        Some(format!(
            "Analysis of variance between {} over {} scans: F({}, {}) = {:.4}, p = {}{}",
            self.anova_between.join("; "),
            a.specimens,
            a.df_methods,
            a.df_error,
            a.f,
            p_value(Some(a.p_greenhouse_geisser)).text,
            // Two methods cannot but be spherical.
            match a.methods > 2 {
                true => format!(
                    " (corrected by Greenhouse and Geisser, ε = {:.3}; {} uncorrected)",
                    a.epsilon,
                    p_value(Some(a.p)).text
                ),
                false => String::new(),
            }
        ))
    }
}

/// A method held against the reference over the scans that have both.
pub(super) struct Comparison<'a> {
    pub sample: &'a Sample,
    pub reference: &'a Sample,
    pub method_mpa: Vec<f64>,
    pub reference_mpa: Vec<f64>,
    pub bv_tv: Vec<f64>,
}

impl Comparison<'_> {
    /// Method less reference over the reference, in percent.
    pub fn differences_percent(&self) -> Vec<f64> {
        let both = self.method_mpa.iter().zip(&self.reference_mpa);
        both.map(|(m, r)| 100.0 * (m / r - 1.0)).collect()
    }

    /// E_app over BV/TV, of the method and of the reference.
    pub fn over_bv_tv(&self) -> [Vec<f64>; 2] {
        [&self.method_mpa, &self.reference_mpa]
            .map(|moduli| moduli.iter().zip(&self.bv_tv).map(|(e, f)| e / f).collect())
    }

    /// What its differences are called.
    pub fn difference_from(&self) -> String {
        format!("difference from {} (%)", self.reference.method)
    }
}

/// The samples of more than half as many scans as the largest has: a method tried on a few scans does not decide for all.
fn common(samples: &[Sample]) -> impl Iterator<Item = &Sample> {
    let most = samples.iter().map(|s| s.cases.len()).max().unwrap_or(0);
    samples.iter().filter(move |s| 2 * s.cases.len() > most)
}

/// What the others are compared with: of voxel FE and the limits the one of the least stated error, else connected or weighted lattices, else FFB.
pub(super) fn reference(samples: &[Sample]) -> Option<&Sample> {
    let of = |model| common(samples).filter(move |s| s.model == model);
    // The first of equals is taken.
    let stated = [Model::VoxelFeLimit, Model::VoxelFe, Model::GradedLimit]
        .into_iter()
        .flat_map(of)
        .min_by(|a, b| a.stated().total_cmp(&b.stated()));
    stated.or_else(|| of(Model::Graded).chain(of(Model::Ffb)).next())
}

/// Whether one is, by definition, half of the other: they agree whatever bone does.
fn is_part_of(part: &Sample, mean: &Sample) -> bool {
    let parts = [Model::Firm, Model::Floppy];
    mean.model == Model::Ffb && parts.contains(&part.model) && part.structure == mean.structure
}

pub(super) fn against_reference(samples: &[Sample]) -> Vec<Comparison<'_>> {
    let Some(reference) = reference(samples) else {
        return Vec::new();
    };
    let others = samples
        .iter()
        .filter(|s| *s != reference && !is_part_of(s, reference));
    let against = |sample| {
        let shared = reference.cases.iter().filter_map(|r| {
            let s = Sample::of(sample, &r.scan)?;
            // A percentage of nothing says nothing.
            (r.e_app_mpa > 0.0).then_some((s, r))
        });
        let shared: Vec<(&Case, &Case)> = shared.collect();
        let of = |value: fn(&(&Case, &Case)) -> f64| shared.iter().map(value).collect();
        Comparison {
            sample,
            reference,
            method_mpa: of(|(s, _)| s.e_app_mpa),
            reference_mpa: of(|(_, r)| r.e_app_mpa),
            bv_tv: of(|(_, r)| r.bv_tv),
        }
    };
    let enough = |c: &Comparison| c.method_mpa.len() >= LEAST_SCANS;
    others.map(against).filter(enough).collect()
}

pub fn statistics(samples: &[Sample]) -> Statistics {
    let on_bv_tv = samples.iter().filter_map(|s| {
        let bv_tv: Vec<f64> = s.cases.iter().map(|case| case.bv_tv).collect();
        Some(RegressionLine {
            y: format!("E_app {} (MPa)", s.method),
            x: "BV/TV".to_owned(),
            fit: regression(&bv_tv, &s.e_app_mpa())?,
        })
    });
    let of_bone = samples.iter().filter_map(|s| {
        let [mask, model] = s.bone_volumes();
        Some(RegressionLine {
            y: format!("BV/TV of the model, {}", s.method),
            x: "BV/TV".to_owned(),
            fit: regression(&mask, &model)?,
        })
    });
    let pairs = against_reference(samples);
    let on_reference = pairs.iter().filter_map(|c| {
        Some(RegressionLine {
            y: format!("E_app {} (MPa)", c.sample.method),
            x: format!("E_app {} (MPa)", c.reference.method),
            fit: regression(&c.reference_mpa, &c.method_mpa)?,
        })
    });
    let over_bv_tv = pairs.iter().filter_map(|c| {
        let [method, reference] = c.over_bv_tv();
        Some(RegressionLine {
            y: format!("E_app / (BV/TV) {} (MPa)", c.sample.method),
            x: format!("E_app / (BV/TV) {} (MPa)", c.reference.method),
            fit: regression(&reference, &method)?,
        })
    });
    let differences = pairs.iter().filter_map(|c| {
        Some(RegressionLine {
            y: format!("{}: {}", c.sample.method, c.difference_from()),
            x: "BV/TV".to_owned(),
            fit: regression(&c.bv_tv, &c.differences_percent())?,
        })
    });
    let agreements = pairs.iter().filter_map(|c| {
        Some(AgreementLine {
            method: c.sample.method.clone(),
            reference: c.reference.method.clone(),
            found: agreement(&c.method_mpa, &c.reference_mpa)?,
        })
    });
    let (anova_between, values) = repeated(samples);
    Statistics {
        regressions: of_bone
            .chain(on_bv_tv)
            .chain(on_reference)
            .chain(over_bv_tv)
            .chain(differences)
            .collect(),
        agreements: agreements.collect(),
        boxes: samples
            .iter()
            .flat_map(box_lines)
            .chain(pairs.iter().filter_map(differences_line))
            .collect(),
        anova: repeated_measures(&values),
        anova_between,
    }
}

/// The methods of an analysis of variance with their moduli of the scans that have them all. FFB is left out where both
/// its parts are in: a level that follows from others makes the covariance of levels singular.
fn repeated(samples: &[Sample]) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut levels: Vec<&Sample> = common(samples).collect();
    let all = levels.clone();
    levels.retain(|mean| all.iter().filter(|part| is_part_of(part, mean)).count() < 2);
    let mut scans: Vec<&str> = all.first().map_or(Vec::new(), |s| {
        s.cases.iter().map(|c| c.scan.as_str()).collect()
    });
    scans.retain(|scan| levels.iter().all(|s| s.of(scan).is_some()));
    if scans.len() < LEAST_SCANS {
        return (Vec::new(), Vec::new());
    }
    let values = |s: &&Sample| {
        let own = scans.iter().filter_map(|scan| s.of(scan));
        own.map(|case| case.e_app_mpa).collect()
    };
    let names = levels.iter().map(|s| s.method.clone()).collect();
    (names, levels.iter().map(values).collect())
}

fn box_lines(sample: &Sample) -> Vec<BoxLine> {
    let over = |case: &super::sample::Case| case.e_app_mpa / case.bv_tv;
    let over: Vec<f64> = sample.cases.iter().map(over).collect();
    let line = |quantity: &str, group: Option<&str>, values: &[f64]| {
        Some(BoxLine {
            quantity: quantity.to_owned(),
            method: sample.method.clone(),
            group: group.map(str::to_owned),
            found: quartiles(values)?,
        })
    };
    let [mask, model] = sample.bone_volumes();
    let both = model.iter().zip(&mask);
    let off: Vec<f64> = both.map(|(m, b)| 100.0 * (m / b - 1.0)).collect();
    let mut lines = vec![
        line("BV of the model, difference from the mask (%)", None, &off),
        line("E_app (MPa)", None, &sample.e_app_mpa()),
        line("E_app / (BV/TV) (MPa)", None, &over),
    ];
    for group in groups(sample) {
        lines.push(line("E_app (MPa)", Some(group), &of_group(sample, group)));
    }
    lines.into_iter().flatten().collect()
}

fn differences_line(c: &Comparison) -> Option<BoxLine> {
    Some(BoxLine {
        quantity: c.difference_from(),
        method: c.sample.method.clone(),
        group: None,
        found: quartiles(&c.differences_percent())?,
    })
}

pub(super) fn groups(sample: &Sample) -> Vec<&String> {
    distinct(sample.cases.iter().filter_map(|case| case.group.as_ref()))
}

pub(super) fn of_group(sample: &Sample, group: &str) -> Vec<f64> {
    let own = sample
        .cases
        .iter()
        .filter(|c| c.group.as_deref() == Some(group));
    own.map(|case| case.e_app_mpa).collect()
}

#[cfg(test)]
#[path = "statistics_tests.rs"]
mod tests;

#[cfg(test)]
pub(super) use tests::cases;
