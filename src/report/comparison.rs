//! Owns the figures of methods held against each other: boxes, agreement with the reference, Bland and Altman's plot.

use super::figure::{Axis, Content, Curve, Figure, Mark, Point};
use super::sample::Sample;
use super::statistics::{Comparison, against_reference, groups, of_group, reference};
use crate::result::statistics::agreement::agreement;

/// Letters below an axis of boxes; more would run into each other.
const LABELS: usize = 48;

/// Empty for fewer than three scans.
pub fn figures(samples: &[Sample]) -> Vec<Figure> {
    if samples.is_empty() {
        return Vec::new();
    }
    let pairs = against_reference(samples);
    let mut figures = vec![boxes(samples)];
    figures.extend(identity(&pairs));
    figures.extend(pairs.iter().map(bland_altman));
    figures.extend(by_group(samples));
    figures
}

fn boxes(samples: &[Sample]) -> Figure {
    let names: Vec<String> = samples.iter().map(|s| s.method.clone()).collect();
    let fit = names.iter().map(String::len).sum::<usize>() <= LABELS;
    let with_n = samples.iter().enumerate().map(|(i, s)| {
        let number = if fit {
            String::new()
        } else {
            format!("{}: ", i + 1)
        };
        format!("{number}{} (n = {})", s.method, s.cases.len())
    });
    let labels = names.into_iter().enumerate().map(|(i, name)| match fit {
        true => name,
        false => (i + 1).to_string(),
    });
    Figure {
        stem: "methods".to_owned(),
        scan: None,
        title: "Apparent modulus by method".to_owned(),
        caption: format!(
            "Scans at their finest lattice parameter: {}. Box: quartiles; whiskers: 1.5 interquartile ranges; points: scans.",
            with_n.collect::<Vec<_>>().join("; ")
        ),
        x: Axis::linear(""),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Boxes(labels.zip(samples.iter().map(Sample::e_app_mpa)).collect()),
    }
}

/// Boxes of the most trusted method by group, where a manifest gave groups.
fn by_group(samples: &[Sample]) -> Option<Figure> {
    let sample = reference(samples)?;
    let names = groups(sample);
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

/// Moduli of all methods over those of the reference. None without comparisons.
fn identity(pairs: &[Comparison]) -> Option<Figure> {
    let reference = &pairs.first()?.reference.method;
    let all = pairs.iter().flat_map(|c| &c.reference_mpa);
    let most = all.copied().fold(0.0, f64::max);
    let points = |c: &Comparison| {
        let both = c.reference_mpa.iter().zip(&c.method_mpa);
        both.map(|(x, y)| Point::new(*x, *y)).collect()
    };
    let mut curves: Vec<Curve> = pairs
        .iter()
        .map(|c| Curve {
            name: c.sample.method.clone(),
            hue: c.sample.model as usize,
            shape: c.sample.model as usize,
            mark: Mark::Points,
            points: points(c),
        })
        .collect();
    curves.push(Curve {
        name: "equal".to_owned(),
        hue: 2,
        shape: 0,
        mark: Mark::Rule,
        points: vec![Point::new(0.0, 0.0), Point::new(most, most)],
    });
    Some(Figure {
        stem: "agreement".to_owned(),
        scan: None,
        title: format!("Methods against {reference}"),
        caption: "One point per scan that has both; on the dashed line methods agree.".to_owned(),
        x: Axis::linear(&format!("apparent modulus, {reference} (MPa)")),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
    })
}

fn bland_altman(c: &Comparison) -> Figure {
    let both = c.method_mpa.iter().zip(&c.reference_mpa);
    let points: Vec<Point> = both
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
    if let Some(found) = agreement(&c.method_mpa, &c.reference_mpa) {
        curves.push(level("mean + 1.96 SD", 1, found.upper_limit));
        curves.push(level("mean", 2, found.bias));
        curves.push(level("mean − 1.96 SD", 1, found.lower_limit));
    }
    let n = points.len();
    curves.push(Curve {
        name: "scans".to_owned(),
        hue: 0,
        shape: 0,
        mark: Mark::Points,
        points,
    });
    let (method, reference) = (&c.sample.method, &c.reference.method);
    Figure {
        stem: format!(
            "bland-altman-{}",
            method.to_lowercase().replace(", ", "-").replace(' ', "-")
        ),
        scan: None,
        title: format!("{method} against {reference}"),
        caption: format!(
            "{method} less {reference} over the mean of both (Bland and Altman), {n} scans, with the mean difference and its limits of agreement."
        ),
        x: Axis::linear("mean of both (MPa)"),
        y: Axis::linear("difference (MPa)"),
        content: Content::Curves(curves),
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::samples;
    use super::super::statistics::cases::{cohort, with_limit};
    use super::*;
    use crate::result::row::Row;
    use crate::result::settings::Method;

    fn of(rows: &[Row]) -> Vec<Figure> {
        figures(&samples(rows).0)
    }

    fn stems(figures: &[Figure]) -> Vec<&str> {
        figures.iter().map(|f| f.stem.as_str()).collect()
    }

    #[test]
    fn a_mean_has_no_figure_against_its_parts() {
        assert_eq!(of(&cohort(2)), []);
        assert_eq!(stems(&of(&cohort(4))), ["methods", "groups"]);
    }

    #[test]
    fn two_limits_differ_in_name_colour_and_marker() {
        let rows = with_limit(
            with_limit(cohort(4), Method::Lattice, 0.05),
            Method::VoxelFe,
            0.02,
        );
        let figures = of(&rows);
        let expected = [
            "methods",
            "agreement",
            "bland-altman-floppy",
            "bland-altman-firm",
            "bland-altman-ffb-mean",
            "bland-altman-graded-extrapolated",
            "groups",
        ];
        assert_eq!(stems(&figures), expected);
        assert!(
            figures[0]
                .caption
                .contains("4: graded, extrapolated (n = 4)")
        );
        let bv_tv = super::super::curves::against_bv_tv(&rows).unwrap();
        let Content::Curves(curves) = bv_tv.content else {
            panic!("curves are curves");
        };
        let look = |name: &str| {
            let found = curves.iter().find(|c| c.name == name);
            found.map(|c| (c.hue % 7, c.shape % 7))
        };
        let [graded, fe] =
            ["graded, extrapolated", "voxel FE, extrapolated"].map(|n| look(n).unwrap());
        assert!(graded.0 != fe.0 && graded.1 != fe.1, "{graded:?} {fe:?}");
    }
}
