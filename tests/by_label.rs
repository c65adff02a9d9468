//! Supports and loads by label, and uneven ends: closed forms of bars, balance, and what is refused in words.

use crate::cli::run;
use crate::specimens::specimen;
use bonepd_ct::grid::Grid;
use bonepd_ct::image::nifti;
use bonepd_ct::pipeline::apparent::ends::label_image::{LabelImage, Laid};
use bonepd_ct::pipeline::apparent::fields::Recorded;
use bonepd_ct::pipeline::apparent::solved::Solved;
use bonepd_ct::pipeline::apparent::{Load, Method, SolveParams, of_voxels};
use bonepd_ct::volume::{Specimen, Volume};
use std::path::PathBuf;
use std::sync::Arc;

const E: f64 = 1000.0;

/// A bar along z of `across`² × `length` elements of edge `h`, with a layer without bone below (label 1) and above (label 2).
fn bar(across: usize, length: usize, h: f64) -> (Specimen, LabelImage) {
    let n = [across, across, length + 2];
    let bar = specimen(n, [h; 3], |[_, _, z]| z > 0 && z <= length);
    let image = labels(&bar, |[_, _, z]| match z {
        0 => 1,
        z if z == length + 1 => 2,
        _ => 0,
    });
    (bar, image)
}

fn labels(specimen: &Specimen, label: impl Fn([usize; 3]) -> i32) -> LabelImage {
    let grid = specimen.bone.grid;
    let n = grid.n;
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let values = (0..grid.len()).map(|i| label(at(i))).collect();
    LabelImage {
        path: PathBuf::from("supports.nii.gz"),
        laid: Some(Arc::new(Laid {
            blake3: String::new(),
            labels: Volume::from_vec(grid, values),
        })),
    }
}

fn settings(image: &LabelImage, held: &[&str], moved: &[&str], pushed: &[&str]) -> SolveParams {
    SolveParams {
        method: Method::VoxelFe,
        load: Load::Labels,
        young_mpa: E,
        poisson: 0.0,
        tolerance: 1e-10,
        held: held.iter().map(|w| w.parse().unwrap()).collect(),
        moved: moved.iter().map(|w| w.parse().unwrap()).collect(),
        pushed: pushed.iter().map(|w| w.parse().unwrap()).collect(),
        supports: Some(image.clone()),
        ..SolveParams::default()
    }
}

fn solve(specimen: &Specimen, params: &SolveParams) -> (Solved, Recorded) {
    let solution = of_voxels().solve_specimen(specimen, params, &mut |_, _| ());
    let (solved, recorded) = solution.unwrap().modulus().unwrap();
    assert!(solved.ended.converged(), "{:?}", solved.ended);
    (solved, recorded)
}

fn refused(specimen: &Specimen, params: &SolveParams) -> String {
    let solution = of_voxels().solve_specimen(specimen, params, &mut |_, _| ());
    solution.map(|_| ()).unwrap_err().to_string()
}

fn assert_near(found: f64, exact: f64, within: f64) {
    assert!((found / exact - 1.0).abs() < within, "{found} for {exact}");
}

/// `E A / L`, by a displacement and by a force, with a reaction that balances and the work of a spring.
#[test]
fn a_bar_in_tension_is_its_closed_form() {
    let (wide, image) = bar(3, 8, 0.1);
    let moved = settings(&image, &["1"], &["2:0,0,0.02"], &[]);
    let (solved, recorded) = solve(&wide, &moved);
    assert_near(
        solved.work.stiffness_n_per_mm.unwrap(),
        E * 0.09 / 0.8,
        1e-6,
    );
    assert_near(solved.work.force_n.unwrap(), 0.02 * E * 0.09 / 0.8, 1e-6);
    let [held, pulled] = &recorded.details.labels[..] else {
        panic!("{:?}", recorded.details.labels);
    };
    assert!((held.force_z_n + pulled.force_z_n).abs() < 1e-6 * pulled.force_z_n);
    assert_eq!((held.role.as_str(), held.nodes), ("held", 16));
    // One element across: four equal forces are an even traction.
    let (thin, image) = bar(1, 8, 0.1);
    let pushed = settings(&image, &["1"], &[], &["2:0,0,-3"]);
    let (solved, recorded) = solve(&thin, &pushed);
    assert_near(
        solved.work.stiffness_n_per_mm.unwrap(),
        E * 0.01 / 0.8,
        1e-6,
    );
    assert_eq!(solved.work.force_n, Some(3.0));
    let [held, pushed] = &recorded.details.labels[..] else {
        panic!("{:?}", recorded.details.labels);
    };
    assert_near(held.force_z_n, 3.0, 1e-6);
    assert_near(pushed.displacement_z_mm, -3.0 * 0.8 / (E * 0.01), 1e-6);
    assert_near(pushed.work_nmm, 9.0 * 0.8 / (E * 0.01), 1e-6);
}

/// A displacement at rollers and a free component make the patch of uniaxial stress at any Poisson's ratio.
#[test]
fn rollers_and_a_free_component_make_uniaxial_stress() {
    let block = specimen([4, 4, 4], [0.1; 3], |[x, y, z]| {
        x > 0 && y > 0 && z > 0 && z < 3
    });
    let image = labels(&block, |[x, y, z]| match (x == 0, y == 0, z) {
        (_, _, 3) if x > 0 && y > 0 => 4,
        (true, false, 1..3) => 1,
        (false, true, 1..3) => 2,
        (false, false, 0) => 3,
        _ => 0,
    });
    let mut params = settings(&image, &["1:x", "2:y", "3:z"], &["4:-,-,-0.002"], &[]);
    params.poisson = 0.3;
    let (solved, _) = solve(&block, &params);
    // 0.3 × 0.3 mm, 0.2 mm high, strained by 1 %.
    assert_near(solved.work.force_n.unwrap(), 0.01 * E * 0.09, 1e-6);
}

/// Timoshenko's cantilever with a force on its end (ν = 0: no restraint at the support, shear coefficient 5/6), to second order.
#[test]
fn a_cantilever_converges_to_timoshenko() {
    let compliance = |across: usize| {
        let (bar, image) = bar(across, 5 * across, 1.0 / across as f64);
        let params = settings(&image, &["1"], &[], &["2:0.5,0,0"]);
        let (solved, _) = solve(&bar, &params);
        1.0 / solved.work.stiffness_n_per_mm.unwrap()
    };
    let [coarse, middle, fine] = [2, 4, 8].map(compliance);
    let exact = 125.0 / (3.0 * E / 12.0) + 5.0 / (5.0 / 6.0 * 0.5 * E);
    let ratio = (middle - coarse) / (fine - middle);
    assert!((3.0..5.0).contains(&ratio), "{ratio}");
    // An eighth across: bending elements are 1 % too stiff; a third of that is left after one extrapolation.
    assert_near(fine, exact, 0.02);
    assert_near(fine + (fine - middle) / 3.0, exact, 0.004);
}

/// Two forces that balance stretch a bar that nothing holds; its mean place and turn stay.
#[test]
fn balanced_forces_need_no_support() {
    let (bar, image) = bar(1, 6, 0.1);
    let params = settings(&image, &[], &[], &["1:0,0,-2", "2:0,0,2"]);
    let (solved, recorded) = solve(&bar, &params);
    assert_eq!(solved.work.force_n, None);
    let [lower, upper] = &recorded.details.labels[..] else {
        panic!("{:?}", recorded.details.labels);
    };
    let stretch = 2.0 * 0.6 / (E * 0.01);
    assert_near(upper.displacement_z_mm, 0.5 * stretch, 1e-6);
    assert_near(lower.displacement_z_mm, -0.5 * stretch, 1e-6);
    // An energy within 1e-10 leaves displacements within 1e-5.
    assert!(upper.displacement_x_mm.abs() < 1e-5 * stretch);
    assert!(recorded.note.unwrap().contains("no label is held"));
}

/// Nodes that are guided and pushed: each line has its own part of their forces, and half of all work is the energy.
#[test]
fn shared_nodes_count_once() {
    let (bar, image) = bar(1, 6, 0.1);
    let params = settings(&image, &["1", "2:xy"], &[], &["2:0,0,2"]);
    let (solved, recorded) = solve(&bar, &params);
    let [_, guided, pushed] = &recorded.details.labels[..] else {
        panic!("{:?}", recorded.details.labels);
    };
    assert_near(pushed.force_z_n, 2.0, 1e-12);
    assert!(guided.force_z_n.abs() < 1e-4, "{guided:?}");
    // F² L / (E A).
    let work: f64 = recorded.details.labels.iter().map(|l| l.work_nmm).sum();
    assert_near(work, 2.0 * 2.0 * 0.6 / (E * 0.01), 1e-6);
    assert_near(solved.work.force_n.unwrap(), 2.0, 1e-9);
}

#[test]
fn wrong_supports_are_refused_in_words() {
    let (bar, image) = bar(2, 5, 0.1);
    let of = |held: &[&str], moved: &[&str], pushed: &[&str]| {
        refused(&bar, &settings(&image, held, moved, pushed))
    };
    for (said, found) in [
        ("has no label 7", of(&["7"], &[], &["2:0,0,1"])),
        ("name one of 1, 2", of(&["7"], &[], &["2:0,0,1"])),
        (
            "a turn about z through (0.1, 0.1",
            of(&["1:z"], &[], &["2:0,0,1"]),
        ),
        (
            "a shift along x; a shift along y",
            of(&["1:z"], &[], &["2:0,0,1"]),
        ),
        ("a shift along z", of(&["1:xy"], &["2:0.1,0,-"], &[])),
        ("do not balance", of(&[], &[], &["2:0,0,1"])),
        ("do not balance", of(&[], &[], &["1:-1,0,0", "2:1,0,0"])),
        (
            "where all its nodes are held",
            of(&["1", "2:z"], &[], &["2:0,0,1"]),
        ),
        ("nothing loads the bone", of(&["1"], &[], &[])),
        (
            "label 2 is both held and moved along z",
            of(&["1", "2:z"], &["2:0,0,0.1"], &[]),
        ),
        ("has no label 9", of(&["1"], &["9:0,0,0.1"], &[])),
        ("moved by 0 mm", of(&["1"], &["2:0,0,0"], &[])),
        (
            "label 2 is named twice",
            of(&["1"], &[], &["2:0,0,1", "2:0,0,1"]),
        ),
    ] {
        assert!(found.contains(said), "{said}: {found}");
    }
    // A label beside the bone.
    let beside = labels(&bar, |[_, _, z]| [1, 0, 0, 0, 0, 0, 2][z]);
    let far = specimen([2, 2, 7], [0.1; 3], |[_, _, z]| z > 0 && z < 4);
    let found = refused(&far, &settings(&beside, &["1"], &[], &["2:0,0,1"]));
    assert!(found.contains("touches bone that bears load"), "{found}");
    let unread = LabelImage::from(PathBuf::from("no.nii"));
    let found = refused(&bar, &settings(&unread, &["1"], &[], &["2:0,0,1"]));
    assert!(found.contains("was not read"), "{found}");
    let mut lattice = settings(&image, &["1"], &[], &["2:0,0,1"]);
    lattice.method = Method::Lattice;
    assert!(
        lattice
            .check()
            .unwrap_err()
            .to_string()
            .contains("corners of voxels")
    );
}

/// A second piece that only a load touches is named, and where it is.
#[test]
fn a_loose_piece_is_named() {
    let two = specimen([5, 2, 7], [0.1; 3], |[x, _, z]| x != 2 && z > 0 && z < 6);
    let image = labels(&two, |[x, _, z]| match z {
        0 if x < 2 => 1,
        6 => 2,
        _ => 0,
    });
    let found = refused(&two, &settings(&image, &["1"], &[], &["2:0,0,1"]));
    assert!(
        found.contains("one of 2 pieces of bone, about (0.4, 0.1, 0.35) mm"),
        "{found}"
    );
}

/// Two bars of different height between platens: springs side by side, each gripped where it is seen.
#[test]
fn uneven_ends_are_gripped_where_bone_is_seen() {
    let bars = specimen([5, 2, 20], [0.1; 3], |[x, _, z]| match x {
        0 | 1 => true,
        3 | 4 => (2..17).contains(&z),
        _ => false,
    });
    let e_app = |depth: f64| {
        let params = SolveParams {
            method: Method::VoxelFe,
            young_mpa: E,
            poisson: 0.0,
            tolerance: 1e-10,
            ends_depth_mm: depth,
            ..SolveParams::default()
        };
        solve(&bars, &params).0.moduli
    };
    let (area, long, short) = (0.04, 2.0, 1.5);
    let exact = |stiffness: f64| stiffness * long / 0.1;
    for (depth, stiffness) in [
        (0.0, E * area / long),
        (0.25, E * area / long),
        (0.3, E * area / long + E * area / short),
    ] {
        let moduli = e_app(depth);
        assert_near(moduli.e_app_mpa, exact(stiffness), 1e-6);
        assert_near(moduli.from_reaction_mpa, exact(stiffness), 1e-5);
    }
    let params = |depth: f64, axis| SolveParams {
        method: Method::VoxelFe,
        ends_depth_mm: depth,
        axis,
        ..SolveParams::default()
    };
    let low = specimen([3, 3, 20], [0.1; 3], |[_, _, z]| (5..15).contains(&z));
    let found = refused(&low, &params(0.4, bonepd_ct::grid::Axis::Z));
    assert!(
        found.contains("meets no bone: the first bone lies 0.5000 mm"),
        "{found}"
    );
    let found = refused(&low, &params(1.0, bonepd_ct::grid::Axis::Z));
    assert!(found.contains("leaves nothing"), "{found}");
    assert!(
        refused(
            &low,
            &SolveParams {
                grip_mm: 0.1,
                ..params(0.6, bonepd_ct::grid::Axis::Z)
            }
        )
        .contains("grips hold")
    );
}

/// All three axes see alike.
#[test]
fn uneven_ends_are_alike_along_every_axis() {
    use bonepd_ct::grid::Axis;
    let slant = |p: [usize; 3]| p[2] >= p[0] / 2 && p[2] < 10 - p[1] / 2;
    let found = [Axis::X, Axis::Y, Axis::Z].map(|axis| {
        let a = axis.index();
        let n: [usize; 3] = std::array::from_fn(|i| [5, 5, 10][(i + 2 + 3 - a) % 3]);
        let body = specimen(n, [0.1; 3], |p| {
            slant(std::array::from_fn(|i| p[(i + a + 1) % 3]))
        });
        let params = SolveParams {
            method: Method::VoxelFe,
            tolerance: 1e-10,
            ends_depth_mm: 0.2,
            axis,
            ..SolveParams::default()
        };
        solve(&body, &params).0.moduli.e_app_mpa
    });
    assert_near(found[0], found[2], 1e-8);
    assert_near(found[1], found[2], 1e-8);
}

/// By the command: labels of a file follow crop and turn, the row has the force, and bad labels end with exit 2.
#[test]
fn a_label_image_follows_the_scan() {
    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    // A bar along x in a larger scan; its ends are labelled.
    let n = [14, 6, 5];
    let grid = Grid::new(n, [0.1; 3]);
    let at = |i: usize| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
    let inside =
        |[x, y, z]: [usize; 3]| (3..11).contains(&x) && (2..4).contains(&y) && (1..3).contains(&z);
    let bone = (0..grid.len()).map(|i| u8::from(inside(at(i)))).collect();
    let ends = (0..grid.len()).map(|i| match at(i)[0] {
        2 => 1u8,
        11 => 2,
        _ => 0,
    });
    nifti::write(&dir.path().join("scan.nii"), &Volume::from_vec(grid, bone)).unwrap();
    nifti::write(
        &dir.path().join("ends.nii"),
        &Volume::from_vec(grid, ends.collect()),
    )
    .unwrap();
    let out = path("out");
    let (code, _, stderr) = run(&[
        "segment",
        &path("scan.nii"),
        "-o",
        &out,
        "--lower",
        "1",
        "--crop",
        "2:13,1:5,0:4",
        "--turn",
        "x",
    ]);
    assert_eq!(code, 0, "{stderr}");
    let ends = path("ends.nii");
    let solve = |more: &[&str]| {
        run(&[
            &[
                "solve",
                &out,
                "--method",
                "voxel-fe",
                "--poisson",
                "0",
                "--json",
                "--supports",
                &ends,
            ],
            more,
        ]
        .concat())
    };
    // The turn makes z of x.
    let (code, stdout, stderr) = solve(&["--held", "1", "--moved", "2:0,0,0.01"]);
    assert_eq!(code, 0, "{stderr}");
    let row = &serde_json::from_str::<serde_json::Value>(&stdout).unwrap()[0];
    assert!(row["e_app_mpa"].is_null() && row["load"] == "labels" && row["ends"] == "labels");
    // E A / L = 1000 × 0.04 / 0.8, to the solver's 0.1 %.
    assert_near(row["stiffness_n_per_mm"].as_f64().unwrap(), 50.0, 1e-3);
    assert!(
        row["supports"]
            .as_str()
            .unwrap()
            .contains("held 1:xyz; moved 2:0,0,0.01; labels of ends.nii")
    );
    let table = std::fs::read_to_string(path("out/labels.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
    for (more, said) in [
        (
            &["--held", "5", "--moved", "2:0,0,0.01"][..],
            "has no label 5",
        ),
        (
            &["--held", "1:z", "--moved", "2:-,-,0.01"],
            "can still move",
        ),
        (
            &["--held", "1:w", "--moved", "2:0,0,0.01"],
            "some of x, y, z",
        ),
        (
            &["--held", "1", "--moved", "2:0,0,0.01", "--load", "torsion"],
            "moves ends",
        ),
        (
            &["--held", "1", "--moved", "2:0,0,0.01", "--strain", "1%"],
            "cannot be used",
        ),
        (&["--ends-depth", "0.05"], "label image is given"),
    ] {
        let (code, _, stderr) = solve(more);
        assert!(
            code == 2 && stderr.contains(said),
            "{said}: {code} {stderr}"
        );
    }
    let small = Volume::from_vec(Grid::new([3; 3], [0.1; 3]), vec![1u8; 27]);
    nifti::write(&dir.path().join("ends.nii"), &small).unwrap();
    let (code, _, stderr) = solve(&["--held", "1", "--moved", "2:0,0,0.01"]);
    assert!(code == 2 && stderr.contains("3 × 3 × 3 voxels"), "{stderr}");
}
