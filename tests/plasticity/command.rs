//! `solve --plasticity`: rows, curve, restart, refusals.

use super::written_and_segmented;
use crate::cli::run;
use crate::specimens::specimen;
use bonepd_ct::io::table;
use bonepd_ct::physics::plasticity::{Plasticity, VonMises, YieldLaw};
use bonepd_ct::pipeline::apparent::job::JobResult;
use bonepd_ct::pipeline::apparent::{Load, LoadSteps, Method, SolveParams, of_voxels};
use bonepd_ct::result::row::Row;
use bonepd_ct::result::strength::CurvePoint;
use std::path::Path;

/// Struts of two voxels, in two labels.
fn segmented(dir: &Path) -> String {
    let frame = specimen([14, 14, 14], [0.02; 3], |p| {
        p.iter().filter(|v| **v % 6 < 2).count() >= 2
    });
    let label = |i: usize| if i % 14 < 7 { 100.0 } else { 127.0 };
    let values = frame.bone.as_slice().iter().enumerate();
    let values = values.map(|(i, b)| if *b != 0 { label(i) } else { 0.0 });
    written_and_segmented(
        dir,
        frame.bone.grid,
        values.collect(),
        &["--labels", "100,127"],
    )
}

const SOLVE: [&str; 10] = [
    "--method",
    "voxel-fe",
    "--young-mpa",
    "10000",
    "--strain",
    "-2%",
    "--ends",
    "bonded",
    "--plasticity",
    "von-mises:68",
];

fn solve(out: &str, more: &[&str]) -> (i32, String) {
    let (code, _, words) = run(&[&["solve", out], &SOLVE[..], more].concat());
    (code, words)
}

fn curve(out: &str) -> Vec<CurvePoint> {
    table::read(&Path::new(out).join("curve.csv")).unwrap()
}

#[test]
fn a_solve_writes_its_row_its_curve_and_its_shares() {
    let dir = tempfile::tempdir().unwrap();
    let out = segmented(dir.path());
    let (code, words) = solve(&out, &["--steps", "8", "--fields", "plastic-strain"]);
    assert_eq!(code, 0, "{words}");
    let points = curve(&out);
    assert_eq!(points.len(), 8);
    for p in &points {
        // Energies are those of the steps' ends: off by what is left unbalanced.
        let off = (p.energy_mj + p.dissipated_mj) / p.work_mj - 1.0;
        assert!(off.abs() < 1e-6, "{p:?}: {off:e}");
        assert!(
            p.strain < 0.0 && p.stress_mpa < 0.0 && p.force_n < 0.0,
            "{p:?}"
        );
    }
    let rows: Vec<Row> = table::read(&Path::new(&out).join("results.csv")).unwrap();
    let solved = rows[0].solved.as_ref().unwrap();
    let strength = solved.strength;
    let most = points.iter().map(|p| -p.stress_mpa).fold(0.0, f64::max);
    assert_eq!(strength.max_stress_mpa, Some(most));
    let (stress, strain) = (
        strength.yield_stress_mpa.unwrap(),
        strength.yield_strain.unwrap(),
    );
    let modulus = solved.e_app_mpa.unwrap();
    assert!((stress / (modulus * (strain - 0.002)) - 1.0).abs() < 1e-9);
    assert_eq!(solved.force_n, Some(-points[7].force_n));
    assert_eq!(rows[0].key.plasticity.as_deref(), Some("von-mises:68"));
    let shares = std::fs::read_to_string(Path::new(&out).join("yielded.csv")).unwrap();
    assert!(
        ["all", ",100,", ",127,"].iter().all(|l| shares.contains(l)),
        "{shares}"
    );
    assert!(
        Path::new(&out)
            .join("field-plastic-strain.nii.gz")
            .is_file()
    );
    assert!(!Path::new(&out).join("load-steps.bin").exists());
}

/// Without `--steps` lengths follow the curve: what was taken stands in the curve and the note, how it was chosen in the column.
#[test]
fn steps_that_nobody_gave_follow_the_curve() {
    let dir = tempfile::tempdir().unwrap();
    let out = segmented(dir.path());
    let (code, words) = solve(&out, &[]);
    assert_eq!(code, 0, "{words}");
    let points = curve(&out);
    assert!(points.len() < 10, "{points:?}");
    let rows: Vec<Row> = table::read(&Path::new(&out).join("results.csv")).unwrap();
    assert_eq!(rows[0].key.steps, Some(LoadSteps::Adaptive(1)));
    let note = rows[0].marks.note.as_deref().unwrap();
    let said = format!("then {} load steps", points.len());
    assert!(note.contains(&said), "{note}");
    assert!(!note.contains("more --steps"), "{note}");
    // The same by name: no second row.
    let (code, words) = solve(&out, &["--steps", "adaptive"]);
    assert_eq!(code, 0, "{words}");
    let rows: Vec<Row> = table::read(&Path::new(&out).join("results.csv")).unwrap();
    assert_eq!(rows.len(), 1);
}

#[test]
fn one_law_a_label_and_a_label_without_one() {
    let dir = tempfile::tempdir().unwrap();
    let out = segmented(dir.path());
    let laws = |laws: &str| {
        let (code, _, words) = run(&[
            &["solve", &out, "--force"],
            &SOLVE[..8],
            &["--plasticity", laws, "--steps", "3"],
        ]
        .concat());
        (code, words)
    };
    assert_eq!(laws("von-mises:68").0, 0);
    let one = curve(&out);
    assert_eq!(laws("labels:100=von-mises:68,127=von-mises:68").0, 0);
    assert_eq!(curve(&out), one);
    assert_eq!(laws("labels:100=von-mises:68,127=von-mises:1000").0, 0);
    assert!(curve(&out)[2].stress_mpa < one[2].stress_mpa);
    let (code, words) = laws("labels:100=von-mises:68");
    assert!(
        code == 2 && words.contains("label 127 has no law"),
        "{words}"
    );
}

#[test]
fn what_cannot_yield_is_refused_in_words() {
    let dir = tempfile::tempdir().unwrap();
    let out = segmented(dir.path());
    for (flags, expected) in [
        (
            &["--method", "lattice", "--plasticity", "von-mises:68"][..],
            "bonds of a lattice",
        ),
        (&["--load", "torsion"], "no stress-strain curve"),
        (&["--load", "stiffness"], "no stress-strain curve"),
        (
            &["--coarsen", "2", "--coarsen-by", "fraction"],
            "no yield stress of their own",
        ),
        (&["--failure"], "Pistoia"),
        (&["--fields", "sed"], "elastic tissue only"),
        (&["--plasticity", "von-mises:0"], "above 0 MPa"),
    ] {
        let mut words: Vec<&str> = vec!["solve", &out, "--method", "voxel-fe"];
        if flags[0] == "--method" {
            words.truncate(2);
        }
        if !flags.contains(&"--plasticity") {
            words.extend(["--plasticity", "von-mises:68"]);
        }
        words.extend(flags);
        let (code, _, said) = run(&words);
        assert!(code == 2 && said.contains(expected), "{flags:?}: {said}");
    }
}

/// A bar through the whole command's path: yields at its yield stress, and its 0.2 % offset is on the plateau.
#[test]
fn a_bar_of_voxels_yields_at_its_yield_stress() {
    let bar = specimen([4, 4, 6], [0.02; 3], |_| true);
    let params = SolveParams {
        method: Method::VoxelFe,
        young_mpa: 10_000.0,
        strain: -0.02,
        tolerance: 1e-6,
        plasticity: Some(Plasticity::All(YieldLaw::VonMises(VonMises {
            yield_mpa: 68.0,
            hardening_mpa: 0.0,
        }))),
        ..SolveParams::default()
    };
    let solved = of_voxels()
        .solve_specimen(&bar, &params, &mut |_, _| ())
        .unwrap();
    let JobResult::Modulus(solved, _) = solved else {
        unreachable!("one load")
    };
    let row = solved.row(Row::default());
    let strength = row.solved.unwrap().strength;
    assert!(
        (strength.max_stress_mpa.unwrap() / 68.0 - 1.0).abs() < 1e-6,
        "{strength:?}"
    );
    assert!(
        (strength.yield_stress_mpa.unwrap() / 68.0 - 1.0).abs() < 1e-6,
        "{strength:?}"
    );
}

/// A shear column turns by up to one and a half times the shear in its middle: of this one about half by more than 0.1 rad.
#[test]
fn what_turns_is_said_and_what_does_not_is_not() {
    let column = specimen([2, 2, 30], [0.02; 3], |_| true);
    let note = |strain: f64| {
        let params = SolveParams {
            method: Method::VoxelFe,
            load: Load::ShearX,
            young_mpa: 10_000.0,
            strain,
            steps: LoadSteps::Even(2),
            plasticity: Some(Plasticity::All(YieldLaw::VonMises(VonMises {
                yield_mpa: 1e5,
                hardening_mpa: 0.0,
            }))),
            ..SolveParams::default()
        };
        let solved = of_voxels().solve_specimen(&column, &params, &mut |_, _| ());
        let (solved, _) = solved.unwrap().modulus().unwrap();
        solved.row(Row::default()).marks.note.unwrap()
    };
    let turned = note(0.09);
    let before = "small strains do not hold everywhere: ";
    let after = " % of the bone has turned by more than 0.1 rad";
    let share = turned
        .split("; ")
        .find_map(|part| part.strip_prefix(before)?.strip_suffix(after));
    let share: f64 = share.expect(&turned).parse().unwrap();
    // 6 γ s (1 − s) > 0.1 of a beam whose ends do not turn, s along its height.
    assert!((share - 51.0).abs() < 8.0, "{turned}");
    assert!(!note(0.03).contains("rad"), "{}", note(0.03));
}
