//! Owns the figures over answers, coloured by group: the modulus against BV/TV, by group, and scan by scan.

use super::distinct;
use super::figure::{Axis, Content, Curve, Figure, GroupOfPoints, Mark, Point};
use crate::report::answers::{Answers, comparable};
use crate::report::groups::subject_means;
use crate::result::answer::AnswerLine;
use crate::result::statistics::regression::regression;
use crate::result::statistics::summary::summary;

/// More scans than this are no readable row of points.
const MOST_SCANS: usize = 30;

/// Empty for no answers.
pub fn figures(answers: &Answers) -> Vec<Figure> {
    let (kept, _) = comparable(answers);
    let caption = answers
        .conditions
        .iter()
        .take(2)
        .map(|words| format!(" {words}"))
        .collect::<String>();
    let mut figures = Vec::new();
    figures.extend(by_group(&kept, &caption));
    figures.extend(against_bv_tv(&kept, &caption));
    figures.extend(scan_by_scan(&kept, &caption));
    figures
}

/// Groups in the order of the scans; one without a name where there are none.
fn groups<'a>(kept: &[&'a AnswerLine]) -> Vec<Option<&'a str>> {
    distinct(kept.iter().map(|a| a.group.as_deref()))
}

fn of<'a>(kept: &[&'a AnswerLine], group: Option<&str>) -> Vec<&'a AnswerLine> {
    let own = kept.iter().filter(|a| a.group.as_deref() == group);
    own.copied().collect()
}

fn name(group: Option<&str>, alone: bool) -> String {
    match group {
        Some(group) => group.to_owned(),
        None if alone => "scans".to_owned(),
        None => "no group".to_owned(),
    }
}

/// None for fewer than two groups.
fn by_group(kept: &[&AnswerLine], caption: &str) -> Option<Figure> {
    let groups: Vec<&str> = groups(kept).into_iter().flatten().collect();
    if groups.len() < 2 {
        return None;
    }
    let points = groups.iter().enumerate().map(|(hue, group)| {
        let values = subject_means(&of(kept, Some(group)), |a| a.e_app_mpa);
        GroupOfPoints {
            label: format!("{group} (n = {})", values.len()),
            hue,
            mean: summary(&values).map(|s| {
                [
                    s.mean,
                    s.mean_low.unwrap_or(s.mean),
                    s.mean_high.unwrap_or(s.mean),
                ]
            }),
            median: summary(&values).map(|s| s.median),
            values,
        }
    });
    Some(Figure {
        stem: "groups".to_owned(),
        title: "Apparent modulus by group".to_owned(),
        caption: format!(
            "Points: subjects, the mean of their scans; line: median; diamond with bar: mean and its 95 % interval.{caption}"
        ),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Groups(points.collect()),
        ..Figure::default()
    })
}

/// None for fewer than two scans.
fn against_bv_tv(kept: &[&AnswerLine], caption: &str) -> Option<Figure> {
    if kept.len() < 2 {
        return None;
    }
    let groups = groups(kept);
    let mut curves = Vec::new();
    for (hue, group) in groups.iter().enumerate() {
        let own = of(kept, *group);
        let points: Vec<Point> = own.iter().filter_map(|a| point(a, a.bv_tv)).collect();
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|p| (p.x, p.y)).unzip();
        let curve = Curve {
            name: name(*group, groups.len() == 1),
            hue,
            shape: hue,
            mark: Mark::Points,
            points,
        };
        if let Some(fit) = regression(&x, &y) {
            let [low, high] =
                [f64::min, f64::max].map(|f| x.iter().copied().reduce(f).unwrap_or(0.0));
            let at = |x: f64| Point::new(x, fit.intercept + fit.slope * x);
            curves.push(Curve {
                name: String::new(),
                mark: Mark::Rule,
                points: vec![at(low), at(high)],
                ..curve.clone()
            });
        }
        curves.push(curve);
    }
    Some(Figure {
        stem: "bv-tv".to_owned(),
        title: "Stiffness and bone volume fraction".to_owned(),
        caption: format!(
            "One point for each scan: its answer; bars: stated error, cut off at 0; dashed: least squares of each group of three scans or more.{caption}"
        ),
        x: Axis::linear("BV/TV"),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
        ..Figure::default()
    })
}

fn point(answer: &AnswerLine, x: f64) -> Option<Point> {
    Some(Point::modulus(x, answer.e_app_mpa?, answer.error_mpa))
}

/// None for fewer than two scans or too many.
fn scan_by_scan(kept: &[&AnswerLine], caption: &str) -> Option<Figure> {
    if !(2..=MOST_SCANS).contains(&kept.len()) {
        return None;
    }
    let groups = groups(kept);
    let place = |scan: &str| {
        kept.iter()
            .position(|a| a.scan == scan)
            .map(|i| i as f64 + 1.0)
    };
    let curves = groups.iter().enumerate().map(|(hue, group)| Curve {
        name: match groups.len() {
            1 => String::new(),
            _ => name(*group, false),
        },
        hue,
        shape: hue,
        mark: Mark::Points,
        points: of(kept, *group)
            .iter()
            .filter_map(|a| point(a, place(&a.scan)?))
            .collect(),
    });
    Some(Figure {
        stem: "answers".to_owned(),
        title: "Apparent modulus of each scan".to_owned(),
        caption: format!("Bars: all of the stated error, down to 0 at most.{caption}"),
        x: Axis {
            categories: kept.iter().map(|a| a.scan.clone()).collect(),
            ..Axis::linear("")
        },
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves.collect()),
        ..Figure::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(groups: &[Option<&str>]) -> Answers {
        let line = |(i, group): (usize, &Option<&str>)| AnswerLine {
            scan: format!("s{i}"),
            group: group.map(str::to_owned),
            bv_tv: 0.1 * (i + 1) as f64,
            e_app_mpa: Some(10.0 * (i + 1) as f64),
            error_mpa: Some(1.0),
            ..AnswerLine::default()
        };
        Answers {
            lines: groups.iter().enumerate().map(line).collect(),
            ..Answers::default()
        }
    }

    fn stems(groups: &[Option<&str>]) -> Vec<String> {
        figures(&answers(groups))
            .into_iter()
            .map(|f| f.stem)
            .collect()
    }

    #[test]
    fn figures_are_over_answers_and_coloured_by_group() {
        assert_eq!(stems(&[None]), Vec::<String>::new());
        assert_eq!(stems(&[None, None]), ["bv-tv", "answers"]);
        let groups = [Some("a"), Some("b"), Some("a"), Some("b")];
        assert_eq!(stems(&groups), ["groups", "bv-tv", "answers"]);
        let figure = &figures(&answers(&groups))[1];
        let Content::Curves(curves) = &figure.content else {
            panic!("curves are curves");
        };
        let looks: Vec<_> = curves
            .iter()
            .map(|c| (c.name.as_str(), c.hue, c.shape))
            .collect();
        assert_eq!(looks, [("a", 0, 0), ("b", 1, 1)]);
        assert_eq!(curves[0].points[0].y_error, Some([1.0, 1.0]));
    }

    #[test]
    fn the_least_squares_line_is_of_one_group() {
        let groups = [Some("a"), Some("a"), Some("a"), Some("b")];
        let figure = &figures(&answers(&groups))[1];
        let Content::Curves(curves) = &figure.content else {
            panic!("curves are curves");
        };
        let rules: Vec<_> = curves.iter().filter(|c| c.mark == Mark::Rule).collect();
        assert_eq!(
            (rules.len(), rules[0].hue, rules[0].points[1].x),
            (1, 0, 0.1 * 3.0)
        );
    }
}
