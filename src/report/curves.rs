//! Owns the report's figures over lattice parameter, bone volume fraction and time.

pub mod strength;

use super::figure::{Axis, Content, Curve, Figure, Mark, Point};
use super::table::{condition, varying_settings};
use super::{Model, distinct};
use crate::result::condition::Condition;
use crate::result::row::Row;
use crate::result::settings::CellType;
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
            .filter(|s| s.is_lattice()),
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
                    family.model.name_on(family.structure)
                )
            }
            _ => family.model.name_on(family.structure),
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

/// E_app against lattice parameter, a figure per scan that carries load. Extrapolated values are level lines.
pub fn convergence(rows: &[Row]) -> Vec<Figure> {
    let solved = solved(rows);
    let sizes = |scan: &str| {
        let own = solved.iter().filter(|s| s.row.key.scan == scan);
        distinct(own.map(|s| s.row.key.lp_mm.to_bits())).len()
    };
    let carries_load = |scan: &str| {
        let own = |s: &&SolvedRow| s.row.key.scan == scan;
        solved.iter().filter(own).any(|s| s.e_app_mpa > 0.0)
    };
    distinct(solved.iter().map(|s| &s.row.key.scan))
        .into_iter()
        .filter(|scan| sizes(scan) > 1 && carries_load(scan))
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
    let limits = match levels.is_empty() {
        true => "",
        false => "; horizontal lines: limits",
    };
    Figure {
        stem: format!("convergence-{}", file_name(scan)),
        scan: Some(scan.to_owned()),
        title: format!("Convergence of {scan}"),
        caption: format!(
            "Apparent modulus against lattice parameter (element size for voxel FE). Bars: stated error, cut off at 0{limits}.{}",
            tissue(&found)
        ),
        x: Axis::linear("lattice parameter or element (mm)"),
        y: Axis::linear("apparent modulus (MPa)"),
        content: Content::Curves(curves_),
        ..Figure::default()
    }
}

/// The tissue in a sentence, where all rows have one.
fn tissue(found: &[SolvedRow]) -> String {
    let all = distinct(
        found
            .iter()
            .map(|s| Condition::of(&s.row.key).tissue_in_words()),
    );
    match &all[..] {
        [one] => format!(" {one}"),
        _ => String::new(),
    }
}

/// With all that is stated of its error, where the resolution's is.
fn with_error(s: &SolvedRow) -> Point {
    Point::modulus(s.row.key.lp_mm, s.e_app_mpa, s.row.error_mpa())
}

/// Wall time of each solve against its size; None for fewer than three solves.
pub fn wall_time(rows: &[Row]) -> Option<Figure> {
    let solved = solved(rows);
    let place = |s: &SolvedRow| {
        let own = s.row.solved.as_ref().filter(|_| !s.row.key.is_derived())?;
        let unknowns = own.unknowns.filter(|n| *n > 0)?;
        Some(Point::new(
            unknowns as f64,
            own.wall_s.filter(|t| *t > 0.0)?,
        ))
    };
    let curves = curves(&solved, Mark::Points, |members| {
        members.iter().filter_map(|s| place(s)).collect()
    });
    let points: usize = curves.iter().map(|c| c.points.len()).sum();
    (points > 2).then(|| Figure {
        stem: "wall-time".to_owned(),
        folded: true,
        title: "Time of a solve".to_owned(),
        caption: "Wall time of each solve against its degrees of freedom.".to_owned(),
        x: Axis::log("degrees of freedom"),
        y: Axis::log("wall time (s)"),
        content: Content::Curves(curves),
        ..Figure::default()
    })
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
        folded: true,
        title: "Speed and error".to_owned(),
        caption: "Deviation from the reference against wall time, one point per solve. Reference: the extrapolated \
                  voxel-FE modulus of the scan, or its finest voxel FE."
            .to_owned(),
        x: Axis::log("wall time (s)"),
        y: Axis::log("deviation from reference (%)"),
        content: Content::Curves(curves),
        ..Figure::default()
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
pub(crate) fn file_name(scan: &str) -> String {
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
