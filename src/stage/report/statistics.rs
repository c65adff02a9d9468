//! Owns the report's statistics over scans: which methods are compared, and the tables and figures of it.

use super::figure::{Axis, Content, Curve, Figure, Mark, Point};
use super::{Model, distinct};
use crate::measure::row::Row;
use crate::measure::statistics::agreement::{Agreement, agreement};
use crate::measure::statistics::anova::{Anova, repeated_measures};
use crate::measure::statistics::quartiles::{Quartiles, quartiles};
use crate::measure::statistics::regression::{Regression, regression};
use serde::Serialize;

/// Fewer scans than this make no statistics.
const LEAST_SCANS: usize = 3;

/// One method's moduli of all scans that have every method compared, each at its finest lattice parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    pub method: String,
    model: Model,
    scans: Vec<String>,
    groups: Vec<Option<String>>,
    bv_tv: Vec<f64>,
    e_app_mpa: Vec<f64>,
}

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
    /// `E_app (MPa)` or `E_app / (BV/TV) (MPa)`.
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
    /// Between all methods, repeated over scans.
    pub anova: Option<Anova>,
}

/// The methods to compare. Empty for fewer than three scans; rows that are not converged and rows of a second set of
/// settings of the same scan and method are left out.
pub fn samples(rows: &[Row]) -> Vec<Sample> {
    let usable = |row: &&Row| row.converged != Some(false) && row.e_app_mpa.is_some();
    let rows: Vec<(Model, &Row)> = rows
        .iter()
        .filter(usable)
        .filter_map(|row| Some((Model::of(row)?, row)))
        .collect();
    let methods = distinct(
        rows.iter()
            .map(|(model, row)| (*model, row.structure.clone())),
    );
    let lattices = distinct(methods.iter().filter(|(_, s)| s != "hex8").map(|(_, s)| s)).len();
    let finest = |model: Model, structure: &str, scan: &str| {
        let own = rows
            .iter()
            .filter(|(m, row)| *m == model && row.structure == structure && row.scan == scan);
        own.map(|(_, row)| *row)
            .min_by(|a, b| a.lp_mm.total_cmp(&b.lp_mm))
    };
    let mut scans = distinct(rows.iter().map(|(_, row)| row.scan.clone()));
    scans.retain(|scan| {
        methods
            .iter()
            .all(|(model, structure)| finest(*model, structure, scan).is_some())
    });
    if scans.len() < LEAST_SCANS {
        return Vec::new();
    }
    let sample = |(model, structure): &(Model, String)| {
        let found: Vec<&Row> = scans
            .iter()
            .filter_map(|scan| finest(*model, structure, scan))
            .collect();
        let prefix = if lattices > 1 && structure != "hex8" {
            format!("{} ", structure.to_uppercase())
        } else {
            String::new()
        };
        Sample {
            method: format!("{prefix}{}", model.name()),
            model: *model,
            scans: scans.clone(),
            groups: found.iter().map(|row| row.group.clone()).collect(),
            bv_tv: found.iter().map(|row| row.bv_tv).collect(),
            e_app_mpa: found.iter().filter_map(|row| row.e_app_mpa).collect(),
        }
    };
    methods.iter().map(sample).collect()
}

/// What the others are held against: the most trusted method there is.
fn reference(samples: &[Sample]) -> Option<&Sample> {
    let trust = [
        Model::Extrapolated,
        Model::VoxelFe,
        Model::Graded,
        Model::Ffb,
    ];
    trust
        .iter()
        .find_map(|model| samples.iter().find(|s| s.model == *model))
}

fn against_reference(samples: &[Sample]) -> Vec<(&Sample, &Sample)> {
    let Some(reference) = reference(samples) else {
        return Vec::new();
    };
    samples
        .iter()
        .filter(|s| *s != reference)
        .map(|s| (s, reference))
        .collect()
}

pub fn statistics(samples: &[Sample]) -> Statistics {
    let on_bv_tv = samples.iter().filter_map(|s| {
        Some(RegressionLine {
            y: format!("E_app {} (MPa)", s.method),
            x: "BV/TV".to_owned(),
            fit: regression(&s.bv_tv, &s.e_app_mpa)?,
        })
    });
    let pairs = against_reference(samples);
    let on_reference = pairs.iter().filter_map(|(s, r)| {
        Some(RegressionLine {
            y: format!("E_app {} (MPa)", s.method),
            x: format!("E_app {} (MPa)", r.method),
            fit: regression(&r.e_app_mpa, &s.e_app_mpa)?,
        })
    });
    let agreements = pairs.iter().filter_map(|(s, r)| {
        Some(AgreementLine {
            method: s.method.clone(),
            reference: r.method.clone(),
            found: agreement(&s.e_app_mpa, &r.e_app_mpa)?,
        })
    });
    let values: Vec<Vec<f64>> = samples.iter().map(|s| s.e_app_mpa.clone()).collect();
    Statistics {
        regressions: on_bv_tv.chain(on_reference).collect(),
        agreements: agreements.collect(),
        boxes: samples.iter().flat_map(box_lines).collect(),
        anova: repeated_measures(&values),
    }
}

fn box_lines(sample: &Sample) -> Vec<BoxLine> {
    let over: Vec<f64> = sample
        .e_app_mpa
        .iter()
        .zip(&sample.bv_tv)
        .map(|(e, f)| e / f)
        .collect();
    let line = |quantity: &str, group: Option<&str>, values: &[f64]| {
        Some(BoxLine {
            quantity: quantity.to_owned(),
            method: sample.method.clone(),
            group: group.map(str::to_owned),
            found: quartiles(values)?,
        })
    };
    let mut lines = vec![
        line("E_app (MPa)", None, &sample.e_app_mpa),
        line("E_app / (BV/TV) (MPa)", None, &over),
    ];
    for group in distinct(sample.groups.iter().flatten()) {
        lines.push(line("E_app (MPa)", Some(group), &of_group(sample, group)));
    }
    lines.into_iter().flatten().collect()
}

fn of_group(sample: &Sample, group: &str) -> Vec<f64> {
    let all = sample.groups.iter().zip(&sample.e_app_mpa);
    all.filter(|(g, _)| g.as_deref() == Some(group))
        .map(|(_, e)| *e)
        .collect()
}

/// Agreement with the reference, Bland and Altman's plot, and boxes. Empty for fewer than three scans.
pub fn figures(samples: &[Sample]) -> Vec<Figure> {
    if samples.is_empty() {
        return Vec::new();
    }
    let pairs = against_reference(samples);
    let mut figures = vec![boxes(samples)];
    if let Some((_, reference)) = pairs.first() {
        figures.push(identity(&pairs, reference));
    }
    figures.extend(pairs.iter().map(|(s, r)| bland_altman(s, r)));
    figures.extend(groups(samples));
    figures
}

fn boxes(samples: &[Sample]) -> Figure {
    Figure {
        stem: "methods".to_owned(),
        scan: None,
        title: "Apparent modulus by method".to_owned(),
        caption: format!(
            "{} scans at their finest lattice parameter. Box: quartiles; whiskers: 1.5 interquartile ranges; points: scans.",
            samples[0].scans.len()
        ),
        x: Axis::linear(""),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Boxes(
            samples
                .iter()
                .map(|s| (s.method.clone(), s.e_app_mpa.clone()))
                .collect(),
        ),
    }
}

/// Boxes of the most trusted method by group, where a manifest gave groups.
fn groups(samples: &[Sample]) -> Option<Figure> {
    let sample = reference(samples)?;
    let names = distinct(sample.groups.iter().flatten());
    (names.len() > 1).then(|| Figure {
        stem: "groups".to_owned(),
        scan: None,
        title: format!("Apparent modulus ({}) by group", sample.method),
        caption: "Box: quartiles; whiskers: 1.5 interquartile ranges; points: scans.".to_owned(),
        x: Axis::linear(""),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Boxes(
            names
                .into_iter()
                .map(|g| (g.clone(), of_group(sample, g)))
                .collect(),
        ),
    })
}

fn identity(pairs: &[(&Sample, &Sample)], reference: &Sample) -> Figure {
    let most = reference.e_app_mpa.iter().copied().fold(0.0, f64::max);
    let mut curves: Vec<Curve> = pairs
        .iter()
        .map(|(s, r)| Curve {
            name: s.method.clone(),
            hue: s.model as usize,
            shape: s.model as usize,
            mark: Mark::Points,
            points: r
                .e_app_mpa
                .iter()
                .zip(&s.e_app_mpa)
                .map(|(x, y)| Point::new(*x, *y))
                .collect(),
        })
        .collect();
    curves.push(Curve {
        name: "equal".to_owned(),
        hue: 2,
        shape: 0,
        mark: Mark::Rule,
        points: vec![Point::new(0.0, 0.0), Point::new(most, most)],
    });
    Figure {
        stem: "agreement".to_owned(),
        scan: None,
        title: format!("Methods against {}", reference.method),
        caption: "One point per scan; on the dashed line methods agree.".to_owned(),
        x: Axis::linear(&format!("apparent modulus, {} (MPa)", reference.method)),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
    }
}

fn bland_altman(s: &Sample, r: &Sample) -> Figure {
    let points: Vec<Point> = s
        .e_app_mpa
        .iter()
        .zip(&r.e_app_mpa)
        .map(|(a, b)| Point::new(0.5 * (a + b), a - b))
        .collect();
    let ends = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), p| {
            (lo.min(p.x), hi.max(p.x))
        });
    let level = |name: &str, hue, y| Curve {
        name: name.to_owned(),
        hue,
        shape: 0,
        mark: Mark::Rule,
        points: vec![Point::new(ends.0, y), Point::new(ends.1, y)],
    };
    let mut curves = Vec::new();
    if let Some(found) = agreement(&s.e_app_mpa, &r.e_app_mpa) {
        curves.push(level("mean + 1.96 SD", 1, found.upper_limit));
        curves.push(level("mean", 2, found.bias));
        curves.push(level("mean − 1.96 SD", 1, found.lower_limit));
    }
    curves.push(Curve {
        name: "scans".to_owned(),
        hue: 0,
        shape: 0,
        mark: Mark::Points,
        points,
    });
    let name = s.method.to_lowercase().replace(' ', "-");
    Figure {
        stem: format!("bland-altman-{name}"),
        scan: None,
        title: format!("{} against {}", s.method, r.method),
        caption: "Differences over means of the two methods (Bland and Altman), with the mean difference and its limits of agreement.".to_owned(),
        x: Axis::linear("mean of both (MPa)"),
        y: Axis::linear(&format!("{} − {} (MPa)", s.method, r.method)),
        content: Content::Curves(curves),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scan: usize, boundary: &str, lp_mm: f64) -> Row {
        let stiff = if boundary == "firm" { 2.0 } else { 1.0 };
        Row {
            scan: format!("s{scan}"),
            structure: "sc".to_owned(),
            boundary: Some(boundary.to_owned()),
            lp_mm,
            bv_tv: 0.1 * scan as f64,
            e_app_mpa: Some(stiff * (10.0 * scan as f64 + lp_mm)),
            group: Some(if scan < 3 { "a" } else { "b" }.to_owned()),
            ..Row::default()
        }
    }

    fn cohort(n: usize) -> Vec<Row> {
        let scans = (1..=n).flat_map(|scan| {
            ["floppy", "firm", "ffb"]
                .into_iter()
                .flat_map(move |b| [row(scan, b, 0.2), row(scan, b, 0.1)])
        });
        scans.collect()
    }

    #[test]
    fn two_scans_make_no_statistics() {
        assert_eq!(samples(&cohort(2)), []);
        assert_eq!(statistics(&[]), Statistics::default());
        assert_eq!(figures(&[]), []);
    }

    #[test]
    fn methods_are_compared_at_the_finest_lattice_parameter() {
        let samples = samples(&cohort(4));
        assert_eq!(samples.len(), 3);
        assert_eq!(samples[1].e_app_mpa, [20.2, 40.2, 60.2, 80.2]);
        let found = statistics(&samples);
        let firm = &found.agreements[1];
        assert_eq!(
            (firm.method.as_str(), firm.reference.as_str()),
            ("firm", "FFB mean")
        );
        assert!((firm.found.bias - 25.1).abs() < 1e-12);
        assert_eq!(found.anova.unwrap().specimens, 4);
        let stems: Vec<String> = figures(&samples).into_iter().map(|f| f.stem).collect();
        assert_eq!(
            stems,
            [
                "methods",
                "agreement",
                "bland-altman-floppy",
                "bland-altman-firm",
                "groups"
            ]
        );
    }

    #[test]
    fn a_scan_without_one_of_the_methods_is_left_out_of_all() {
        let mut rows = cohort(4);
        rows.retain(|row| !(row.scan == "s2" && row.boundary.as_deref() == Some("firm")));
        assert_eq!(samples(&rows)[0].scans, ["s1", "s3", "s4"]);
    }
}
