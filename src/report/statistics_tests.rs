//! The statistics of small cohorts of made moduli.

use super::*;
use crate::report::sample::samples;
use crate::result::row::{Marks, Row, Solution};
use crate::result::settings::{BoundaryRule, CellType, Method, Settings};

pub(in super::super) mod cases {
    use super::*;

    fn row(scan: usize, boundary: BoundaryRule, lp_mm: f64) -> Row {
        let stiff = if boundary == BoundaryRule::Firm {
            2.0
        } else {
            1.0
        };
        Row {
            key: Settings {
                scan: format!("s{scan}"),
                boundary: Some(boundary),
                lp_mm,
                bv_tv: 0.1 * scan as f64,
                ..Settings::default()
            },
            solved: Some(Solution {
                e_app_mpa: Some(stiff * (10.0 * scan as f64 + lp_mm)),
                ..Solution::default()
            }),
            marks: Marks {
                group: Some(if scan < 3 { "a" } else { "b" }.to_owned()),
                ..Marks::default()
            },
        }
    }

    /// Scans s1, s2, … by floppy, firm and FFB, each at two lattice parameters.
    pub fn cohort(n: usize) -> Vec<Row> {
        let scans = (1..=n).flat_map(|scan| {
            [BoundaryRule::Floppy, BoundaryRule::Firm, BoundaryRule::Ffb]
                .into_iter()
                .flat_map(move |b| [row(scan, b, 0.2), row(scan, b, 0.1)])
        });
        scans.collect()
    }

    pub fn scans_of(sample: &Sample) -> Vec<&str> {
        sample.cases.iter().map(|case| case.scan.as_str()).collect()
    }

    /// `rows` with the limit of a method for each scan, of this relative stated error.
    pub fn with_limit(mut rows: Vec<Row>, method: Method, error: f64) -> Vec<Row> {
        let structure = match method {
            Method::Lattice => CellType::default(),
            Method::GeometryFe => CellType::Tet10,
            _ => CellType::Hex8,
        };
        for scan in distinct(rows.iter().map(|row| row.key.scan.clone())) {
            let first = rows
                .iter()
                .find(|row| row.key.scan == scan)
                .unwrap()
                .clone();
            let e = 1.3 * first.e_app_mpa().unwrap() + 1e3 * first.key.bv_tv * first.key.bv_tv;
            rows.push(Row {
                key: Settings {
                    method,
                    structure,
                    boundary: Some(BoundaryRule::Extrapolated),
                    ..first.key
                },
                solved: Some(Solution {
                    e_app_mpa: Some(e),
                    discretization_error_mpa: Some(error * e),
                    shape_error_mpa: Some(0.0),
                    ..Solution::default()
                }),
                ..first
            });
        }
        rows
    }
}

use cases::{cohort, scans_of, with_limit};

fn of(rows: &[Row]) -> Statistics {
    statistics(&samples(rows).0)
}

fn pairs(found: &Statistics) -> Vec<(&str, &str)> {
    let lines = found.agreements.iter();
    lines
        .map(|a| (a.method.as_str(), a.reference.as_str()))
        .collect()
}

#[test]
fn no_samples_have_no_statistics() {
    assert_eq!(statistics(&[]), Statistics::default());
}

#[test]
fn a_mean_is_not_held_against_its_own_parts() {
    let found = of(&cohort(4));
    assert_eq!(pairs(&found), []);
    let on = |x: &str| found.regressions.iter().filter(|r| r.x == x).count();
    assert_eq!((on("BV/TV"), found.regressions.len()), (3, 3));
}

#[test]
fn bone_volumes_of_models_are_held_against_the_mask() {
    let mut rows = cohort(4);
    for row in &mut rows {
        // A mean has no model of its own.
        let firm = row.key.boundary == Some(BoundaryRule::Firm);
        row.solved.as_mut().unwrap().model_bv_tv = firm.then_some(1.5 * row.key.bv_tv + 0.01);
    }
    let found = of(&rows);
    let lines = found.regressions.iter();
    let lines: Vec<&RegressionLine> = lines.filter(|r| r.y.starts_with("BV/TV of")).collect();
    assert_eq!(lines.len(), 1);
    assert_eq!(lines[0].y, "BV/TV of the model, firm");
    let fit = lines[0].fit;
    assert!((fit.slope - 1.5).abs() < 1e-12 && (fit.intercept - 0.01).abs() < 1e-12);
    let boxes = found.boxes.iter();
    let off: Vec<&BoxLine> = boxes
        .filter(|b| b.quantity.starts_with("BV of the model"))
        .collect();
    assert_eq!((off.len(), off[0].method.as_str()), (1, "firm"));
    // At BV/TV 0.1 to 0.4: 60, 55, 53.33, 52.5 %.
    assert!((off[0].found.median - (55.0 + 160.0 / 3.0) / 2.0).abs() < 1e-9);
    let figures = crate::report::comparison::figures(&samples(&rows).0);
    assert!(figures.iter().any(|f| f.stem == "bone-volume"));
}

#[test]
fn all_are_held_against_an_independent_reference() {
    let found = of(&with_limit(cohort(4), Method::VoxelFe, 0.01));
    let fe = "voxel FE, extrapolated";
    assert_eq!(
        pairs(&found),
        [("floppy", fe), ("firm", fe), ("FFB mean", fe)]
    );
    // Each of four methods on BV/TV; three on the reference, as they are and over BV/TV, and their differences on BV/TV.
    assert_eq!(found.regressions.len(), 4 + 3 * 3);
    assert!(found.agreements.iter().all(|a| a.found.n == 4));
    let percent = format!("difference from {fe} (%)");
    let line = found
        .regressions
        .iter()
        .find(|r| r.y == format!("floppy: {percent}"))
        .unwrap();
    assert_eq!((line.x.as_str(), line.fit.n), ("BV/TV", 4));
    // Of s1: floppy 10.1, and the limit 1.3 times its coarser 10.2 with 10 more for its bone.
    let all = against_reference(&samples(&with_limit(cohort(4), Method::VoxelFe, 0.01)).0)
        .into_iter()
        .next()
        .map(|c| c.differences_percent()[0]);
    assert_eq!(
        all,
        Some(100.0 * (10.1 / (1.3 * 10.2 + 1e3 * 0.1 * 0.1) - 1.0))
    );
    let boxes = found.boxes.iter().filter(|b| b.quantity == percent);
    assert_eq!(boxes.count(), 3);
}

#[test]
fn two_limits_are_two_methods_and_the_one_of_less_error_is_the_reference() {
    let (graded, fe) = ("connected, extrapolated", "voxel FE, extrapolated");
    for (of_graded, of_fe, expected) in [(0.05, 0.02, fe), (0.02, 0.05, graded), (0.02, 0.02, fe)] {
        let rows = with_limit(cohort(4), Method::Lattice, of_graded);
        let rows = with_limit(rows, Method::VoxelFe, of_fe);
        let (samples, _) = samples(&rows);
        let found = reference(&samples).unwrap();
        assert_eq!((found.method.as_str(), samples.len()), (expected, 5));
    }
}

#[test]
fn a_reference_of_a_few_scans_does_not_decide_for_all() {
    let few = with_limit(cohort(3), Method::VoxelFe, 0.01);
    let mut rows = cohort(8);
    rows.extend(
        few.into_iter()
            .filter(|row| row.key.method == Method::VoxelFe),
    );
    let (samples, notes) = samples(&rows);
    assert_eq!(reference(&samples).unwrap().method, "FFB mean");
    let found = statistics(&samples);
    assert_eq!(pairs(&found), [("voxel FE, extrapolated", "FFB mean")]);
    assert_eq!(found.agreements[0].found.n, 3);
    assert_eq!(found.anova.unwrap().specimens, 8);
    assert_eq!(scans_of(&samples[3]), ["s1", "s2", "s3"]);
    assert!(
        notes[0].contains("s8 (no converged voxel FE, extrapolated)"),
        "{notes:?}"
    );
}

/// Floppy E, firm 2 E, and a mean that follows from them: two methods, not three.
#[test]
fn a_mean_beside_its_parts_is_no_level_of_an_analysis_of_variance() {
    let mut rows = cohort(4);
    let found = of(&rows);
    let (anova, floppy) = (found.anova.unwrap(), [10.1, 20.1, 30.1, 40.1]);
    assert_eq!(found.anova_between, ["floppy", "firm"]);
    assert_eq!((anova.methods, anova.specimens), (2, 4));
    // Of two levels p is the paired t test's.
    let firm = floppy.map(|e| 2.0 * e);
    let t = agreement(&firm, &floppy).unwrap();
    assert!(
        (anova.p / t.bias_p.unwrap() - 1.0).abs() < 1e-9,
        "{anova:?} {t:?}"
    );
    let said = found.analysis_of_variance().unwrap();
    assert!(said.contains("floppy; firm over 4 scans"), "{said}");
    // With one part only it is a level of its own.
    rows.retain(|row| row.key.boundary != Some(BoundaryRule::Firm));
    assert_eq!(of(&rows).anova_between, ["floppy", "FFB mean"]);
}
