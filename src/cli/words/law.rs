//! Laws of yield as words.

use super::number;
use bonepd_ct::physics::plasticity::{DruckerPrager, LabelLaw, Plasticity, VonMises, YieldLaw};

/// `von-mises:YIELD[,HARDENING]`, `asymmetric:TENSION,COMPRESSION[,HARDENING]`, or either by label as `labels:VALUE=LAW,…`.
pub fn plasticity(word: &str) -> Result<Plasticity, String> {
    match word.strip_prefix("labels:") {
        None => one(word).map(Plasticity::All),
        Some(rest) => by_label(rest).map(Plasticity::Labels),
    }
}

fn wrong(word: &str) -> String {
    format!(
        "expected von-mises:YIELD[,HARDENING], asymmetric:TENSION,COMPRESSION[,HARDENING] or labels:VALUE=LAW,…, found `{word}`"
    )
}

fn one(word: &str) -> Result<YieldLaw, String> {
    let (name, rest) = word.split_once(':').ok_or_else(|| wrong(word))?;
    let numbers: Vec<f64> = rest.split(',').map(number).collect::<Result<_, _>>()?;
    let law = match (name.trim(), &numbers[..]) {
        ("von-mises", &[yield_mpa]) => von_mises(yield_mpa, 0.0),
        ("von-mises", &[yield_mpa, hardening_mpa]) => von_mises(yield_mpa, hardening_mpa),
        ("asymmetric", &[tension, compression]) => asymmetric(tension, compression, 0.0),
        ("asymmetric", &[tension, compression, hardening]) => {
            asymmetric(tension, compression, hardening)
        }
        _ => return Err(wrong(word)),
    };
    match law.wrong() {
        Some(words) => Err(format!("{words}, found `{word}`")),
        None => Ok(law),
    }
}

fn von_mises(yield_mpa: f64, hardening_mpa: f64) -> YieldLaw {
    YieldLaw::VonMises(VonMises {
        yield_mpa,
        hardening_mpa,
    })
}

fn asymmetric(tension_mpa: f64, compression_mpa: f64, hardening_mpa: f64) -> YieldLaw {
    YieldLaw::Asymmetric(DruckerPrager {
        tension_mpa,
        compression_mpa,
        hardening_mpa,
    })
}

/// Commas divide labels and the numbers of a law: a part with `=` begins a label.
fn by_label(words: &str) -> Result<Vec<LabelLaw>, String> {
    let mut labels: Vec<(String, String)> = Vec::new();
    for part in words.split(',') {
        match (part.split_once('='), labels.last_mut()) {
            (Some((value, law)), _) => labels.push((value.to_owned(), law.to_owned())),
            (None, Some((_, law))) => *law = format!("{law},{part}"),
            (None, None) => return Err(wrong(words)),
        }
    }
    let label = |(value, law): &(String, String)| {
        Ok(LabelLaw {
            value: value.trim().parse().map_err(|_| wrong(words))?,
            law: one(law)?,
        })
    };
    labels.iter().map(label).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_are_read_and_said_alike() {
        for word in [
            "von-mises:68",
            "von-mises:68,100",
            "asymmetric:50,75",
            "asymmetric:50,75,300",
            "labels:100=von-mises:68,5,127=asymmetric:50,75",
        ] {
            assert_eq!(plasticity(word).unwrap().words(), word);
        }
        for word in [
            "von-mises",
            "von-mises:",
            "von-mises:-3",
            "von-mises:68,-1",
            "von-mises:1,2,3",
            "asymmetric:75",
            "asymmetric:75,50",
            "tresca:3",
            "labels:von-mises:3",
            "labels:a=von-mises:3",
            "labels:",
        ] {
            assert!(plasticity(word).is_err(), "{word}");
        }
    }
}
