//! Owns what several resolutions of one specimen say together: the modulus in the limit and how far off it may be.
//!
//! The limit is that of the body that the voxels make, the voxel staircase. Bone is smooth: the limit answers for the
//! staircase only and states no error of the bone's modulus.
//!
//! Both models converge as lattice parameter or element size shrink, at different orders. The error of a connected
//! lattice in bending, smeared over a cell, falls with the square of LP, plus scatter from the position of the cells. That of voxel
//! FE falls with the power 1.3 (edges of voxels; 1.17 to 1.31 fitted on phantoms, `reports/speed-vs-error.md`), from above.

use crate::result::row::{Marks, Row, Solution};
use crate::result::settings::{BoundaryRule, Elements, Load, Method, Settings};
use crate::result::shape;

/// Order in LP of the error of connected and weighted lattices.
const LATTICE_ORDER: f64 = 2.0;

/// Order in element size of voxel FE's error: 1.17 to 1.31 fitted on phantoms over one, two and three elements a voxel.
const VOXEL_ORDER: f64 = 1.3;

/// Part of the step from the finest elements to the limit that is left open: the staircase's limit of all phantoms is within it.
const STEP_LEFT: f64 = 0.75;

/// What the voxels leave open on a lattice, `VOXELS_UNSEEN · voxel / strut thickness` of E_app: that load flows around
/// steps of voxels is a rule of thumb there (`discretisation::lattice::connected`), half of whose effect may be missing.
const VOXELS_UNSEEN: f64 = 0.25;

/// What too few struts to average over leave open, `FEW_STRUTS · strut thickness / edge of the volume`: how a lattice
/// misjudges one strut is chance, and a specimen twenty struts wide had half the error of one ten wide.
const FEW_STRUTS: f64 = 0.9;

/// The rows with one extrapolated row after the last of each series of connected or weighted lattices or voxel-FE solves that differ in
/// resolution only. Extrapolated rows already there are replaced.
pub fn with_extrapolated(rows: &[Row]) -> Vec<Row> {
    let mut all: Vec<Row> = Vec::new();
    let solved: Vec<&Row> = rows.iter().filter(|r| !is_extrapolated(r)).collect();
    for (at, row) in solved.iter().enumerate() {
        all.push((*row).clone());
        let last = !solved[at + 1..].iter().any(|other| same_series(row, other));
        if last && in_series(row) {
            let series: Vec<&Row> = solved
                .iter()
                .copied()
                .filter(|r| same_series(row, r))
                .collect();
            all.extend(limit(&series));
        }
    }
    all
}

/// Whether a row is a limit of several resolutions.
pub fn is_extrapolated(row: &Row) -> bool {
    row.key.boundary == Some(BoundaryRule::Extrapolated)
}

fn is_voxel_fe(row: &Row) -> bool {
    row.key.method == Method::VoxelFe
}

/// Voxel FE under one load of the mask's own voxels, whole or split: elements of other kinds are of other bodies.
fn is_staircase(row: &Row) -> bool {
    let of_voxels = matches!(
        row.key.elements,
        Some(Elements::Voxels | Elements::SplitVoxels)
    );
    is_voxel_fe(row) && of_voxels && row.key.load != Load::Stiffness
}

fn in_series(row: &Row) -> bool {
    let graded = row.key.boundary == Some(BoundaryRule::Graded);
    // Of tissue that yields the strength is the answer, which has no limit here.
    row.key.plasticity.is_none()
        && (graded || is_staircase(row))
        && row.converged() == Some(true)
        && row.e_app_mpa().is_some_and(|e| e > 0.0)
}

fn same_series(a: &Row, b: &Row) -> bool {
    in_series(a) && in_series(b) && a.key.without_resolution() == b.key.without_resolution()
}

/// Size, mean modulus over registrations, and half their range.
struct Level {
    size: f64,
    e_mpa: f64,
    scatter_mpa: f64,
}

fn levels(series: &[&Row]) -> Vec<Level> {
    let mut sizes: Vec<f64> = series.iter().map(|r| r.key.lp_mm).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup();
    let level = |size: f64| {
        let same = series.iter().filter(|r| r.key.lp_mm == size);
        let e: Vec<f64> = same.filter_map(|r| r.e_app_mpa()).collect();
        let (low, high) = e
            .iter()
            .fold((f64::INFINITY, 0f64), |(l, h), &v| (l.min(v), h.max(v)));
        Level {
            size,
            e_mpa: e.iter().sum::<f64>() / e.len() as f64,
            scatter_mpa: 0.5 * (high - low),
        }
    };
    sizes.into_iter().map(level).collect()
}

fn limit(series: &[&Row]) -> Option<Row> {
    let levels = levels(series);
    let finest = series
        .iter()
        .min_by(|a, b| a.key.lp_mm.total_cmp(&b.key.lp_mm))?;
    let (e_mpa, error_mpa, words) = if is_voxel_fe(finest) {
        voxel_limit(&levels)?
    } else {
        lattice_limit(&levels, finest)?
    };
    let algebraic = series
        .iter()
        .filter_map(|r| r.stated_errors_mpa()[0])
        .fold(0.0, f64::max);
    let finest_ones = series.iter().filter(|r| r.key.lp_mm == finest.key.lp_mm);
    let note = finest_ones
        .filter_map(|r| r.marks.note.as_ref())
        .fold(words, |all, note| match all.contains(note) {
            true => all,
            false => format!("{all}; {note}"),
        });
    Some(Row {
        key: Settings {
            boundary: Some(BoundaryRule::Extrapolated),
            registration_mm: None,
            ..finest.key.clone()
        },
        solved: Some(Solution {
            e_app_mpa: Some(e_mpa),
            algebraic_error_mpa: Some(algebraic),
            discretization_error_mpa: Some(error_mpa),
            // The voxel staircase is another body than the bone: what lies between them is not stated.
            shape_error_mpa: match is_voxel_fe(finest) {
                true => None,
                false => shape::of_lattice(finest).map(|s| s * e_mpa),
            },
            wall_s: series.iter().map(|r| r.wall_s()).sum(),
            ..Solution::default()
        }),
        marks: Marks {
            note: Some(note),
            ..finest.marks.clone()
        },
    })
}

/// From the two finest sizes; [`STEP_LEFT`] of the step from the finest to the limit is left open.
fn voxel_limit(levels: &[Level]) -> Option<(f64, f64, String)> {
    let [fine, coarse, ..] = levels else {
        return None;
    };
    let ratio = (coarse.size / fine.size).powf(VOXEL_ORDER);
    let step = (coarse.e_mpa - fine.e_mpa) / (ratio - 1.0);
    let e = fine.e_mpa - step;
    let words = format!(
        "limit of the voxel staircase, not of the bone, from elements of {:.4} and {:.4} mm, order {VOXEL_ORDER}; uncertain by {STEP_LEFT} of the step of {:.3} MPa from the finest",
        coarse.size,
        fine.size,
        step.abs(),
    );
    (e > 0.0).then_some((e, STEP_LEFT * step.abs(), words))
}

/// By least squares of `E + c LP²` with weights LP⁻⁴, from three lattice parameters on. The stated error joins the step
/// from the finest lattice, the scatter about the fit or over registrations, and what the voxels leave open.
fn lattice_limit(levels: &[Level], finest: &Row) -> Option<(f64, f64, String)> {
    if levels.len() < 3 {
        return None;
    }
    let points: Vec<[f64; 3]> = levels
        .iter()
        .map(|l| [l.size.powf(LATTICE_ORDER), l.e_mpa, l.size.powi(-4)])
        .collect();
    let weight: f64 = points.iter().map(|p| p[2]).sum();
    let mean = |c: usize| points.iter().map(|p| p[2] * p[c]).sum::<f64>() / weight;
    let (x, y) = (mean(0), mean(1));
    let slope = points
        .iter()
        .map(|p| p[2] * (p[0] - x) * (p[1] - y))
        .sum::<f64>()
        / points
            .iter()
            .map(|p| p[2] * (p[0] - x).powi(2))
            .sum::<f64>();
    let e = y - slope * x;
    if e <= 0.0 {
        return None;
    }
    let off: f64 = points
        .iter()
        .map(|p| p[2] * (p[1] - e - slope * p[0]).powi(2))
        .sum();
    let scatter = (off / weight).sqrt().max(levels[0].scatter_mpa);
    let step = (levels[0].e_mpa - e).abs();
    let thickness = finest.marks.mean_thickness_mm?;
    let voxels = VOXELS_UNSEEN * e * mean_edge(finest.key.voxel_mm) / thickness;
    let struts = FEW_STRUTS * e * thickness / finest.key.tv_mm3.cbrt();
    let sizes: Vec<String> = levels.iter().rev().map(|l| l.size.to_string()).collect();
    let words = format!(
        "limit of {} lattices at LP {} mm, order 2 in LP ({}); parts of the error in MPa: step from the finest {step:.3}, scatter {scatter:.3}, voxels {voxels:.3}, few struts {struts:.3}",
        BoundaryRule::Graded.method_name(finest.key.structure),
        sizes.join(", "),
        fitted_order(levels).map_or(
            "assumed: the values give no order of their own".into(),
            |p| format!("fitted {p:.1}")
        ),
    );
    Some((
        e,
        [step, scatter, voxels, struts]
            .map(|v| v * v)
            .iter()
            .sum::<f64>()
            .sqrt(),
        words,
    ))
}

/// Order `p` of `E + c h^p` through the three finest levels, where their steps fall as some power does.
pub fn order_of(sizes: [f64; 3], e: [f64; 3]) -> Option<f64> {
    let [a, b, c] = sizes;
    let wanted = (e[2] - e[1]) / (e[1] - e[0]);
    let ratio = |p: f64| (c.powf(p) - b.powf(p)) / (b.powf(p) - a.powf(p));
    let (mut low, mut high) = (0.05, 8.0);
    if !(wanted > ratio(low) && wanted < ratio(high)) {
        return None;
    }
    for _ in 0..60 {
        let p = 0.5 * (low + high);
        if ratio(p) < wanted { low = p } else { high = p }
    }
    Some(low)
}

fn fitted_order(levels: &[Level]) -> Option<f64> {
    let three = [0, 1, 2].map(|i| &levels[i]);
    order_of(three.map(|l| l.size), three.map(|l| l.e_mpa))
}

fn mean_edge([x, y, z]: [f64; 3]) -> f64 {
    if x == y && y == z {
        x
    } else {
        (x * y * z).powf(1.0 / 3.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(boundary: Option<BoundaryRule>, size: f64, e: f64) -> Row {
        let method = match boundary {
            Some(_) => Method::Lattice,
            None => Method::VoxelFe,
        };
        Row {
            key: Settings {
                method,
                boundary,
                elements: (method == Method::VoxelFe).then_some(Elements::Voxels),
                lp_mm: size,
                voxel_mm: [0.02; 3],
                tv_mm3: 64.0,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(e),
                converged: Some(true),
                wall_s: Some(1.0),
                ..Solution::default()
            }),
            marks: Marks {
                mean_thickness_mm: Some(0.16),
                ..Marks::default()
            },
        }
    }

    const GRADED: Option<BoundaryRule> = Some(BoundaryRule::Graded);

    fn error(row: &Row) -> f64 {
        row.solved
            .as_ref()
            .unwrap()
            .discretization_error_mpa
            .unwrap()
    }

    fn note(row: &Row) -> &str {
        row.marks.note.as_deref().unwrap()
    }

    /// Squared, of 70 MPa: struts of eight voxels, a volume of 25 struts.
    fn left_open() -> f64 {
        (0.25f64 * 70.0 / 8.0).powi(2) + (0.9f64 * 70.0 / 25.0).powi(2)
    }

    #[test]
    fn a_lattice_of_order_two_is_taken_to_its_limit() {
        let rows: Vec<Row> = [0.12, 0.1, 0.08]
            .map(|lp| row(GRADED, lp, 70.0 + 500.0 * lp * lp))
            .to_vec();
        let all = with_extrapolated(&rows);
        assert_eq!(all.len(), 4);
        let e = &all[3];
        assert!((e.e_app_mpa().unwrap() - 70.0).abs() < 1e-9, "{e:?}");
        let stated = (3.2f64.powi(2) + left_open()).sqrt();
        assert!((error(e) - stated).abs() < 1e-9);
        assert_eq!(e.wall_s(), Some(3.0));
        assert!(note(e).contains("fitted 2.0"), "{e:?}");
        assert_eq!(with_extrapolated(&all), all);
    }

    #[test]
    fn two_lattices_are_no_series() {
        let rows = [row(GRADED, 0.1, 3.0), row(GRADED, 0.05, 2.0)];
        assert_eq!(with_extrapolated(&rows), rows);
        assert_eq!(
            with_extrapolated(&[row(Some(BoundaryRule::Firm), 0.1, 3.0)]).len(),
            1
        );
    }

    #[test]
    fn voxel_elements_of_order_1_3_are_taken_to_their_limit() {
        let e = |h: f64| 50.0 + 300.0 * h.powf(1.3);
        let mut fine = row(None, 0.01, e(0.01));
        fine.marks.note = Some("of the finest".to_owned());
        let all = with_extrapolated(&[row(None, 0.02, e(0.02)), fine]);
        assert!(note(&all[2]).ends_with("; of the finest"));
        assert_eq!(all[2].key.method, Method::VoxelFe);
        assert!(
            (all[2].e_app_mpa().unwrap() - 50.0).abs() < 1e-9,
            "{:?}",
            all[2]
        );
        let open = 0.75 * (e(0.01) - 50.0);
        assert!((error(&all[2]) - open).abs() < 1e-9);
    }

    #[test]
    fn registrations_are_averaged_and_their_scatter_is_stated() {
        let mut rows = Vec::new();
        for lp in [0.12, 0.1, 0.08] {
            for (shift, registration) in [(-1.0, [0.0; 3]), (1.0, [0.02, 0.0, 0.0])] {
                let mut one = row(GRADED, lp, 70.0 + shift);
                one.key.registration_mm = Some(registration);
                rows.push(one);
            }
        }
        let all = with_extrapolated(&rows);
        let e = all.last().unwrap();
        assert!((e.e_app_mpa().unwrap() - 70.0).abs() < 1e-9);
        assert!((error(e) - (1.0 + left_open()).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn an_order_is_fitted_only_where_there_is_one() {
        let e = [0.1f64, 0.2, 0.4].map(|h| 1.0 + h.powf(1.7));
        assert!((order_of([0.1, 0.2, 0.4], e).unwrap() - 1.7).abs() < 1e-9);
        assert_eq!(order_of([0.1, 0.2, 0.4], [1.0, 2.0, 1.5]), None);
    }
}
