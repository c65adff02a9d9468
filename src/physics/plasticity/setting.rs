//! Owns laws of yield as settings: one for all tissue, or one a label.

use super::YieldLaw;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The law of one label of a labelled scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LabelLaw {
    /// The voxels' value.
    pub value: i32,
    /// How this tissue yields.
    pub law: YieldLaw,
}

/// How tissue yields.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Plasticity {
    /// One law for all bone.
    All(YieldLaw),
    /// A law for each label.
    Labels(Vec<LabelLaw>),
}

impl Plasticity {
    /// # Errors
    /// Numbers that are no law, labels that stand there twice.
    pub fn check(&self) -> Result<()> {
        let wrong = |found: String, advice: &str| {
            Err(Error::setting("solve.plasticity", found, advice.to_owned()))
        };
        let laws: Vec<YieldLaw> = match self {
            Plasticity::All(law) => vec![*law],
            Plasticity::Labels(labels) => {
                let twice = |i: &usize| labels[..*i].iter().any(|l| l.value == labels[*i].value);
                if let Some(i) = (0..labels.len()).find(twice) {
                    return wrong(
                        format!("label {} stands there twice", labels[i].value),
                        "give each label once",
                    );
                }
                if labels.is_empty() || labels.len() > 255 {
                    return wrong(
                        format!("{} labels", labels.len()),
                        "give 1 to 255 labels, as labels:100=von-mises:68,127=von-mises:100",
                    );
                }
                labels.iter().map(|label| label.law).collect()
            }
        };
        match laws.iter().find_map(YieldLaw::wrong) {
            Some(words) => wrong(format!("not usable: {}", self.words()), words),
            None => Ok(()),
        }
    }

    /// As on the command line.
    pub fn words(&self) -> String {
        match self {
            Plasticity::All(law) => law.words(),
            Plasticity::Labels(labels) => {
                let each = labels
                    .iter()
                    .map(|l| format!("{}={}", l.value, l.law.words()));
                format!("labels:{}", each.collect::<Vec<_>>().join(","))
            }
        }
    }
}

impl YieldLaw {
    fn words(&self) -> String {
        let (name, numbers, hardening) = match self {
            YieldLaw::VonMises(law) => ("von-mises", vec![law.yield_mpa], law.hardening_mpa),
            YieldLaw::Asymmetric(law) => (
                "asymmetric",
                vec![law.tension_mpa, law.compression_mpa],
                law.hardening_mpa,
            ),
        };
        let all = numbers
            .into_iter()
            .chain((hardening != 0.0).then_some(hardening));
        let all: Vec<String> = all.map(|v| v.to_string()).collect();
        format!("{name}:{}", all.join(","))
    }
}
