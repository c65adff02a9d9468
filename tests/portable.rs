//! The program without vector registers: on processors that have none of those it knows, plain arrays give the same moduli.
//! `BONEPD_PORTABLE` makes this processor such a one.

use crate::cli::{bonepd, run};
use bonepd_ct::io::table;
use bonepd_ct::result::row::Row;
use bonepd_ct::simd::{Isa, PORTABLE, isa};
use std::path::Path;

/// Solves are exact to this share of the modulus.
const TOLERANCE: &str = "1e-8";

/// Each way to a modulus that has arithmetic of its own.
const WAYS: [&[&str]; 4] = [
    &["--method", "voxel-fe"],
    &["--method", "geometry-fe"],
    &["--lp", "0.1", "--boundary", "floppy,firm,connected"],
    &[
        "--structure",
        "bcc,fcc",
        "--lp",
        "0.12",
        "--boundary",
        "floppy,firm,weighted",
    ],
];

fn words(args: &[&str], is_portable: bool) {
    let mut program = bonepd();
    program.args(args).env_remove(PORTABLE);
    if is_portable {
        program.env(PORTABLE, "1");
    }
    let done = program.output().unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
}

/// The phantom of `scan`, segmented into `out` and solved in each way.
fn rows(scan: &str, out: &Path, is_portable: bool) -> Vec<Row> {
    let folder = out.to_str().unwrap();
    words(
        &["segment", scan, "-o", folder, "--lower", "200", "--quiet"],
        is_portable,
    );
    for way in WAYS {
        let solve = [
            &["solve", folder, "--tolerance", TOLERANCE, "--quiet"][..],
            way,
        ]
        .concat();
        words(&solve, is_portable);
    }
    table::read(&out.join("results.csv")).unwrap()
}

#[test]
fn plain_arrays_give_the_moduli_of_vector_registers() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("p.nii.gz");
    let scan = scan.to_str().unwrap();
    let size = [
        "--size-mm",
        "1,1,1.2",
        "--spacing-mm",
        "0.05",
        "--bvtv",
        "0.35",
    ];
    let (code, _, stderr) = run(&[&["phantom", "-o", scan][..], &size].concat());
    assert_eq!(code, 0, "{stderr}");
    let fast = rows(scan, &dir.path().join("fast"), false);
    let plain = rows(scan, &dir.path().join("plain"), true);
    assert_eq!(fast.len(), plain.len());
    assert!(fast.len() >= 11, "{} rows", fast.len());
    let mut is_other = false;
    for (a, b) in fast.iter().zip(&plain) {
        assert_eq!(a.key, b.key);
        let (Some(e), Some(plain)) = (a.e_app_mpa(), b.e_app_mpa()) else {
            panic!("no modulus of {:?}", a.key)
        };
        // What both solves allow themselves; measured without AVX: 2e-11 at most.
        assert!(
            (e / plain - 1.0).abs() < 1e-8,
            "{:?}: {e}, plain {plain}",
            a.key
        );
        is_other |= e != plain;
    }
    // Fused products round otherwise: equal bits would mean that nothing had been changed.
    assert!(
        is_other || isa() == Isa::Portable,
        "{PORTABLE} changes nothing"
    );
}

/// Bond forces of a scene that grows for 80 steps: one text of the program for all registers, without fused products, so to the bit.
#[test]
fn a_scene_remodels_alike() {
    let dir = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/square-fixed-ratio-10.toml");
    let history = |name: &str, is_portable: bool| {
        let (scene, out) = (scene.to_str().unwrap(), dir.path().join(name));
        words(
            &["scene", scene, "-o", out.to_str().unwrap(), "--quiet"],
            is_portable,
        );
        std::fs::read_to_string(out.join("history.csv")).unwrap()
    };
    let fast = history("fast", false);
    assert_eq!(fast, history("plain", true));
    assert!(fast.lines().count() > 80);
}
