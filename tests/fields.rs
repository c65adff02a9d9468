//! Fields on request, and the failure load, against closed forms and what must not change them.

use crate::cli::run;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::{nifti, scan};
use bonepd_ct::io::table;
use bonepd_ct::measure::pistoia::Pistoia;
use bonepd_ct::physics::material::{Label, Law, Material};
use bonepd_ct::pipeline::apparent::fields::{Field, Recorded};
use bonepd_ct::pipeline::apparent::job::Job;
use bonepd_ct::pipeline::apparent::solved::Solved;
use bonepd_ct::pipeline::apparent::{Method, SolveParams, of_lattice, of_voxels};
use bonepd_ct::pipeline::lattice::{Boundary, Case, LatticeParams, Structure};
use bonepd_ct::result::row::Row;
use bonepd_ct::volume::{Specimen, Volume};

/// A solid block, its upper half another label.
fn block() -> Specimen {
    let grid = Grid::new([6, 4, 8], [0.02; 3]);
    let grey = (0..grid.len()).map(|i| if i < grid.len() / 2 { 1.0 } else { 2.0 });
    Specimen {
        name: "block".into(),
        tv_mm3: grid.size_mm().iter().product(),
        bone: Volume::from_vec(grid, vec![1; grid.len()]),
        tv_definition: "box".into(),
        grey: Some(Volume::from_vec(grid, grey.collect())),
        threshold: None,
    }
}

fn params() -> SolveParams {
    SolveParams {
        method: Method::VoxelFe,
        tolerance: 1e-10,
        fields: vec![
            Field::Displacement,
            Field::Sed,
            Field::VonMises,
            Field::Fraction,
        ],
        pistoia: Some(Pistoia::default()),
        ..SolveParams::default()
    }
}

fn solved(job: &Job, specimen: &Specimen, params: &SolveParams) -> (Solved, Recorded) {
    let solution = job.solve_specimen(specimen, params, &mut |_, _| ());
    solution.unwrap().modulus().unwrap()
}

fn recorded(params: &SolveParams) -> Recorded {
    solved(&of_voxels(), &block(), params).1
}

fn at(recorded: &Recorded, name: &str, [x, y, z]: [usize; 3]) -> f64 {
    let field = recorded.fields.iter().find(|f| f.name == name).unwrap();
    f64::from(field.components[0].values[[z, y, x]])
}

fn near(found: f64, wanted: f64) {
    assert!((found / wanted - 1.0).abs() < 1e-4, "{found} {wanted}");
}

/// Under a strain of −1 % a bar has σ = E ε, SED = ½ E ε², effective strain |ε|: it fails at 0.7 of that, at 0.007 E A.
#[test]
fn a_homogeneous_block_has_the_fields_and_the_failure_load_of_a_bar() {
    let area = 0.12 * 0.08;
    for (refine, coarsen) in [(1, 1), (2, 1), (1, 2)] {
        let r = recorded(&SolveParams {
            refine,
            coarsen,
            ..params()
        });
        let p = [1, 2, 5];
        near(at(&r, "sed_mpa", p), 0.05);
        near(at(&r, "von_mises_mpa", p), 10.0);
        near(at(&r, "fraction", p), 1.0);
        if coarsen == 1 {
            // Measured from the lower end; sideways, ν times as much from the centre.
            near(at(&r, "displacement_z_mm", p), -0.01 * 5.5 * 0.02);
            let apart =
                at(&r, "displacement_x_mm", [5, 2, 5]) - at(&r, "displacement_x_mm", [0, 2, 5]);
            near(apart, 0.3 * 0.01 * 5.0 * 0.02);
        }
        let failure = r.failure.unwrap();
        near(failure.factor, 0.7);
        near(failure.failure_load_n.unwrap(), 7.0 * area);
    }
}

/// The strain applied, its sign and the modulus of a uniform tissue do not change at which strain it fails.
#[test]
fn the_failure_load_is_the_specimens_not_the_load_cases() {
    let load = |change: &dyn Fn(&mut SolveParams)| {
        let mut settings = params();
        change(&mut settings);
        recorded(&settings).failure.unwrap().failure_load_n.unwrap()
    };
    let once = load(&|_| ());
    near(load(&|p| p.strain = 0.002), once);
    near(load(&|p| p.young_mpa = 3000.0), 3.0 * once);
    let criterion = |critical_volume, critical_strain| {
        load(&|p| {
            p.pistoia = Some(Pistoia {
                critical_volume,
                critical_strain,
            });
        })
    };
    near(criterion(0.5, 0.014), 2.0 * once);
}

/// Layers of 1000 and 3000 MPa in series at ν = 0 are strained 3 to 1 about a mean of 1 %: the softer half decides for a
/// critical volume up to one half, the stiffer beyond.
#[test]
fn the_weaker_layer_fails_first() {
    let label = |value, young_mpa| Label {
        value,
        young_mpa,
        poisson: None,
    };
    let series = SolveParams {
        poisson: 0.0,
        material: Some(Material::new(Law::Labels(vec![
            label(1, 1000.0),
            label(2, 3000.0),
        ]))),
        ..params()
    };
    let r = recorded(&series);
    near(r.failure.as_ref().unwrap().factor, 0.007 / 0.015);
    near(at(&r, "sed_mpa", [0, 0, 1]), 0.5 * 1000.0 * 0.015 * 0.015);
    near(at(&r, "sed_mpa", [0, 0, 6]), 0.5 * 3000.0 * 0.005 * 0.005);
    near(at(&r, "von_mises_mpa", [0, 0, 6]), 15.0);
    let most = SolveParams {
        pistoia: Some(Pistoia {
            critical_volume: 0.6,
            critical_strain: 0.007,
        }),
        ..series
    };
    near(recorded(&most).failure.unwrap().factor, 0.007 / 0.005);
}

#[test]
fn nothing_is_recorded_unasked_and_lattices_have_no_stresses() {
    let plain = SolveParams {
        fields: vec![],
        pistoia: None,
        ..params()
    };
    let r = recorded(&plain);
    assert!(r.fields.is_empty() && r.failure.is_none());
    let lattice = SolveParams {
        method: Method::Lattice,
        ..params()
    };
    assert!(
        lattice
            .check()
            .unwrap_err()
            .to_string()
            .contains("voxel-fe")
    );
}

/// By the command: fields lie where the scan lies, columns hold the failure load.
#[test]
fn fields_are_written_on_the_scans_grid() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let mut image = Volume::from_vec(Grid::new([6, 4, 8], [0.02; 3]), vec![1u8; 192]);
    let affine = [
        [0.02, 0.0, 0.0, 3.0],
        [0.0, 0.02, 0.0, -2.0],
        [0.0, 0.0, 0.02, 1.0],
    ];
    image.affine = Some(affine);
    nifti::write(&dir.path().join("scan.nii"), &image).unwrap();
    let (scan, out) = (path("scan.nii"), path("out"));
    let ok = |args: &[&str]| {
        let (code, stdout, stderr) = run(args);
        assert_eq!(code, 0, "{stderr}");
        stdout
    };
    ok(&["segment", &scan, "-o", &out, "--lower", "1"]);
    let solve = [
        "solve",
        &out,
        "--method",
        "voxel-fe",
        "--fields",
        "sed,displacement",
        "--failure",
    ];
    let said = ok(&solve);
    let field = scan::read(&dir.path().join("out/field-sed-mpa.nii.gz"), None)
        .unwrap()
        .volume;
    let back = field.affine.unwrap();
    assert!(
        (0..12).all(|i| (back[i / 4][i % 4] - affine[i / 4][i % 4]).abs() < 1e-6),
        "{back:?}"
    );
    assert!(
        dir.path()
            .join("out/field-displacement-z-mm.nii.gz")
            .is_file()
    );
    assert!(!dir.path().join("out/field-von-mises-mpa.nii.gz").exists());
    for picture in [
        "field-sed-mpa.png",
        "field-sed-mpa-3d.png",
        "view-sed-mpa.html",
        "field-displacement-z-mm-3d.png",
    ] {
        assert!(dir.path().join("out").join(picture).is_file(), "{picture}");
    }
    let vti = std::fs::read(dir.path().join("out/fields.vti")).unwrap();
    assert!(String::from_utf8_lossy(&vti).contains("Origin=\"2.99 -2.01 0.99\""));
    assert!(said.contains("failure load 0.067 N"), "{said}");
    let rows: Vec<Row> = table::read(&dir.path().join("out/results.csv")).unwrap();
    let load = rows[0].failure().unwrap().load_n.unwrap();
    assert!((load / (7.0 * 0.12 * 0.08) - 1.0).abs() < 1e-2, "{load}");
    let (code, _, stderr) = run(&["solve", &out, "--fields", "sed,von-mises"]);
    assert!(code == 2 && stderr.contains("voxel-fe"), "{stderr}");
}

/// Sites' energies add up to the energy behind the modulus, the grips are where they were brought to, and a file holds it.
#[test]
fn a_lattice_has_its_fields_at_its_sites() {
    let specimen = crate::laws::irregular_specimen();
    for (structure, boundary, poisson) in [
        (Structure::Sc, Boundary::Floppy, 0.3),
        (Structure::Sc, Boundary::Firm, 0.25),
        (Structure::Sc, Boundary::Connected, 0.3),
        (Structure::Bcc, Boundary::Weighted, 0.2),
    ] {
        let case = Case {
            structure,
            lp_mm: 0.05,
            boundary,
            registration_mm: [0.0; 3],
        };
        let params = SolveParams {
            poisson,
            tolerance: 1e-9,
            fields: vec![Field::Displacement, Field::Sed, Field::Fraction],
            ..SolveParams::default()
        };
        let (solved, recorded) = solved(&of_lattice(case), &specimen, &params);
        let fields = recorded.sites.unwrap();
        let u = fields.displacement_mm.as_ref().unwrap();
        let sed = fields.sed_mpa.as_ref().unwrap();
        assert_eq!([fields.at_mm.len(), u.len(), sed.len()], [solved.sites; 3]);
        let along = |rows: &[[f64; 3]]| {
            let z = rows.iter().map(|row| row[2]);
            [
                z.clone().fold(f64::MAX, f64::min),
                z.fold(f64::MIN, f64::max),
            ]
        };
        let [low, high] = along(u);
        let moved = high - low;
        let gauge = moved / -params.strain;
        let [bottom, top] = along(&fields.at_mm);
        assert!(gauge > 0.0 && gauge < top - bottom + 1e-12, "{gauge}");
        let cell = case.structure.cell_volume() * case.lp_mm.powi(3);
        let energy: f64 = sed.iter().map(|sed| sed * cell).sum();
        let area = specimen.area_mm2(params.axis);
        let from_fields = 2.0 * energy * gauge / (area * moved.powi(2));
        near(from_fields, solved.moduli.from_energy_mpa);
        let fraction = fields.fraction.as_ref().unwrap();
        let least = fraction.iter().copied().fold(f64::MAX, f64::min);
        let whole = matches!(boundary, Boundary::Firm | Boundary::Floppy);
        assert_eq!(least < 1.0, !whole, "{least}");
    }
    let plain = SolveParams::default();
    let case = LatticeParams::default().cases()[0];
    let (_, recorded) = solved(&of_lattice(case), &specimen, &plain);
    assert!(recorded.sites.is_none());
}

#[test]
fn fields_of_a_lattice_are_written_by_the_command() {
    let dir = tempfile::tempdir().unwrap();
    let (scan, out) = (dir.path().join("scan.nii"), dir.path().join("out"));
    let image = Volume::from_vec(Grid::new([10; 3], [0.02; 3]), vec![1u8; 1000]);
    nifti::write(&scan, &image).unwrap();
    let (scan, folder) = (scan.to_str().unwrap(), out.to_str().unwrap());
    let ok = |args: &[&str]| assert_eq!(run(args).0, 0);
    ok(&["segment", scan, "-o", folder, "--lower", "1"]);
    let lattice = ["solve", folder, "--lp", "0.05", "--boundary", "floppy"];
    ok(&lattice);
    assert!(!out.join("fields-sc-floppy-0.05.vtk").exists());
    ok(&[&lattice[..], &["--fields", "sed,displacement"]].concat());
    let bytes = std::fs::read(out.join("fields-sc-floppy-0.05.vtk")).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let head = "# vtk DataFile Version 3.0\nsc-floppy-0.05\nBINARY\nDATASET POLYDATA\nPOINTS ";
    let sites: usize = text
        .strip_prefix(head)
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    for part in ["VECTORS displacement_mm float", "SCALARS sed_mpa float 1"] {
        assert!(text.contains(part), "{part}");
    }
    assert!(!text.contains("fraction"));
    // Three floats of place, two integers of a vertex, three floats and one of values.
    assert!(
        bytes.len() > sites * 4 * (3 + 2 + 3 + 1) && bytes.len() < sites * 36 + 400,
        "{}",
        bytes.len()
    );
}
