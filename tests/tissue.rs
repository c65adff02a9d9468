//! Tissue that differs from voxel to voxel: labels and laws of density, on lattices and on voxel elements.

use crate::cli::run;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::io::table;
use bonepd_ct::physics::material::{Label, Law, Material};
use bonepd_ct::pipeline::apparent::solve_lattice;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::apparent::{Load, SolveParams};
use bonepd_ct::pipeline::lattice::{Boundary, Case, Structure};
use bonepd_ct::result::row::Row;
use bonepd_ct::volume::{Specimen, Volume};

/// A solid block, its voxels labelled 100 or 127.
fn labelled(n: [usize; 3], h: f64, cortical: impl Fn([usize; 3]) -> bool) -> Specimen {
    let grid = Grid::new(n, [h; 3]);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let grey = (0..grid.len()).map(|i| if cortical(at(i)) { 127.0 } else { 100.0 });
    Specimen {
        name: "labelled".into(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, vec![1; grid.len()]),
        tv_definition: "box".into(),
        grey: Some(Volume::from_vec(grid, grey.collect())),
        threshold: None,
    }
}

fn labels(trabecular: [f64; 2], cortical: [f64; 2]) -> Option<Material> {
    let label = |value, [young_mpa, nu]: [f64; 2]| Label {
        value,
        young_mpa,
        poisson: Some(nu),
    };
    Some(Material::new(Law::Labels(vec![
        label(100, trabecular),
        label(127, cortical),
    ])))
}

fn params(material: Option<Material>) -> SolveParams {
    SolveParams {
        material,
        tolerance: 1e-9,
        ..SolveParams::default()
    }
}

fn voxels(specimen: &Specimen, params: &SolveParams) -> f64 {
    let solved = solve_voxels(specimen, params, |_| ()).unwrap();
    assert!(solved.ended.converged());
    solved.moduli.e_app_mpa
}

fn case(lp_mm: f64) -> Case {
    Case {
        structure: Structure::Sc,
        lp_mm,
        boundary: Boundary::Floppy,
        registration_mm: [0.0; 3],
    }
}

fn lattice(specimen: &Specimen, lp_mm: f64, params: &SolveParams) -> f64 {
    let solved = solve_lattice(specimen, &case(lp_mm), params, |_| ()).unwrap();
    assert!(solved.ended.converged());
    solved.moduli.e_app_mpa
}

/// Layers along the load and across it, at ν = 0, are springs side by side and one after the other.
#[test]
fn labelled_elements_side_by_side_and_in_series_are_springs() {
    let material = labels([500.0, 0.0], [2000.0, 0.0]);
    let beside = labelled([8, 5, 6], 0.02, |p| p[0] < 4);
    let e = voxels(&beside, &params(material.clone()));
    assert!((e / 1250.0 - 1.0).abs() < 1e-6, "{e}");
    let after = labelled([5, 6, 8], 0.02, |p| p[2] < 4);
    let e = voxels(&after, &params(material.clone()));
    assert!((e / 800.0 - 1.0).abs() < 1e-6, "{e}");
    // Merged or split elements of one tissue each change nothing.
    for (coarsen, refine) in [(2, 1), (1, 2)] {
        let settings = SolveParams {
            coarsen,
            refine,
            ..params(material.clone())
        };
        let after = labelled([4, 6, 8], 0.02, |p| p[2] < 4);
        let e = voxels(&after, &settings);
        assert!((e / 800.0 - 1.0).abs() < 1e-6, "{coarsen} {refine}: {e}");
    }
}

/// With its sides held, each layer has its own confined modulus E (1 − ν) / ((1 + ν) (1 − 2ν)): only right if each
/// label has its own Poisson's ratio, also above the one from which the dilatation is averaged.
#[test]
fn every_label_has_its_own_poissons_ratio() {
    let confined = |e: f64, nu: f64| e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    for nu in [0.1, 0.45] {
        let settings = SolveParams {
            load: Load::Confined,
            ..params(labels([1000.0, 0.3], [700.0, nu]))
        };
        let e = voxels(&labelled([5, 4, 8], 0.02, |p| p[2] < 4), &settings);
        let (a, b) = (confined(1000.0, 0.3), confined(700.0, nu));
        assert!((e / (2.0 * a * b / (a + b)) - 1.0).abs() < 1e-6, "{e}");
    }
}

#[test]
fn a_lattice_converges_to_springs_in_series_in_first_order() {
    let block = labelled([20, 20, 20], 0.02, |p| p[2] < 10);
    let flat = |material| SolveParams {
        poisson: 0.0,
        ..params(material)
    };
    // Cells at the faces of the block are cut, so a lattice of one tissue is the measure.
    let error = |lp: f64| {
        let mixed = lattice(&block, lp, &flat(labels([500.0, 0.0], [2000.0, 0.0])));
        mixed / lattice(&block, lp, &flat(None)) / 0.8 - 1.0
    };
    let (coarse, fine) = (error(0.04), error(0.02));
    // The interface's plane of sites has the mean of both moduli: 3 % at 20 cells, by the bonds' springs in series.
    assert!((0.0..0.05).contains(&fine), "{coarse} {fine}");
    assert!((1.6..2.6).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// With its sides held, each layer of a lattice has its label's own confined modulus, in first order in the lattice parameter
/// (the interface's plane of sites has the mean of both: 2.8 % at 20 cells, as above); also where one label has no volumetric term at all.
#[test]
fn every_label_has_its_own_poissons_ratio_on_lattices() {
    let confined = |e: f64, nu: f64| e * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    let block = labelled([20, 20, 20], 0.02, |p| p[2] < 10);
    for nu in [0.1, 0.25, 0.4] {
        let held = |material| SolveParams {
            load: Load::Confined,
            ..params(material)
        };
        let (a, b) = (confined(1000.0, 0.3), confined(700.0, nu));
        let series = 2.0 * a * b / (a + b) / a;
        let error = |lp: f64| {
            let mixed = lattice(&block, lp, &held(labels([1000.0, 0.3], [700.0, nu])));
            mixed / lattice(&block, lp, &held(None)) / series - 1.0
        };
        let (coarse, fine) = (error(0.04), error(0.02));
        println!("{nu}: {coarse:e} {fine:e}");
        assert!(
            fine.abs() < 0.05 && fine.abs() < 0.7 * coarse.abs(),
            "{nu}: {coarse} {fine}"
        );
    }
}

/// Labels of one ratio, told apart or not: the same lattice.
#[test]
fn ratios_that_do_not_differ_change_nothing() {
    let block = labelled([8, 8, 8], 0.02, |p| p[0] < 4);
    let one = lattice(&block, 0.04, &params(labels([500.0, 0.3], [900.0, 0.3])));
    let two = lattice(
        &block,
        0.04,
        &params(labels([500.0, 0.3], [900.0, 0.3 + 1e-9])),
    );
    assert!((two / one - 1.0).abs() < 1e-7, "{one} {two}");
}

/// Side by side, the uniform lattice's field stores the mean modulus's energy: the least energy is no larger.
#[test]
fn a_lattice_of_two_tissues_side_by_side_is_nearly_their_mean() {
    let block = labelled([20, 20, 20], 0.02, |p| p[0] < 10);
    let mixed = lattice(&block, 0.04, &params(labels([500.0, 0.3], [1500.0, 0.3])));
    let ratio = mixed / lattice(&block, 0.04, &params(None));
    assert!((0.97..1.0 + 1e-6).contains(&ratio), "{ratio}");
}

/// Labels that turn out alike are solved as one tissue, to the bit.
#[test]
fn uniform_bone_pays_nothing_for_the_table() {
    let block = labelled([8, 8, 8], 0.02, |p| p[0] < 4);
    let table = params(labels([1000.0, 0.3], [1000.0, 0.3]));
    assert_eq!(voxels(&block, &table), voxels(&block, &params(None)));
    let plain = lattice(&block, 0.04, &params(None));
    assert_eq!(lattice(&block, 0.04, &table), plain);
    // A law of constant density, twice as stiff.
    let law = Material::new(Law::Linear {
        slope: 0.0,
        intercept: 2000.0,
    });
    let twice = lattice(&block, 0.04, &params(Some(law)));
    assert!((twice / plain - 2.0).abs() < 1e-7);
}

#[test]
fn what_has_no_modulus_is_refused_in_words() {
    let block = labelled([8, 8, 8], 0.02, |p| p[0] < 4);
    let refused = |specimen: &Specimen, settings: &SolveParams| {
        let lattice = solve_lattice(specimen, &case(0.04), settings, |_| ());
        lattice.unwrap_err().to_string()
    };
    let unstable = refused(&block, &params(labels([500.0, 0.3], [900.0, -0.6])));
    assert!(unstable.contains("is stable for"), "{unstable}");
    let missing = Law::Labels(vec![Label {
        value: 100,
        young_mpa: 1.0,
        poisson: None,
    }]);
    let stranger = refused(&block, &params(Some(Material::new(missing))));
    assert!(
        stranger.contains("256 bone voxels") && stranger.contains("127"),
        "{stranger}"
    );
    let mask_only = Specimen {
        grey: None,
        ..block
    };
    let kept = refused(&mask_only, &params(labels([500.0, 0.3], [900.0, 0.3])));
    assert!(kept.contains("--no-grey"), "{kept}");
}

/// From a labelled file to a row of results, by the command line and by a recipe.
#[test]
fn a_labelled_scan_goes_through_the_commands() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let grid = Grid::new([10, 10, 10], [0.02; 3]);
    let values = (0..1000).map(|i| match (i % 10, i / 100) {
        (0..=1, _) => 0,
        (_, 0..=4) => 127,
        _ => 100,
    });
    let scan = Volume::from_vec(grid, values.collect::<Vec<u8>>());
    nifti::write(&dir.path().join("seg.nii"), &scan).unwrap();
    let ok = |args: &[&str]| {
        let (code, _, stderr) = run(args);
        assert_eq!(code, 0, "{stderr}");
    };
    let (scan, out) = (at("seg.nii"), at("out"));
    ok(&["segment", &scan, "-o", &out, "--labels", "100,127"]);
    let law = "labels:100=500,127=2000";
    ok(&[
        "solve",
        &out,
        "--method",
        "voxel-fe",
        "--material",
        law,
        "--poisson",
        "0",
        "--tolerance",
        "1e-7",
    ]);
    let rows: Vec<Row> = table::read(&dir.path().join("out/results.csv")).unwrap();
    assert_eq!(
        rows[0].key.material.as_deref(),
        Some("labels:100=500;127=2000")
    );
    assert_eq!(rows[0].key.young_mpa, 1250.0);
    assert!((rows[0].key.bv_tv - 0.8).abs() < 1e-12);
    // Layers in series over 0.8 of the section.
    assert!((rows[0].e_app_mpa().unwrap() / 640.0 - 1.0).abs() < 1e-5);
    let recipe = "[segment]\nlabels = [100, 127]\n[solve]\nmethod = \"voxel-fe\"\npoisson = 0.0\n[solve.material.law]\n\
        labels = [{ value = 100, young_mpa = 500 }, { value = 127, young_mpa = 2000 }]\n";
    std::fs::write(dir.path().join("r.toml"), recipe).unwrap();
    ok(&["run", &at("r.toml"), &scan, "-o", &at("cohort")]);
    let again: Vec<Row> = table::read(&dir.path().join("cohort/results.csv")).unwrap();
    assert!((again[0].e_app_mpa().unwrap() / 640.0 - 1.0).abs() < 2e-3);
    let (code, _, stderr) = run(&["segment", &scan, "-o", &out, "--labels", "99"]);
    assert!(code == 2 && stderr.contains("127"), "{stderr}");
}
