//! Owns the report's figures over lattice parameter, bone volume fraction and time.

use super::figure::{Axis, Content, Curve, Figure, Mark, Point};
use super::table::{condition, varying_settings};
use super::{Model, distinct};
use crate::result::row::Row;
use crate::result::settings::CellType;
use crate::result::statistics::regression::regression;
use std::collections::HashSet;

/// Curves of one colour and marker: one structure, one model, one set of settings.
#[derive(Debug, Clone, PartialEq)]
struct Family {
    structure: CellType,
    model: Model,
    condition: Option<String>,
}

/// A row with what a figure needs of it.
struct SolvedRow<'a> {
    row: &'a Row,
    family: Family,
    e_app_mpa: f64,
}

fn solved(rows: &[Row]) -> Vec<SolvedRow<'_>> {
    let varying = varying_settings(rows);
    rows.iter()
        .filter_map(|row| {
            Some(SolvedRow {
                family: Family {
                    structure: row.key.structure,
                    model: Model::of(row)?,
                    condition: condition(row, &varying),
                },
                e_app_mpa: row.e_app_mpa()?,
                row,
            })
        })
        .collect()
}

/// A curve per family, `points` of each. Names say only what tells the curves apart.
fn curves<'a>(
    solved: &[SolvedRow<'a>],
    mark: Mark,
    points: impl Fn(&[&SolvedRow<'a>]) -> Vec<Point>,
) -> Vec<Curve> {
    let families = distinct(solved.iter().map(|s| s.family.clone()));
    let lattices = distinct(
        families
            .iter()
            .map(|f| &f.structure)
            .filter(|s| **s != CellType::Hex8),
    );
    let conditions = distinct(families.iter().map(|f| &f.condition));
    let curve = |family: &Family| {
        let members: Vec<&SolvedRow> = solved.iter().filter(|s| s.family == *family).collect();
        let lattice = lattices.iter().position(|s| *s == &family.structure);
        let condition = conditions.iter().position(|c| *c == &family.condition);
        let mut name = match lattice {
            Some(_) if lattices.len() > 1 => {
                format!(
                    "{} {}",
                    family.structure.name().to_uppercase(),
                    family.model.name()
                )
            }
            _ => family.model.name().to_owned(),
        };
        if let (true, Some(words)) = (conditions.len() > 1, &family.condition) {
            name = format!("{name}, {words}");
        }
        let alone = lattices.len() <= 1 && conditions.len() <= 1;
        Curve {
            name,
            hue: family.model as usize,
            shape: match alone {
                true => family.model as usize,
                false => {
                    lattice.unwrap_or(lattices.len())
                        + lattices.len().max(1) * condition.unwrap_or(0)
                }
            },
            mark,
            points: points(&members),
        }
    };
    let all = families.iter().map(curve);
    all.filter(|c| !c.points.is_empty()).collect()
}

/// E_app against lattice parameter, a figure per scan. Extrapolated values are level lines.
pub fn convergence(rows: &[Row]) -> Vec<Figure> {
    let solved = solved(rows);
    distinct(solved.iter().map(|s| &s.row.key.scan))
        .into_iter()
        .map(|scan| convergence_of(scan, &solved))
        .collect()
}

/// Gives each figure a file of its own: names that differ in characters no file system takes, or in case only, are numbered.
pub fn with_own_files(figures: &mut [Figure]) {
    let mut used = HashSet::new();
    for figure in figures {
        let plain = figure.stem.clone();
        let mut number = 1;
        while !used.insert(figure.stem.to_lowercase()) {
            number += 1;
            figure.stem = format!("{plain}-{number}");
        }
    }
}

fn convergence_of(scan: &str, solved: &[SolvedRow]) -> Figure {
    let (levels, found): (Vec<_>, Vec<_>) = solved
        .iter()
        .filter(|s| s.row.key.scan == scan)
        .map(|s| SolvedRow {
            family: s.family.clone(),
            ..*s
        })
        .partition(|s| s.family.model.is_limit());
    let widest = found.iter().map(|s| s.row.key.lp_mm).fold(0.0, f64::max);
    let mut curves_ = curves(&found, Mark::Joined, |members| {
        let mut points: Vec<Point> = members.iter().map(|s| with_error(s)).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        points
    });
    curves_.extend(curves(&levels, Mark::Rule, |members| {
        let level = members[0].e_app_mpa;
        vec![Point::new(0.0, level), Point::new(widest, level)]
    }));
    Figure {
        stem: format!("convergence-{}", file_name(scan)),
        scan: Some(scan.to_owned()),
        title: format!("Convergence of {scan}"),
        caption: "Apparent modulus against lattice parameter (element size for voxel FE). Bars: stated error.".to_owned(),
        x: Axis::linear("lattice parameter (mm)"),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves_),
    }
}

/// The stated algebraic and discretisation errors together, where there are any.
fn with_error(s: &SolvedRow) -> Point {
    let errors = s.row.stated_errors_mpa();
    let stated = errors.iter().flatten().count() > 0;
    let error: f64 = errors.iter().flatten().map(|e| e.abs()).sum();
    Point {
        x: s.row.key.lp_mm,
        y: s.e_app_mpa,
        y_error: stated.then_some([error, error]),
    }
}

/// E_app of each scan's finest solve against its BV/TV, with the least-squares line of each method over three scans or
/// more. None for fewer than two scans.
pub fn against_bv_tv(rows: &[Row]) -> Option<Figure> {
    let mut solved = solved(rows);
    solved.retain(|s| s.row.converged() != Some(false));
    if distinct(solved.iter().map(|s| &s.row.key.scan)).len() < 2 {
        return None;
    }
    let mut curves = curves(&solved, Mark::Points, |members| {
        finest(members)
            .iter()
            .map(|s| Point::new(s.row.key.bv_tv, s.e_app_mpa))
            .collect()
    });
    let lines: Vec<Curve> = curves.iter().filter_map(least_squares).collect();
    curves.extend(lines);
    Some(Figure {
        stem: "bv-tv".to_owned(),
        scan: None,
        title: "Stiffness and bone volume fraction".to_owned(),
        caption: "Apparent modulus of each scan at its finest lattice parameter against BV/TV, with least-squares lines."
            .to_owned(),
        x: Axis::linear("BV/TV"),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves),
    })
}

/// A line without a name: its colour says whose it is.
fn least_squares(curve: &Curve) -> Option<Curve> {
    let (x, y): (Vec<f64>, Vec<f64>) = curve.points.iter().map(|p| (p.x, p.y)).unzip();
    let fit = regression(&x, &y)?;
    let [low, high] = [f64::min, f64::max].map(|f| x.iter().copied().reduce(f).unwrap_or(0.0));
    let at = |x: f64| Point::new(x, fit.intercept + fit.slope * x);
    Some(Curve {
        name: String::new(),
        mark: Mark::Rule,
        points: vec![at(low), at(high)],
        ..curve.clone()
    })
}

/// Of each scan the member with the smallest lattice parameter.
fn finest<'a, 'b>(members: &[&'b SolvedRow<'a>]) -> Vec<&'b SolvedRow<'a>> {
    let scans = distinct(members.iter().map(|s| &s.row.key.scan));
    let of = |scan| {
        let own = members.iter().filter(|s| &s.row.key.scan == scan);
        own.min_by(|a, b| a.row.key.lp_mm.total_cmp(&b.row.key.lp_mm))
            .copied()
    };
    scans.into_iter().filter_map(of).collect()
}

/// Wall time against lattice parameter: the median over scans, bars from the fastest to the slowest.
pub fn wall_time(rows: &[Row]) -> Option<Figure> {
    let mut solved = solved(rows);
    solved.retain(|s| {
        s.row.solved.as_ref().is_some_and(|r| r.sites != Some(0))
            && s.family.model != Model::Ffb
            && s.row.wall_s().is_some_and(|t| t > 0.0)
    });
    let curves = curves(&solved, Mark::Joined, |members| {
        let mut sizes = distinct(members.iter().map(|s| s.row.key.lp_mm));
        sizes.sort_by(f64::total_cmp);
        let at = |lp: f64| {
            let same = members.iter().filter(|s| s.row.key.lp_mm == lp);
            median_with_range(lp, same.filter_map(|s| s.row.wall_s()).collect())
        };
        sizes.into_iter().map(at).collect()
    });
    (!curves.is_empty()).then(|| Figure {
        stem: "wall-time".to_owned(),
        scan: None,
        title: "Time of a solve".to_owned(),
        caption: "Wall time of one solve against lattice parameter (element size for voxel FE): median over scans; \
                  bars reach from the fastest to the slowest."
            .to_owned(),
        x: Axis::linear("lattice parameter (mm)"),
        y: Axis::log("wall time (s)"),
        content: Content::Curves(curves),
    })
}

fn median_with_range(x: f64, mut values: Vec<f64>) -> Point {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let median = 0.5 * (values[(n - 1) / 2] + values[n / 2]);
    Point {
        x,
        y: median,
        y_error: (n > 1).then(|| [median - values[0], values[n - 1] - median]),
    }
}

/// Error against wall time, for scans with a reference: the extrapolated voxel-FE modulus, else the finest voxel FE.
pub fn speed_error(rows: &[Row]) -> Option<Figure> {
    let all = solved(rows);
    let references: Vec<(&String, &Option<String>, f64)> =
        distinct(all.iter().map(|s| (&s.row.key.scan, &s.family.condition)))
            .into_iter()
            .filter_map(|(scan, condition)| {
                let own: Vec<&SolvedRow> = all
                    .iter()
                    .filter(|s| &s.row.key.scan == scan && &s.family.condition == condition)
                    .collect();
                Some((scan, condition, reference(&own)?))
            })
            .collect();
    let error_of = |s: &SolvedRow| {
        let (_, _, truth) = references.iter().find(|(scan, condition, _)| {
            *scan == &s.row.key.scan && *condition == &s.family.condition
        })?;
        let percent = 100.0 * (s.e_app_mpa / truth - 1.0).abs();
        let time = s.row.wall_s().filter(|t| *t > 0.0)?;
        (percent > 0.0).then(|| Point::new(time, percent))
    };
    let curves = curves(&all, Mark::Points, |members| {
        members.iter().filter_map(|s| error_of(s)).collect()
    });
    (!curves.is_empty()).then(|| Figure {
        stem: "speed-error".to_owned(),
        scan: None,
        title: "Speed and error".to_owned(),
        caption: "Deviation from the reference against wall time, one point per solve. Reference: the extrapolated \
                  voxel-FE modulus of the scan, or its finest voxel FE."
            .to_owned(),
        x: Axis::log("wall time (s)"),
        y: Axis::log("deviation from reference (%)"),
        content: Content::Curves(curves),
    })
}

fn reference(own: &[&SolvedRow]) -> Option<f64> {
    let extrapolated = own.iter().find(|s| s.family.model == Model::VoxelFeLimit);
    let finest = own
        .iter()
        .filter(|s| s.family.model == Model::VoxelFe)
        .min_by(|a, b| a.row.key.lp_mm.total_cmp(&b.row.key.lp_mm));
    extrapolated
        .or(finest)
        .map(|s| s.e_app_mpa)
        .filter(|e| *e > 0.0)
}

/// A name that is safe in any file system.
fn file_name(scan: &str) -> String {
    scan.chars()
        .map(|c| {
            if c.is_alphanumeric() || "-_.".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect()
}
