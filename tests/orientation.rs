//! Scans that are turned, resampled, rotated and cut flat before they are solved, against closed forms.

use crate::cli::run;
use bonepd_ct::grid::{Axis, Grid};
use bonepd_ct::image::nifti;
use bonepd_ct::measure::fabric::principal;
use bonepd_ct::pipeline::apparent::SolveParams;
use bonepd_ct::pipeline::apparent::solve_voxels;
use bonepd_ct::pipeline::segment::{Align, AlignBox, SegmentParams, SegmentSummary, Voi, segment};
use bonepd_ct::volume::{Specimen, Volume};
use std::f64::consts::PI;

const VOXEL_MM: f64 = 0.02;
const RADIUS_MM: f64 = 0.16;

/// Tilted by 30° from z.
fn tilted() -> [f64; 3] {
    let (angle, round) = (30f64.to_radians(), 40f64.to_radians());
    [
        angle.sin() * round.cos(),
        angle.sin() * round.sin(),
        angle.cos(),
    ]
}

/// A rod of grey value 1000 about the middle of a cube of 50 voxels, partial volumes from 27 points in each.
fn rod(direction: [f64; 3], half_length_mm: f64) -> Volume<f32> {
    let grid = Grid::new([50; 3], [VOXEL_MM; 3]);
    let inside = |p: [f64; 3]| {
        let p = p.map(|v| v * VOXEL_MM - 0.5);
        let along: f64 = (0..3).map(|a| p[a] * direction[a]).sum();
        let squared: f64 = p.iter().map(|v| v * v).sum();
        along.abs() < half_length_mm && squared - along * along < RADIUS_MM * RADIUS_MM
    };
    let values = (0..grid.len()).map(|i| {
        let p = [i % 50, i / 50 % 50, i / 2500].map(|v| v as f64);
        let part = |s: usize| [s % 3, s / 3 % 3, s / 9].map(|v| (v as f64 + 0.5) / 3.0);
        let hits = (0..27).filter(|&s| inside([0, 1, 2].map(|a| p[a] + part(s)[a])));
        1000.0 * hits.count() as f32 / 27.0
    });
    Volume::from_vec(grid, values.collect())
}

fn found(scan: &Volume<f32>, params: SegmentParams) -> (Specimen, SegmentSummary) {
    let params = SegmentParams {
        lower: Some(500.0),
        ..params
    };
    let done = segment("rod", scan, &params, None).unwrap();
    assert_eq!(done.scan.grid, done.specimen.bone.grid);
    (done.specimen, done.summary)
}

fn e_app_mpa(specimen: &Specimen, axis: Axis) -> f64 {
    let params = SolveParams {
        axis,
        tolerance: 1e-6,
        ..SolveParams::default()
    };
    let solved = solve_voxels(specimen, &params, |_| ()).unwrap();
    solved.moduli.e_app_mpa
}

fn degrees_apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    let cos: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    cos.abs().min(1.0).acos().to_degrees()
}

/// A prism of modulus E that runs through its box has E times its share of the section.
#[test]
fn a_tilted_rod_is_aligned_by_its_fabric_and_is_as_stiff_as_its_section() {
    let scan = rod(tilted(), 9.0);
    let (specimen, summary) = found(
        &scan,
        SegmentParams {
            align: Some(Align::Fabric),
            ..SegmentParams::default()
        },
    );
    let rotation = summary.rotation.unwrap();
    assert!(
        degrees_apart(rotation.direction, tilted()) < 1.0,
        "{rotation:?}"
    );
    assert!((rotation.angle_deg - 30.0).abs() < 1.0, "{rotation:?}");
    let after = principal(&specimen.bone, None).unwrap();
    assert!(
        degrees_apart(after.direction, [0.0, 0.0, 1.0]) < 1.0,
        "{after:?}"
    );
    let expected = 1000.0 * PI * RADIUS_MM * RADIUS_MM / specimen.area_mm2(Axis::Z);
    let ratio = e_app_mpa(&specimen, Axis::Z) / expected;
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    // As scanned it is a slanted strut, which bends.
    let (slanted, _) = found(&scan, SegmentParams::default());
    let section = 1000.0 * slanted.bv_tv();
    assert!(e_app_mpa(&slanted, Axis::Z) < 0.6 * section);
}

#[test]
fn an_excised_rod_in_air_is_aligned_whole_and_its_ends_cut_flat() {
    let half = 0.35;
    let (specimen, summary) = found(
        &rod(tilted(), half),
        SegmentParams {
            align: Some(Align::Direction(tilted().map(|v| 3.0 * v))),
            align_box: AlignBox::Whole,
            plane_cut_mm: Some(0.06),
            ..SegmentParams::default()
        },
    );
    // Blurred by interpolation, the rims of the ends are cut back by a voxel or two.
    let length = specimen.length_mm(Axis::Z);
    assert!(
        length <= 2.0 * half + 1e-9 && length > 2.0 * half - 0.1,
        "{length}"
    );
    let section = summary.bv_mm3 / length;
    // Measured: -2.7 %, the rims.
    assert!(
        (section / (PI * RADIUS_MM * RADIUS_MM) - 1.0).abs() < 0.04,
        "{section}"
    );
    let [low, high] = summary.plane_cut_mm.unwrap();
    assert!((low - high).abs() < 2.5 * VOXEL_MM, "{low} {high}");
    let ratio = e_app_mpa(&specimen, Axis::Z) / (1000.0 * specimen.bv_tv());
    assert!((ratio - 1.0).abs() < 0.04, "{ratio}");
}

#[test]
fn resampling_keeps_the_volume_of_bone() {
    let scan = rod(tilted(), 0.4);
    let exact = PI * RADIUS_MM * RADIUS_MM * 0.8;
    for (to, n) in [
        ([0.01; 3], [100; 3]),
        ([0.03; 3], [33; 3]),
        ([0.04; 3], [25; 3]),
        ([0.02, 0.025, 0.05], [50, 40, 20]),
    ] {
        let (specimen, summary) = found(
            &scan,
            SegmentParams {
                resample_mm: Some(to),
                ..SegmentParams::default()
            },
        );
        assert_eq!((summary.voxels, summary.spacing_mm), (n, to));
        // Of half-filled voxels as many are lost as won.
        assert!(
            (specimen.bv_mm3() / exact - 1.0).abs() < 0.02,
            "{to:?} {}",
            specimen.bv_mm3()
        );
    }
}

#[test]
fn a_turned_scan_is_the_scan_loaded_along_another_axis() {
    let grid = Grid::new([12, 9, 10], [0.02, 0.03, 0.025]);
    let frame = |[x, y, z]: [usize; 3]| x.abs_diff(z) < 4 || y < 3 || (x + 2 * y + z) % 5 == 0;
    let values = (0..grid.len()).map(|i| {
        let p = [i % 12, i / 12 % 9, i / 108];
        if frame(p) { 1000.0 } else { 0.0 }
    });
    let scan = Volume::from_vec(grid, values.collect());
    let (straight, _) = found(&scan, SegmentParams::default());
    for axis in [Axis::X, Axis::Y] {
        let params = SegmentParams {
            turn: axis,
            ..SegmentParams::default()
        };
        let (turned, summary) = found(&scan, params);
        let a = axis.index();
        assert_eq!(summary.spacing_mm[2], grid.spacing_mm[a]);
        assert_eq!(summary.spacing_mm[0], grid.spacing_mm[(a + 1) % 3]);
        let (one, other) = (e_app_mpa(&turned, Axis::Z), e_app_mpa(&straight, axis));
        assert!(
            one > 10.0 && (one / other - 1.0).abs() < 1e-4,
            "{one} {other}"
        );
    }
}

#[test]
fn a_volume_of_interest_goes_where_the_scan_goes() {
    let grid = Grid::new([12, 8, 10], [0.02; 3]);
    let scan = Volume::from_vec(grid, vec![1000f32; grid.len()]);
    let mask = (0..grid.len()).map(|i| u8::from(i % 12 < 6));
    let mask = Volume::from_vec(grid, mask.collect());
    let params = |params: SegmentParams| SegmentParams {
        lower: Some(500.0),
        voi: Voi::Mask("half.nii".into()),
        ..params
    };
    for settings in [
        SegmentParams {
            turn: Axis::X,
            ..SegmentParams::default()
        },
        SegmentParams {
            resample_mm: Some([0.01; 3]),
            ..SegmentParams::default()
        },
        SegmentParams {
            align: Some(Align::Direction([1.0, 0.0, 0.0])),
            ..SegmentParams::default()
        },
        SegmentParams {
            crop: Some([[0, 12], [0, 8], [0, 10]]),
            plane_cut_mm: Some(0.04),
            ..SegmentParams::default()
        },
    ] {
        let done = segment("block", &scan, &params(settings), Some(&mask)).unwrap();
        let half = 0.5 * grid.len() as f64 * grid.voxel_mm3();
        assert!(
            (done.summary.tv_mm3 / half - 1.0).abs() < 1e-9,
            "{:?}",
            done.summary
        );
        assert!(
            (done.summary.bv_mm3 / half - 1.0).abs() < 1e-9,
            "{:?}",
            done.summary
        );
    }
    let other = Volume::from_vec(Grid::new([3; 3], [0.02; 3]), vec![1u8; 27]);
    let cropped = params(SegmentParams {
        crop: Some([[0, 12], [0, 8], [0, 10]]),
        ..SegmentParams::default()
    });
    let e = segment("block", &scan, &cropped, Some(&other)).unwrap_err();
    assert!(e.to_string().contains("[3, 3, 3]"), "{e}");
}

/// A bar along x bears nothing along z until the recipe turns it; its files are read back as they were turned, whatever
/// their affine says.
#[test]
fn a_recipe_turns_a_scan_and_keeps_its_place_in_the_world() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let grid = Grid::new([14, 10, 8], [0.02; 3]);
    let bar = (0..grid.len()).map(|i| match [i / 14 % 10, i / 140] {
        [2..=6, 2..=5] => 900i16,
        _ => 0,
    });
    let mut scan = Volume::from_vec(grid, bar.collect());
    scan.affine = Some([
        [0.02, 0.0, 0.0, 7.0],
        [0.0, 0.02, 0.0, 8.0],
        [0.0, 0.0, 0.02, 9.0],
    ]);
    nifti::write(dir.path().join("bar.nii.gz").as_path(), &scan).unwrap();
    let recipe = "[segment]\nlower = 500.0\nturn = \"x\"\n[solve]\nmethod = \"voxel-fe\"\n";
    std::fs::write(dir.path().join("turned.toml"), recipe).unwrap();
    let e_app = |more: &[&str], out: &str| -> f64 {
        let (recipe, scan, out) = (at("turned.toml"), at("bar.nii.gz"), at(out));
        let mut words = vec!["run", recipe.as_str(), scan.as_str(), "-o", out.as_str()];
        words.extend(more);
        let (code, _, stderr) = run(&words);
        assert_eq!(code, 0, "{stderr}");
        let mut rows = csv::Reader::from_path(format!("{out}/results.csv")).unwrap();
        let column = rows
            .headers()
            .unwrap()
            .iter()
            .position(|h| h == "e_app_mpa");
        let row = rows.records().next().unwrap().unwrap();
        row[column.unwrap()].parse().unwrap()
    };
    let turned = e_app(&[], "out");
    assert!(
        (turned / (1000.0 * 20.0 / 80.0) - 1.0).abs() < 1e-3,
        "{turned}"
    );
    assert_eq!(e_app(&["--turn", "z"], "straight"), 0.0);
    let stored = bonepd_ct::image::scan::stored(dir.path().join("out/bar/mask.nii.gz").as_path());
    let stored = stored.unwrap();
    // The mask lies in the scan's own order, whatever axis was loaded.
    assert_eq!(stored.n, [14, 10, 8]);
    let rows = stored.affine.unwrap();
    assert!(
        rows[0][0] > 0.0199 && (rows[0][3] - 7.0).abs() < 1e-6,
        "{rows:?}"
    );
}
