//! Owns the figures of methods compared with each other: distributions, agreement with the reference, Bland and Altman's plot.

use super::figure::{Axis, Content, Curve, Figure, GroupOfPoints, Mark, Point};
use super::sample::Sample;
use super::statistics::{Comparison, against_reference};
use crate::report::cells::{digits, p_value};
use crate::result::statistics::agreement::{agreement, percent_differences};
use crate::result::statistics::quartiles::quartiles;
use crate::result::statistics::regression::regression;

/// Empty for fewer than three scans.
pub fn figures(samples: &[Sample]) -> Vec<Figure> {
    if samples.is_empty() {
        return Vec::new();
    }
    let pairs = against_reference(samples);
    let mut figures = vec![methods(samples)];
    figures.extend(bone_volumes(samples));
    figures.extend(identity(&pairs));
    figures.extend(identity_over_bv_tv(&pairs));
    figures.extend(differences(&pairs));
    figures.extend(differences_over_bv_tv(&pairs));
    for pair in &pairs {
        figures.extend([bland_altman(pair), bland_altman_percent(pair)]);
    }
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
        caption: "Points: scans, each at its finest lattice parameter or element; line: median."
            .to_owned(),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Groups(samples.iter().map(group).collect()),
        ..Figure::default()
    }
}

/// Bone volume of the models over that of the mask. None where no model has one.
fn bone_volumes(samples: &[Sample]) -> Option<Figure> {
    let places = samples.iter().map(|s| (s, s.bone_volumes()));
    let places: Vec<_> = places.filter(|(_, [mask, _])| !mask.is_empty()).collect();
    (!places.is_empty()).then(|| Figure {
        stem: "bone-volume".to_owned(),
        folded: true,
        title: "Bone volume of the models".to_owned(),
        caption: "BV/TV of the cells or elements that carry load over that of the mask, one point per scan, with lines of least squares; on the dashed black line both are equal."
            .to_owned(),
        x: Axis::linear("BV/TV of the mask"),
        y: Axis::linear("BV/TV of the model"),
        content: Content::Curves(against_equal(&places)),
        ..Figure::default()
    })
}

/// Moduli of all methods over those of the reference. None without comparisons.
fn identity(pairs: &[Comparison]) -> Option<Figure> {
    let reference = &pairs.first()?.reference.method;
    let places = |c: &Comparison| [c.reference_mpa.clone(), c.method_mpa.clone()];
    let curves = against_equal(&each_sample(pairs, places));
    Some(Figure {
        stem: "agreement".to_owned(),
        folded: true,
        title: format!("Methods against {reference}"),
        caption: "One point per scan that has both, with lines of least squares; on the dashed black line methods agree.".to_owned(),
        x: Axis::linear(&format!("apparent modulus, {reference} (MPa)")),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
    })
}

/// The same of moduli over BV/TV: what the amount of bone explains is out.
fn identity_over_bv_tv(pairs: &[Comparison]) -> Option<Figure> {
    let reference = &pairs.first()?.reference.method;
    let places = |c: &Comparison| {
        let [method, reference] = c.over_bv_tv();
        [reference, method]
    };
    let curves = against_equal(&each_sample(pairs, places));
    Some(Figure {
        stem: "agreement-over-bv-tv".to_owned(),
        folded: true,
        title: format!("Methods against {reference}, over BV/TV"),
        caption: "Modulus over BV/TV, one point per scan that has both, with lines of least squares; on the dashed black line methods agree."
            .to_owned(),
        x: Axis::linear(&format!("E_app / (BV/TV), {reference} (MPa)")),
        y: Axis::linear("E_app / (BV/TV) (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
    })
}

/// The methods compared, and the places of their points.
fn each_sample<'a>(
    pairs: &[Comparison<'a>],
    places: impl Fn(&Comparison) -> [Vec<f64>; 2],
) -> Vec<(&'a Sample, [Vec<f64>; 2])> {
    pairs.iter().map(|c| (c.sample, places(c))).collect()
}

/// Points and lines of fit of methods, values over x and y, and the line on which both are equal.
fn against_equal(places: &[(&Sample, [Vec<f64>; 2])]) -> Vec<Curve> {
    let most = places
        .iter()
        .flat_map(|(_, [x, _])| x)
        .copied()
        .fold(0.0, f64::max);
    let numbered = places.iter().enumerate();
    let mut curves: Vec<Curve> = numbered.map(|(i, (s, at))| points(i, s, at)).collect();
    let lines = places
        .iter()
        .filter_map(|(s, at)| fitted(s.model as usize, at));
    curves.extend(lines);
    curves.push(Curve {
        name: "equal".to_owned(),
        hue: 2,
        shape: 0,
        mark: Mark::Rule,
        points: vec![Point::new(0.0, 0.0), Point::new(most, most)],
    });
    curves
}

/// Methods of one model on several structures have one colour; each has its own marker.
fn points(number: usize, sample: &Sample, [x, y]: &[Vec<f64>; 2]) -> Curve {
    Curve {
        name: sample.method.clone(),
        hue: sample.model as usize,
        shape: number,
        mark: Mark::Points,
        points: x.iter().zip(y).map(|(x, y)| Point::new(*x, *y)).collect(),
    }
}

/// The line of least squares, without a name of its own.
fn fitted(hue: usize, [x, y]: &[Vec<f64>; 2]) -> Option<Curve> {
    let line = regression(x, y)?;
    let (low, high) = span(x);
    let at = |x: f64| Point::new(x, line.intercept + line.slope * x);
    Some(Curve {
        name: String::new(),
        hue,
        shape: 0,
        mark: Mark::Rule,
        points: vec![at(low), at(high)],
    })
}

fn span(values: &[f64]) -> (f64, f64) {
    let ends = (f64::INFINITY, f64::NEG_INFINITY);
    values
        .iter()
        .fold(ends, |(low, high), v| (low.min(*v), high.max(*v)))
}

/// Differences from the reference in percent, side by side.
fn differences(pairs: &[Comparison]) -> Option<Figure> {
    let first = pairs.first()?;
    let group = |c: &Comparison| GroupOfPoints {
        label: format!("{} (n = {})", c.sample.method, c.method_mpa.len()),
        hue: c.sample.model as usize,
        values: c.differences_percent(),
        mean: None,
        median: quartiles(&c.differences_percent()).map(|q| q.median),
    };
    Some(Figure {
        stem: "differences".to_owned(),
        folded: true,
        title: format!("Differences from {}", first.reference.method),
        caption: "Points: scans, method less reference over the reference; line: median."
            .to_owned(),
        y: Axis::linear(&first.difference_from()),
        content: Content::Groups(pairs.iter().map(group).collect()),
        ..Figure::default()
    })
}

/// The same over BV/TV: whether a method is off by more where there is less bone.
fn differences_over_bv_tv(pairs: &[Comparison]) -> Option<Figure> {
    let first = pairs.first()?;
    let places = |c: &Comparison| [c.bv_tv.clone(), c.differences_percent()];
    let numbered = pairs.iter().enumerate();
    let mut curves: Vec<Curve> = numbered
        .map(|(i, c)| points(i, c.sample, &places(c)))
        .collect();
    let lines = pairs
        .iter()
        .filter_map(|c| fitted(c.sample.model as usize, &places(c)));
    curves.extend(lines);
    Some(Figure {
        stem: "differences-over-bv-tv".to_owned(),
        folded: true,
        title: format!("Differences from {} over BV/TV", first.reference.method),
        caption: "One point per scan that has both, with lines of least squares; their slopes and p are in the table of regressions."
            .to_owned(),
        x: Axis::linear("BV/TV"),
        y: Axis::linear(&first.difference_from()),
        content: Content::Curves(curves),
        ..Figure::default()
    })
}

/// Bland and Altman's plot of the differences in MPa.
fn bland_altman(c: &Comparison) -> Figure {
    let both = c.method_mpa.iter().zip(&c.reference_mpa);
    let differences: Vec<f64> = both.map(|(a, b)| a - b).collect();
    let levels = agreement(&c.method_mpa, &c.reference_mpa);
    let (method, reference) = (&c.sample.method, &c.reference.method);
    Figure {
        stem: format!("bland-altman-{}", file_words(method)),
        title: format!("{method} against {reference}"),
        caption: format!(
            "{method} minus {reference} over the mean of both (Bland and Altman), {} scans, with the mean difference and its limits of agreement.",
            differences.len()
        ),
        y: Axis::linear("difference (MPa)"),
        ..over_means(
            c,
            &differences,
            levels.map(|a| [a.bias, a.lower_limit, a.upper_limit]),
        )
    }
}

/// The same with differences in percent of the mean of both, and their line of least squares.
fn bland_altman_percent(c: &Comparison) -> Figure {
    let differences = percent_differences(&c.method_mpa, &c.reference_mpa);
    let levels = agreement(&c.method_mpa, &c.reference_mpa);
    let slope = levels.and_then(|a| Some((a.slope_percent_per_mpa?, a.slope_p?)));
    let tested = match slope {
        Some((slope, p)) => format!(
            " Their slope is {} % per MPa (p {}).",
            digits(Some(slope)),
            p_value(Some(p)).text
        ),
        None => String::new(),
    };
    let (method, reference) = (&c.sample.method, &c.reference.method);
    let limits = levels.map(|a| [a.bias_percent, a.lower_limit_percent, a.upper_limit_percent]);
    let mut figure = Figure {
        stem: format!("bland-altman-percent-{}", file_words(method)),
        title: format!("{method} against {reference}, in percent"),
        caption: format!(
            "{method} minus {reference} in percent of the mean of both, {} scans, with the mean difference and its limits of agreement.{tested}",
            differences.len()
        ),
        y: Axis::linear("difference (% of the mean)"),
        ..over_means(c, &differences, limits)
    };
    if let Content::Curves(curves) = &mut figure.content {
        // In the colour of the points: limits have another.
        curves.extend(fitted(0, &[means(c), differences]).map(|line| Curve {
            name: "line of least squares".to_owned(),
            ..line
        }));
    }
    figure
}

fn means(c: &Comparison) -> Vec<f64> {
    let both = c.method_mpa.iter().zip(&c.reference_mpa);
    both.map(|(a, b)| 0.5 * (a + b)).collect()
}

/// Differences over the means of both, with their mean and limits of agreement as levels.
fn over_means(c: &Comparison, differences: &[f64], levels: Option<[f64; 3]>) -> Figure {
    let means = means(c);
    let (low, high) = span(&means);
    let level = |name: &str, hue, y| Curve {
        name: name.to_owned(),
        hue,
        shape: 0,
        mark: Mark::Rule,
        points: vec![Point::new(low, y), Point::new(high, y)],
    };
    let mut curves = Vec::new();
    if let Some([mean, lower, upper]) = levels {
        curves.push(level("mean + 1.96 SD", 1, upper));
        curves.push(level("mean", 2, mean));
        curves.push(level("mean − 1.96 SD", 1, lower));
    }
    let places = means.iter().zip(differences);
    curves.push(Curve {
        name: "scans".to_owned(),
        hue: 0,
        shape: 0,
        mark: Mark::Points,
        points: places.map(|(x, y)| Point::new(*x, *y)).collect(),
    });
    Figure {
        folded: true,
        x: Axis::linear("mean of both (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
    }
}

/// A method's name in the name of a file.
fn file_words(method: &str) -> String {
    method.to_lowercase().replace(", ", "-").replace(' ', "-")
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
            "agreement-over-bv-tv",
            "differences",
            "differences-over-bv-tv",
            "bland-altman-floppy",
            "bland-altman-percent-floppy",
            "bland-altman-firm",
            "bland-altman-percent-firm",
            "bland-altman-ffb-mean",
            "bland-altman-percent-ffb-mean",
            "bland-altman-connected-extrapolated",
            "bland-altman-percent-connected-extrapolated",
        ];
        assert_eq!(stems(&figures), expected);
        let Content::Groups(groups) = &figures[0].content else {
            panic!("methods are side by side");
        };
        assert_eq!(groups[3].label, "connected, extrapolated (n = 4)");
        let Content::Curves(curves) = &figures[1].content else {
            panic!("curves are curves");
        };
        let look = |name: &str| {
            let found = curves.iter().find(|c| c.name == name);
            found.map(|c| (c.hue % 7, c.shape % 7))
        };
        let [graded, ffb] = ["connected, extrapolated", "FFB mean"].map(|n| look(n).unwrap());
        assert!(graded.0 != ffb.0 && graded.1 != ffb.1, "{graded:?} {ffb:?}");
    }
}
