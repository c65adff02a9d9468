//! The apparent stiffness matrix: closed forms, symmetries, what its stated error is worth, and its file.

use crate::cli::run;
use crate::specimens::specimen;
use bonepd_ct::error::Result;
use bonepd_ct::grid::Axis;
use bonepd_ct::measure::stiffness::{Six, compliance, orthotropic, seen_from};
use bonepd_ct::pipeline::apparent::job::JobResult;
use bonepd_ct::pipeline::apparent::of_voxels;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::apparent::stiffness::Stiffness;
use bonepd_ct::pipeline::apparent::{Conditions, Load, SolveParams};
use bonepd_ct::record::stiffness as file;
use bonepd_ct::volume::Specimen;

const BOTH: [Conditions; 2] = [Conditions::Kinematic, Conditions::Mixed];

/// Struts of unlike thickness along the axes, one of them slanted, and a plate: all 21 entries differ from zero.
fn irregular(p: [usize; 3]) -> bool {
    let strut = |a: usize, b: usize, at: [usize; 2], t: usize| {
        p[a].abs_diff(at[0]) < t && p[b].abs_diff(at[1]) < t
    };
    strut(0, 1, [5 + p[2] / 4, 6], 2)
        || strut(1, 2, [6 + p[0] / 3, 9], 3)
        || strut(0, 2, [10, 4 + p[1] / 2], 2)
        || p[2].abs_diff(6 + p[1] / 5) < 1
}

fn settings(conditions: Conditions, tolerance: f64) -> SolveParams {
    SolveParams {
        load: Load::Stiffness,
        conditions,
        tolerance,
        ..SolveParams::default()
    }
}

fn stiffness(specimen: &Specimen, params: &SolveParams) -> Result<Stiffness> {
    match of_voxels().solve_specimen(specimen, params, &mut |_, _| ())? {
        JobResult::Stiffness(solved) => Ok(solved),
        JobResult::Modulus(..) => panic!("six unit strains came to one modulus"),
    }
}

fn solve(specimen: &Specimen, params: &SolveParams) -> Stiffness {
    let solved = stiffness(specimen, params).unwrap();
    assert!(solved.ended.converged(), "{:?}", solved.ended);
    solved
}

fn largest(c: &Six) -> f64 {
    c.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn assert_equal(found: &Six, expected: &Six, tolerance: f64, what: &str) {
    let scale = largest(expected);
    for i in 0..6 {
        for j in 0..6 {
            let off = (found[i][j] - expected[i][j]).abs() / scale;
            assert!(
                off < tolerance,
                "{what} {i}{j}: {} for {}",
                found[i][j],
                expected[i][j]
            );
        }
    }
}

#[test]
fn a_solid_block_has_the_stiffness_of_its_tissue() {
    let (e, nu) = (1000.0, 0.3);
    let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let mu = e / (2.0 * (1.0 + nu));
    let expected: Six = std::array::from_fn(|i| {
        std::array::from_fn(|j| match (i, j) {
            _ if i == j && i < 3 => lambda + 2.0 * mu,
            _ if i < 3 && j < 3 => lambda,
            _ if i == j => mu,
            _ => 0.0,
        })
    });
    let block = specimen([5, 6, 7], [0.02, 0.03, 0.01], |_| true);
    for conditions in BOTH {
        let solved = solve(&block, &settings(conditions, 1e-9));
        assert_equal(&solved.matrix_mpa, &expected, 1e-10, conditions.name());
        let o = orthotropic(&solved.matrix_mpa).unwrap();
        assert!(o.residual < 1e-6 && (o.degree_of_anisotropy - 1.0).abs() < 1e-9);
        assert_eq!(o.axes, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert!((o.young_mpa[0] / e - 1.0).abs() < 1e-9 && (o.poisson[1] / nu - 1.0).abs() < 1e-9);
    }
}

/// Layers across z of full and half modulus: Backus' averages (1962), which the mixed conditions meet exactly, since
/// the laminate's fields are piecewise linear and slide along the faces.
#[test]
fn a_laminate_has_backus_stiffness() {
    let nu = 0.3;
    let layers = specimen([8, 12, 16], [0.02, 0.03, 0.02], |p| {
        p[2] % 4 < 2 || p[0] % 2 == 0
    });
    let params = SolveParams {
        coarsen: 2,
        poisson: nu,
        ..settings(Conditions::Mixed, 1e-8)
    };
    let found = solve(&layers, &params).matrix_mpa;
    let of = |e: f64| {
        let lambda = e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let mu = e / (2.0 * (1.0 + nu));
        (lambda, mu, lambda + 2.0 * mu)
    };
    let mean = |f: fn((f64, f64, f64)) -> f64| 0.5 * (f(of(1000.0)) + f(of(500.0)));
    let series = 1.0 / mean(|(_, _, m)| 1.0 / m);
    let share = mean(|(l, _, m)| l / m);
    let mut c = [[0.0; 6]; 6];
    c[2][2] = series;
    for a in 0..2 {
        c[a][a] = mean(|(l, _, m)| m - l * l / m) + share * share * series;
        c[a][1 - a] = mean(|(l, _, m)| l - l * l / m) + share * share * series;
        (c[a][2], c[2][a]) = (share * series, share * series);
        c[3 + a][3 + a] = 1.0 / mean(|(_, mu, _)| 1.0 / mu);
    }
    c[5][5] = mean(|(_, mu, _)| mu);
    assert_equal(&found, &c, 1e-7, "laminate");
}

#[test]
fn turning_the_mask_turns_the_stiffness() {
    let n = [20, 20, 20];
    let h = [0.02; 3];
    let here = specimen(n, h, irregular);
    // A quarter turn about x: what was along y is now along z, what was along z against y.
    let there = specimen(n, h, |p| irregular([p[0], p[2], n[1] - 1 - p[1]]));
    let frame = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]];
    for conditions in BOTH {
        let params = settings(conditions, 1e-7);
        let (a, b) = (solve(&here, &params), solve(&there, &params));
        assert!(
            a.matrix_mpa[0][4].abs() > 1e-4 * a.matrix_mpa[0][0],
            "nothing to turn"
        );
        let turned = seen_from(&a.matrix_mpa, &frame);
        assert_equal(&b.matrix_mpa, &turned, 1e-6, conditions.name());
    }
}

/// Under mixed conditions a normal strain is the confined load of `--load confined`: another code path, one number.
#[test]
fn normal_strain_between_sliding_faces_is_the_confined_load() {
    let s = specimen([20; 3], [0.02; 3], irregular);
    let c = solve(&s, &settings(Conditions::Mixed, 1e-5)).matrix_mpa;
    for (a, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
        let params = SolveParams {
            load: Load::Confined,
            axis,
            tolerance: 1e-9,
            ..SolveParams::default()
        };
        let confined = solve_voxels(&s, &params, |_| ()).unwrap().moduli.e_app_mpa;
        assert!(
            (c[a][a] / confined - 1.0).abs() < 1e-7,
            "{axis:?}: {} {confined}",
            c[a][a]
        );
    }
}

#[test]
fn the_matrix_is_symmetric_and_positive_and_kinematic_bounds_mixed() {
    let s = specimen([20; 3], [0.02; 3], irregular);
    let [kinematic, mixed] = BOTH.map(|c| solve(&s, &settings(c, 1e-4)));
    for solved in [&kinematic, &mixed] {
        let c = &solved.matrix_mpa;
        assert!((0..36).all(|k| c[k / 6][k % 6] == c[k % 6][k / 6]));
        assert!(compliance(c).is_some(), "{c:?}");
    }
    assert_eq!(kinematic.asymmetry_mpa, 0.0);
    for i in 0..6 {
        assert!(kinematic.matrix_mpa[i][i] > mixed.matrix_mpa[i][i]);
    }
}

/// The true error is at most three times the stated one.
#[test]
fn the_stated_errors_hold() {
    let s = specimen([20; 3], [0.02; 3], irregular);
    for conditions in BOTH {
        let exact = solve(&s, &settings(conditions, 1e-8)).matrix_mpa;
        for tolerance in [1e-1, 1e-2, 1e-3] {
            let c = solve(&s, &settings(conditions, tolerance));
            for k in 0..36 {
                let (i, j) = (k / 6, k % 6);
                let error = (c.matrix_mpa[i][j] - exact[i][j]).abs();
                let stated = c.error_mpa[i][j] + 1e-7 * largest(&exact);
                assert!(
                    error < 3.0 * stated,
                    "{conditions:?} {tolerance} {i}{j}: {error} {stated}"
                );
                let scale = (exact[i][i] * exact[j][j]).sqrt();
                // Mixed conditions are off to first order, with the tissue's energy in the bound: far more than is true.
                assert!(
                    conditions == Conditions::Mixed || stated < 1.001 * tolerance * scale + 1e-4
                );
            }
        }
    }
}

#[test]
fn the_file_is_read_back_kept_and_made_again() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("p.nii.gz"), dir.path().join("out"));
    let (scan, out) = (scan.to_str().unwrap(), out.to_str().unwrap());
    let phantom = [
        "phantom",
        "-o",
        scan,
        "--size-mm",
        "0.8",
        "--spacing-mm",
        "0.04",
        "--bvtv",
        "0.5",
        "--seed",
        "1",
    ];
    assert_eq!(run(&phantom).0, 0);
    assert_eq!(run(&["segment", scan, "-o", out, "--otsu"]).0, 0);
    let args = [
        "solve",
        out,
        "--method",
        "voxel-fe",
        "--load",
        "stiffness",
        "--json",
    ];
    let (code, stdout, stderr) = run(&args);
    assert_eq!(code, 0, "{stderr}");
    let rows: Vec<bonepd_ct::result::row::Row> = serde_json::from_str(&stdout).unwrap();
    assert_eq!(
        (rows[0].key.load.name(), rows[0].key.supports.name()),
        ("stiffness", "kinematic")
    );
    let path = std::path::Path::new(out).join("stiffness.json");
    let record = file::record(&path).unwrap();
    // What a scene reads is what was written.
    assert_eq!(file::read(&path).unwrap(), record.stiffness_mpa);
    let s = compliance(&record.stiffness_mpa).unwrap();
    assert!((rows[0].e_app_mpa().unwrap() * s[2][2] - 1.0).abs() < 1e-9);
    assert!(rows[0].marks.note.as_ref().unwrap().contains("kinematic"));
    // Kept while it is there, made again when it is not, or other conditions are asked for.
    let made = |args: &[&str]| {
        let before = std::fs::metadata(&path)
            .ok()
            .and_then(|m| m.modified().ok());
        assert_eq!(run(args).0, 0);
        before
            != std::fs::metadata(&path)
                .ok()
                .and_then(|m| m.modified().ok())
    };
    assert!(!made(&args));
    std::fs::remove_file(&path).unwrap();
    assert!(made(&args));
    assert!(made(&[&args[..], &["--conditions", "mixed"]].concat()));
    assert!(made(&args));
}

#[test]
fn what_has_no_box_or_no_faces_is_refused() {
    let mut round = specimen([8; 3], [0.02; 3], |_| true);
    round.tv_mm3 *= std::f64::consts::FRAC_PI_4;
    round.tv_definition = "cylinder d=0.16 mm".into();
    let words = stiffness(&round, &settings(Conditions::Kinematic, 1e-3));
    assert!(words.unwrap_err().to_string().contains("cylinder"));
    let nothing = specimen([8; 3], [0.02; 3], |p| p.iter().all(|v| (2..6).contains(v)));
    let solved = solve(&nothing, &settings(Conditions::Kinematic, 1e-3));
    assert_eq!((solved.elements, largest(&solved.matrix_mpa)), (0, 0.0));
}
