//! Owns the figures of methods compared with each other: distributions, agreement with the reference, Bland and Altman's plot.

use super::figure::{Axis, Content, Curve, Figure, GroupOfPoints, Mark, Point};
use super::sample::Sample;
use super::statistics::{Comparison, against_reference};
use crate::result::statistics::agreement::agreement;
use crate::result::statistics::quartiles::quartiles;

/// Empty for fewer than three scans.
pub fn figures(samples: &[Sample]) -> Vec<Figure> {
    if samples.is_empty() {
        return Vec::new();
    }
    let pairs = against_reference(samples);
    let mut figures = vec![methods(samples)];
    figures.extend(identity(&pairs));
    figures.extend(pairs.iter().map(bland_altman));
    figures
}

fn methods(samples: &[Sample]) -> Figure {
    let group = |s: &Sample| GroupOfPoints {
        label: format!("{} (n = {})", s.method, s.cases.len()),
        hue: s.model as usize,
        values: s.e_app_mpa(),
        mean: None,
        median: quartiles(&s.e_app_mpa()).map(|q| q.median),
    };
    Figure {
        stem: "methods".to_owned(),
        folded: true,
        title: "Apparent modulus by method".to_owned(),
        caption: "Points: scans, each at its finest lattice parameter; line: median.".to_owned(),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Groups(samples.iter().map(group).collect()),
        ..Figure::default()
    }
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
        folded: true,
        title: format!("Methods against {reference}"),
        caption: "One point per scan that has both; on the dashed line methods agree.".to_owned(),
        x: Axis::linear(&format!("apparent modulus, {reference} (MPa)")),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
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
        folded: true,
        title: format!("{method} against {reference}"),
        caption: format!(
            "{method} minus {reference} over the mean of both (Bland and Altman), {n} scans, with the mean difference and its limits of agreement."
        ),
        x: Axis::linear("mean of both (MPa)"),
        y: Axis::linear("difference (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
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
        assert_eq!(stems(&of(&cohort(4))), ["methods"]);
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
        ];
        assert_eq!(stems(&figures), expected);
        let Content::Groups(groups) = &figures[0].content else {
            panic!("methods are side by side");
        };
        assert_eq!(groups[3].label, "graded, extrapolated (n = 4)");
        let Content::Curves(curves) = &figures[1].content else {
            panic!("curves are curves");
        };
        let look = |name: &str| {
            let found = curves.iter().find(|c| c.name == name);
            found.map(|c| (c.hue % 7, c.shape % 7))
        };
        let [graded, ffb] = ["graded, extrapolated", "FFB mean"].map(|n| look(n).unwrap());
        assert!(graded.0 != ffb.0 && graded.1 != ffb.1, "{graded:?} {ffb:?}");
    }
}
